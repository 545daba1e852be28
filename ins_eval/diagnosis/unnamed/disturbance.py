"""A disturbance that has no name: an interval of a channel, or a sensor that wanders beyond its grade.

What is wrong inflates the noise that is fitted without it, so each suspect is compared with the null at a noise of its
own. An interval is judged as the largest of all that were looked at (`locate`). One sensor that wanders more than the
others is in `one_sensor`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ins_eval.diagnosis.unnamed import locate
from ins_eval.diagnosis.unnamed.mismatch import Wander
from ins_eval.effects.parts import SENSORS
from ins_eval.error_model.null import is_coarse
from ins_eval.estimation.evidence import free, log_evidence, log_evidence_of, reduce
from ins_eval.recording import PARKED

if TYPE_CHECKING:
    from ins_eval.diagnosis.unnamed.locate import Channel, Interval, Significance
    from ins_eval.error_model.columns import Column
    from ins_eval.estimation.blocks import Blocks
    from ins_eval.estimation.case import Case
    from ins_eval.estimation.noise_fit import Fitted
    from ins_eval.estimation.whitening import Whitened
    from ins_eval.policy import Policy

QUIET = -2.0  # prior sigmas of a level that nothing else feigns: by reasoning
OF_SENSORS = ("accelerometer_wander", "gyro_wander")
OF_RECEIVERS = ("slow_position", "slow_velocity", "slow_attitude", "slow_heading")
OF_ATTITUDE = ("slow_attitude", "slow_heading")  # of a reference, or of what a parked unit stands on and leans with
OF_BENCH = ("slow_position",)  # the slow error of an accelerometer in a chamber


@dataclass(frozen=True, eq=False)
class Suspect:
    """An interval of recording `recording` after its refit; `gain` in nats less the log of what was looked at.

    `follows` is the motion that the disturbance follows, where it is known to follow one, `wander` what the sensor does
    where it wanders beyond its grade.
    """

    recording: int
    interval: Interval
    gain: float
    probability: float
    sigma: float
    fitted: Fitted
    follows: str = ""
    wander: Wander | None = None


def is_sure(suspect: Suspect, policy: Policy) -> bool:
    """Whether a suspect counts as a mismatch."""
    return suspect.probability <= policy.largest_probability(suspect.interval.channel.name)


def surest_of(suspects: Iterable[Suspect], policy: Policy) -> Suspect | None:
    """The sure one that gains most, if any."""
    return max((one for one in suspects if is_sure(one, policy)), key=lambda one: one.gain, default=None)


def of_windows(
    case: Case,
    noise_point: np.ndarray,
    chosen: Sequence[Column] = (),
    sensors: bool = False,
    blocks: Blocks | None = None,
) -> tuple[list[Channel], np.ndarray, Whitened]:
    """Channels, edges and the sums of nuisances, `chosen` columns and all windows, or only those of the `sensors`.

    On `blocks`, by default those of the fit of the noise.
    """
    over, edges_s, windows = windows_of(case, sensors)
    return over, edges_s, case.whitened([*chosen, *windows], noise_point, case.blocks if blocks is None else blocks)


def windows_of(case: Case, sensors: bool = False) -> tuple[list[Channel], np.ndarray, list[Column]]:
    """Channels, or only those of the `sensors`, edges, and every window of every channel."""
    over, edges_s = locate.channels(case), locate.edges(case.model)
    if sensors:
        over = [one for one in over if one.name.startswith(SENSORS)]
    windows = [column for channel in over for column in locate.windows(channel, edges_s, case.slow, case.model)]
    return over, edges_s, windows


def intervals(case: Case, r: int, base: Fitted, rng: np.random.Generator, policy: Policy) -> list[Suspect]:
    """The most remarkable intervals of a recording, each at its own noise.

    What is off for a time may pass for slow noise, so they are sought where that is quiet too; what a window leaves at
    the edges of so large an error would pass for it again, so these are made exact first.
    """
    quiet = _with_quiet(case, base.noise_point, (*OF_SENSORS, *OF_RECEIVERS))
    starts = [base.noise_point] if (quiet == base.noise_point).all() else [base.noise_point, quiet]
    suspects = []
    over, edges_s, windows = windows_of(case)
    ready = case.ready(windows)
    for noise_point in starts:
        reduced = reduce(ready(noise_point), len(case.nuisances))
        trials = locate.significance(reduced, edges_s.size - 1, rng)
        found = [one for one in locate.scan(reduced, over, edges_s) if not within_statement(case, one, policy)]
        for one in found[: policy.suspects]:
            if trials.probability(one.t2) < policy.remarkable:
                if noise_point is base.noise_point:
                    suspects.append(_refitted(case, r, base, one, trials, noise_point))
                else:
                    exact = locate.refined(case, one, noise_point)
                    suspects.append(_refitted(case, r, base, exact, trials.finer, noise_point))
    return suspects


def within_statement(case: Case, interval: Interval, policy: Policy) -> bool:
    """Whether a position that is off for a time is so by less than its receiver states, times `Policy.stated`."""
    if interval.channel.name != "gps.position":
        return False
    stated = float(np.median(case.seen.sigma[:, interval.channel.row]))
    return abs(interval.size) * interval.channel.size < policy.stated * stated


def _refitted(case: Case, r: int, base: Fitted, interval: Interval, trials: Significance, start: np.ndarray) -> Suspect:
    known = slice(0, len(case.nuisances))
    fitted = case.fitted([interval.column(case.slow, case.model)], replace(base, noise_point=start), free)
    there = log_evidence_of(fitted.whitened, known) - 0.5 * float(fitted.noise_point @ fitted.noise_point)
    # the null is tried with the suspect's noise too: a better search is no gain
    ratio = max(0.0, 2.0 * (fitted.log_evidence - max(base.log_evidence, there)))
    return Suspect(
        r, interval, 0.5 * ratio - float(np.log(trials.trials)), trials.probability(ratio), trials.sigma(ratio), fitted
    )


def restless(case: Case, r: int, fitted: Fitted, policy: Policy, chosen: Sequence[Column] = ()) -> Suspect | None:
    """The sensor that wanders beyond what its grade does, where it does so most; None where all keep within bounds.

    A wander that is free takes up whatever is slow, also what has a name. More than `Policy.wander` prior sigmas of it
    are a finding where they are more probable than a wander at that bound by `Policy.near` nats; not of the gyros of a
    parked unit, which nothing tells from a stand that turns. `chosen` are effects with which the noise was fitted.
    """
    levels = OF_BENCH if case.believed is None else OF_SENSORS[:1] if case.kind in PARKED else OF_SENSORS
    free = np.array(case.noise.free)
    beyond = np.isin(free, levels) & (fitted.noise_point > policy.wander)
    if not beyond.any():
        return None
    gains = {}
    for name in free[beyond]:
        bounded = np.where(free == name, policy.wander, fitted.noise_point)
        height = log_evidence(case.ready(chosen)(bounded)) - 0.5 * float(bounded @ bounded)
        gains[name] = fitted.log_evidence - height
    name = max(gains, key=gains.__getitem__)
    if gains[name] < policy.near:
        return None
    quiet = with_quiet_sensors(case, fitted.noise_point)
    over, edges_s, whitened = of_windows(case, quiet, chosen, sensors=case.believed is not None)
    found = locate.scan(reduce(whitened, len(case.nuisances) + len(chosen)), over, edges_s)
    sensor = "gyro" if name == "gyro_wander" else "accelerometer"
    interval = next((one for one in found if one.channel.name.startswith(sensor)), None)
    if interval is None:
        return None
    at_bound = np.where(beyond, policy.wander, fitted.noise_point)
    sigmas = (case.noise.values(point)[name] for point in (fitted.noise_point, at_bound))
    sigma = float(np.sqrt(2.0 * gains[name]))
    return Suspect(r, interval, gains[name], 0.0, sigma, fitted, wander=Wander(sensor, *map(float, sigmas)))


def with_quiet_sensors(case: Case, noise_point: np.ndarray) -> np.ndarray:
    """`noise_point` moved to sensors that wander little, and a stand that leans little; in a chamber, to the noise that
    is believed."""
    if case.believed is None:
        return np.zeros_like(noise_point)
    return _with_quiet(case, noise_point, (*OF_SENSORS, *OF_ATTITUDE) if case.kind in PARKED else OF_SENSORS)


def quieter(case: Case, noise_point: np.ndarray) -> np.ndarray:
    """`noise_point` without what an effect may have made look noisy: sensors, and a reference that knows attitude.

    But coarse sensors in motion do wander: jumps and laws enough would describe any path of them.
    """
    if case.believed is None or case.kind in PARKED:
        return with_quiet_sensors(case, noise_point)
    coarse = is_coarse(case.believed.recording.belief)
    return _with_quiet(case, noise_point, OF_ATTITUDE if coarse else (*OF_SENSORS, *OF_ATTITUDE))


def within_grade(case: Case, noise_point: np.ndarray, policy: Policy) -> np.ndarray:
    """`noise_point` with a wander in a chamber of at most what its grade does: one beyond would swallow any effect."""
    if case.believed is not None:
        return noise_point
    return np.where(np.isin(case.noise.free, OF_BENCH), np.minimum(noise_point, policy.wander), noise_point)


def _with_quiet(case: Case, noise_point: np.ndarray, levels: Sequence[str]) -> np.ndarray:
    """`noise_point` with every one of `levels` that is above `QUIET` set to it."""
    loud = np.isin(case.noise.free, levels) & (noise_point > QUIET)
    return np.where(loud, QUIET, noise_point)
