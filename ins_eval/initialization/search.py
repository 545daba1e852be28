"""The most likely state of a window among several first headings, and what follows from it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ins_eval.errors import DataRefused
from ins_eval.initialization.guess import carried_back, first_guess, first_variances, stated_heading_sigma, turned
from ins_eval.initialization.smoother import one_pass, scatter, settle
from ins_eval.initialization.state import (
    ACCELEROMETER_BIAS,
    GATE,
    GYRO_BIAS,
    KNOWN_HEADING_RAD,
    MOVING_MPS,
    STATES,
    Initialization,
    Window,
    until,
    wrapped,
)
from ins_eval.initialization.windows import WIDE_GYRO_BIAS_RADPS, first_window, standstills, window_of
from ins_eval.recording import PARKED, Recording
from ins_eval.recording.consistency.alternatives import BEYOND_DOUBT
from ins_eval.recording.stillness import Stretch
from ins_eval.strapdown import Solution, navigate
from ins_eval.units import DEG, DEG_PER_H, HOUR

ENOUGH_HEADING_RAD = 3.0 * DEG
ALIKE_RAD = 1.0 * DEG  # headings nearer to one another are one: by reasoning
HEADINGS = 12  # first guesses
KEPT = (12, 6, 4, 2)  # guesses that go on, as the part of the window grows to whole
GROWTH = (10.0, 20.0, 40.0, np.inf)  # s of motion in each of these parts
PASSES = 8
WIDENED = 2.0  # times what is believed that fixes scatter, from which the first part is settled again: by reasoning
APART = np.log(20.0)  # a heading whose likelihood is nearer than this to the best's is a rival
PIECE_S, LEAST_PIECE_S = 30.0, 1.0  # of a recording that is followed from its first window on
RARE = np.log(HOUR / PIECE_S)  # of biases that jump, once in an hour: by reasoning


def find(recording: Recording, dtheta_b: np.ndarray, dv_b: np.ndarray) -> Initialization:
    """The state at the end of the first window that shows it.

    Parameters
    ----------
    dtheta_b, dv_b : (n, 3) increments in rad and m/s, with what is believed taken off

    The window holds the standstill before the first motion and a minute of motion, and is made longer, up to five
    minutes, while the heading is not known to 3 degrees. Without motion it is the standstill alone.
    A stated attitude is that of the start: where the window begins later, gyros carry it there.
    Raises: DataRefused where there is neither a standstill nor fixes that move.
    """
    begin_s, moves_s, end_s, last_s = first_window(recording)
    recording = _carried(recording, dtheta_b, dv_b, begin_s)
    while True:
        window = replace(window_of(recording, dtheta_b, dv_b, begin_s, end_s), moves_s=moves_s)
        found = _best(recording, window, begin_s)
        if end_s >= last_s or found.heading_sigma_rad < ENOUGH_HEADING_RAD:
            found = _of_any_heading(recording, window, found)
            if end_s >= last_s or found.heading_sigma_rad < ENOUGH_HEADING_RAD:
                return found
        end_s = min(last_s, begin_s + 1.6 * (end_s - begin_s))


def _of_any_heading(recording: Recording, window: Window, found: Initialization) -> Initialization:
    """What is `found` with the heading that is stated; where fixes scatter there, with another if it leads by far."""
    if max(found.fix_scale) < WIDENED or stated_heading_sigma(recording) > KNOWN_HEADING_RAD:
        return found
    unstated = replace(recording, start=replace(recording.start, attitude_rad=None))
    free = _best(unstated, window, found.window.start_s, found.fix_scale)
    return free if free.log_likelihood > found.log_likelihood + BEYOND_DOUBT else found


def _carried(recording: Recording, dtheta_b: np.ndarray, dv_b: np.ndarray, begin_s: float) -> Recording:
    """The recording with the attitude that is stated of its start as it is at `begin_s`, and a sigma of the heading.

    It is the same of a vehicle that stands until then. Of another it is that of the gyros, and drifts with their bias.
    """
    start, time_s = recording.start, recording.imu.time_s
    rows = time_s < begin_s + 1e-6
    if start.attitude_rad is None or recording.kind in PARKED or not rows.any():
        return recording
    if _stands_until(recording, begin_s, standstills(recording)):
        return recording
    stated = recording.belief.gyro.bias_sigma_deg_per_h
    bias = WIDE_GYRO_BIAS_RADPS if stated is None else DEG_PER_H * stated
    sigma = np.hypot(stated_heading_sigma(recording), bias * (begin_s - start.time_s))
    attitude = navigate(time_s[rows], dtheta_b[rows], dv_b[rows], start).attitude_rad[-1]
    carried = replace(start, attitude_rad=tuple(float(a) for a in attitude), attitude_sigma_rad=(sigma, sigma, sigma))
    return replace(recording, start=carried)


def _best(
    recording: Recording, window: Window, begin_s: float, scale: tuple[float, float] = (1.0, 1.0)
) -> Initialization:
    """The most likely of several first headings, settled; what it leaves open is in its covariance.

    `scale` is by how much fixes are known to scatter beyond their sigmas.
    """
    still = bool(window.still_s.size) and window.still_s[0, 0] < begin_s + 1.0
    prior = np.diag(first_variances(recording, window, still))
    guess = first_guess(recording, window, begin_s, still)
    moving = window.fixes is not None and bool((np.linalg.norm(window.fixes.velocity_n, axis=1) > MOVING_MPS).any())
    open_heading = moving and stated_heading_sigma(recording) > KNOWN_HEADING_RAD
    turns = 2.0 * np.pi * np.arange(HEADINGS) / HEADINGS if open_heading else [0.0]
    ends = [turned(guess, angle) for angle in turns]
    for kept, seconds in zip(KEPT, GROWTH, strict=True):
        part = until(window, window.moves_s + seconds)
        settled = _settled(_wider(part, scale), ends, prior)
        seen = scatter(part, settled[0], prior) if np.isfinite(settled[0].log_likelihood) else scale
        too_narrow = max(np.divide(seen, scale)) > WIDENED
        if seconds == GROWTH[0] and too_narrow:  # fixes that were believed too well have bent the state
            settled = _settled(_wider(part, seen), ends, prior)
            seen = scatter(part, settled[0], prior) if np.isfinite(settled[0].log_likelihood) else seen
        scale, ends = seen, settled[:kept]
    first = ends[0]
    if not np.isfinite(first.log_likelihood):
        raise DataRefused(
            f"{recording.name}: no attitude makes IMU and fixes agree from {begin_s:.6g} to {window.time_s[-1]:.6g} s; "
            "check axes, units and clocks (ins-eval import examines them), or give attitude_deg in [start]"
        )
    if window.fixes is not None:
        window = _wider(window, scale)
        ends = _settled(window, ends, prior)
        first = replace(ends[0], fix_scale=scale)
    end = replace(one_pass(window, first, prior, GATE), fix_scale=first.fix_scale)
    return _with_rivals(end, [one_pass(window, one, prior, GATE) for one in ends[1:]])


def _settled(window: Window, guesses: list[Initialization], prior: np.ndarray) -> list[Initialization]:
    """The guesses settled on a window, the most likely first; those that come to one heading are one."""
    ends = sorted((settle(window, one, prior, PASSES) for one in guesses), key=lambda one: -one.log_likelihood)
    found: list[Initialization] = []
    for end in ends:
        heading = end.start.attitude_rad[2]
        if all(abs(wrapped(one.start.attitude_rad[2] - heading)) > ALIKE_RAD for one in found):
            found.append(end)
    return found


def _wider(window: Window, scale: tuple[float, float]) -> Window:
    """The window with sigmas of positions and velocities that are larger by a factor each."""
    return replace(window, fix_sigma=tuple(s * x for s, x in zip(window.fix_sigma, scale, strict=True)))


def _with_rivals(best: Initialization, others: list[Initialization]) -> Initialization:
    """Headings nearly as likely widen the covariance: that of the mixture about the best."""
    covariance = best.covariance.copy()
    rivals: list[float] = []
    heading = best.start.attitude_rad[2]
    for other in others:
        below = best.log_likelihood - other.log_likelihood
        away = wrapped(other.start.attitude_rad[2] - heading)
        known = [0.0, *(wrapped(one - heading) for one in rivals)]
        if below < APART and min(abs(wrapped(away - one)) for one in known) > 3.0 * best.sigmas[8]:
            rivals.append(other.start.attitude_rad[2])
            covariance[8, 8] += np.exp(-below) / (1.0 + np.exp(-below)) * away**2
    return replace(best, covariance=covariance, rival_headings_rad=tuple(rivals))


def follow(
    recording: Recording,
    begin: Initialization,
    dtheta_b: np.ndarray,
    dv_b: np.ndarray,
    until_s: float,
    still: Sequence[Stretch],
    gate: float = GATE,
) -> Initialization:
    """The state at `until_s`, from that of `begin` and what was measured in between, up to `gate` sigmas.

    `recording` may be the part in between; `still` are the `standstills` of the whole.
    Raises DataRefused where the samples in between carry it away.
    """
    window = window_of(recording, dtheta_b, dv_b, begin.start.time_s, until_s, still)
    window = _wider(window, begin.fix_scale)
    begin = replace(begin, about=None, taken=np.zeros(STATES))
    covariance = begin.covariance
    first = one_pass(window, begin, covariance, gate)
    wide = covariance + _of_a_jump(window)
    jumped = one_pass(window, begin, wide, gate)
    if _leads(jumped, first):  # and also where fixes scatter as much as beside it, for they may do so without any jump
        shown = _wider(window, scatter(window, replace(begin, about=jumped.about), wide))
        if _leads(*(one_pass(shown, begin, one, gate) for one in (wide, covariance))):
            covariance, first = wide, jumped
    if not np.isfinite(first.log_likelihood):
        raise DataRefused(
            f"{recording.name}: between {begin.start.time_s:.6g} and {until_s:.6g} s the samples carry the INS away, "
            "expected increments that can be navigated; look at gyros and accelerometers there"
        )
    return replace(one_pass(window, replace(begin, about=first.about), covariance, gate), about=None)


def _leads(jumped: Initialization, first: Initialization) -> bool:
    return bool(jumped.log_likelihood > first.log_likelihood + APART + RARE)


def _of_a_jump(window: Window) -> np.ndarray:
    """Covariance (21, 21) that a jump of the biases adds, which may be as large as what they are turned on with."""
    variance = np.zeros(STATES)
    variance[GYRO_BIAS], variance[ACCELEROMETER_BIAS] = (sigma**2 for sigma in window.bias_sigma)
    return np.diag(variance)


def track(recording: Recording, begin: Initialization, dtheta_b: np.ndarray, dv_b: np.ndarray) -> Solution:
    """The whole way, from what was measured on it: smoothed over the window of `begin`, and by pieces around it."""
    first_s, at_s = recording.start.time_s, float(begin.path.time_s[0])
    still = standstills(recording)
    before = []
    if at_s - first_s > LEAST_PIECE_S and not _stands_until(recording, at_s, still):
        rows = recording.imu.time_s < at_s + 1e-6
        part = window_of(recording, dtheta_b, dv_b, first_s, min(at_s, first_s + PIECE_S), still)
        state = carried_back(recording, begin, part, dtheta_b[rows], dv_b[rows])
        before = list(_followed(recording, state, dtheta_b, dv_b, at_s, still))
    after = _followed(recording, begin, dtheta_b, dv_b, float(recording.imu.time_s[-1]), still)
    pieces = [*before, begin.path, *after]
    parts = {name: [getattr(one, name)[:-1] for one in pieces] for name in Solution.__dataclass_fields__}
    return Solution(**{name: np.concatenate([*of, getattr(pieces[-1], name)[-1:]]) for name, of in parts.items()})


def _followed(
    recording: Recording,
    state: Initialization,
    dtheta_b: np.ndarray,
    dv_b: np.ndarray,
    last_s: float,
    still: Sequence[Stretch],
) -> Iterator[Solution]:
    """The way from `state` on until `last_s`, smoothed within each piece."""
    while state.start.time_s < last_s - LEAST_PIECE_S:
        end_s = state.start.time_s + PIECE_S
        end_s = last_s if end_s > last_s - LEAST_PIECE_S else end_s
        part, rows = recording.between(state.start.time_s, end_s)
        # no fix is left out: one that is late looks like an outlier wherever the motion is fast
        state = follow(part, state, dtheta_b[rows], dv_b[rows], end_s, still, np.inf)
        yield state.path


def _stands_until(recording: Recording, time_s: float, still: Sequence[Stretch]) -> bool:
    """Whether a vehicle stands from the start of the recording until then."""
    return any(s.start_s <= recording.start.time_s + 1.0 and time_s <= s.end_s for s in still)
