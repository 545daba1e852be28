"""The disturbance of one channel estimated without a model, beside what an effect makes of it.

It is the open form of the channel (`open_form`) on the partial residual: all that is uncertain and the best set are
taken off at their best values, and what the effect in question does to that one channel is put back,

    b = b_left + A d,   d the mean of the effect in each window,

so that data may bend what the effect says, and show what it leaves. The band is that of the open form alone. Where no
effect explains the channel the noise of the instrument is at most what is believed of it.

Source: Larsen and McCleary, Technometrics 14 (1972) 781 (partial residual plots).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ins_eval.diagnosis.answer.experiments import OF_INSTRUMENT
from ins_eval.diagnosis.unnamed import locate
from ins_eval.diagnosis.unnamed.open_form import open_form
from ins_eval.effects.parts import SENSORS
from ins_eval.error_model import drives
from ins_eval.error_model.columns import TO_POSITION, TO_VELOCITY, Column
from ins_eval.estimation.evidence import reduce
from ins_eval.units import ARCSEC, DEG_PER_H, HOUR, UG

if TYPE_CHECKING:
    from ins_eval.diagnosis.answer.verdict import Diagnosis, FoundEffect
    from ins_eval.diagnosis.unnamed.mismatch import Mismatch
    from ins_eval.error_model.library import Candidate
    from ins_eval.estimation.case import Case
    from ins_eval.estimation.study import Hypothesis

UNITS = {  # of a disturbance, and its SI value
    "accelerometer": ("ug", UG),
    "gyro": ("deg/h", DEG_PER_H),
    "position": ("m", 1.0),
    "velocity": ("m/s", 1.0),
    "attitude": ("arcsec", ARCSEC),
}
MULTIPLIED = {  # by ppm and urad: the factor from the unit of the channel, and the unit
    "accelerometer": (1.0, "g"),
    "gyro": (1e6 / HOUR, "deg/s"),
    "position": (1e6, "m"),
    "velocity": (1e6, "m/s"),
    "attitude": (1e6 * ARCSEC, ""),
}
STEADY = 0.1  # relative change below which a drive is as good as constant


@dataclass(frozen=True, eq=False)
class Located:
    """The disturbance of one channel of recording number `recording`, (windows,) each, in `unit`.

    `mean` and `sigma` are what the open form finds, NaN where nothing was measured. `effect` is what the effect makes
    of the channel, NaN without one. `drive`, in `drive_unit`, is what its value multiplies, or without an effect the
    temperature; None where there is none or it is constant.
    """

    recording: int
    channel: str
    axis: str
    unit: str
    time_s: np.ndarray
    mean: np.ndarray
    sigma: np.ndarray
    effect: np.ndarray
    drive: np.ndarray | None
    drive_unit: str


def located(found: Diagnosis, effect: FoundEffect | None = None) -> Located | None:
    """The disturbance of the channel that `effect` acts on, or, without an effect, of the channel left unexplained.

    None where there is nothing of the kind: an effect that belongs to the start, or nothing that stays unexplained.
    """
    if effect is None:
        one = found.unnamed.mismatch
        return None if one is None else _of_mismatch(found, one)
    linearisation, key = found.linearisation, effect.hypothesis.key
    members = list(linearisation.best.members)
    at = next(i for i, k in enumerate(members) if linearisation.hypotheses[k].key == key)
    mean, _ = linearisation.coefficients
    one, coefficient = linearisation.hypotheses[members[at]], float(mean[at])
    r = _recording(found, one)
    case = linearisation.cases[r]
    channel, made = _affected(case, one.columns[r])
    if channel is None:
        return None
    others = [h.columns[r] for i, h in enumerate(linearisation.chosen()) if i != at and h.columns[r] is not None]
    moved = coefficient - float(linearisation.point[members[at]])
    unit, si = UNITS[_kind(channel)]
    edges_s = locate.edges(case.model)
    of_windows = coefficient * _window_means(case, channel, made, edges_s)
    mean_, sigma = _open(
        case, linearisation.fitted[r].noise_point, channel, edges_s, others, one.columns[r], moved, of_windows
    )
    per_value, drive_unit = _drive_unit(one.candidate, channel)
    drive = per_value * of_windows / si / (coefficient * one.candidate.nominal)
    seen = np.isfinite(of_windows)
    steady = np.ptp(drive[seen]) <= STEADY * np.abs(drive[seen]).max()
    return Located(
        recording=r,
        channel=channel.name,
        axis=channel.axis,
        unit=unit,
        time_s=0.5 * (edges_s[:-1] + edges_s[1:]),
        mean=np.where(seen, mean_ / si, np.nan),
        sigma=np.where(seen, sigma / si, np.nan),
        effect=of_windows / si,
        drive=None if steady else drive,
        drive_unit=drive_unit,
    )


def _of_mismatch(found: Diagnosis, one: Mismatch) -> Located | None:
    """The open form of the channel of a mismatch that nothing explains, beside the effects, against the temperature."""
    r, linearisation = one.recording, found.linearisation if found.effects else None
    case = found.cases[r] if linearisation is None else linearisation.cases[r]
    beside = [] if linearisation is None else [h.columns[r] for h in linearisation.chosen() if h.columns[r] is not None]
    over = locate.channels(case)
    channel = next((c for c in over if (c.name, c.axis) == (one.channel, one.axis)), None)
    if channel is None:
        return None
    edges_s = locate.edges(case.model)
    none = np.zeros(edges_s.size - 1)
    mean, sigma = _open(
        case, _as_believed(case, found.fitted[r].noise_point), channel, edges_s, beside, None, 0.0, none
    )
    unit, si = UNITS[_kind(channel)]
    drive = None
    if case.temperature is not None:
        axis = "xyz".index(channel.axis) if channel.axis in "xyz" else 0
        drive = _means(case.temperature.time_s, case.temperature.smooth_c[:, axis], edges_s)
    time_s = 0.5 * (edges_s[:-1] + edges_s[1:])
    nothing = np.full(none.size, np.nan)
    return Located(r, channel.name, channel.axis, unit, time_s, mean / si, sigma / si, nothing, drive, "degC")


def _as_believed(case: Case, noise_point: np.ndarray) -> np.ndarray:
    """The noise at `noise_point`, but the instrument's no larger than believed: what has no name has inflated it."""
    own = np.isin(case.noise.free, OF_INSTRUMENT)
    return np.where(own, np.minimum(noise_point, 0.0), noise_point)


def _open(
    case: Case,
    noise_point: np.ndarray,
    channel: locate.Channel,
    edges_s: np.ndarray,
    others: Sequence[Column],
    effect: Column | None,
    moved: float,
    put_back: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Mean and sigma (windows,) in SI of the channel, what is uncertain anyway and `others` at their best.

    The recording was navigated without `effect` but for `moved` of its coefficient; `put_back` (windows,) is in SI.
    """
    own = [] if effect is None else [effect]
    columns = [*others, *own, *locate.windows(channel, edges_s, case.slow, case.model)]
    whitened = case.whitened(columns, noise_point, case.blocks)
    known = len(case.nuisances) + len(others)
    first = known + len(own)
    off = moved * whitened.normal[:, known:first].sum(axis=1)
    b = whitened.projection - off
    a = whitened.normal[first:, first:]
    if effect is None:  # what is uncertain anyway would take over a part of what has no name: its best beside that
        joint = reduce(whitened, known)
        b_known = b[:known] - whitened.normal[:known, first:] @ open_form(0, joint.normal, joint.projection).mean
    else:
        b_known = b[:known]
    best = np.linalg.solve(np.eye(known) + whitened.normal[:known, :known], b_known)
    left = b[first:] - whitened.normal[first:, :known] @ best
    form = open_form(0, a, left + a @ (np.nan_to_num(put_back) / channel.size))
    return channel.size * form.mean, channel.size * form.sigma


def _recording(found: Diagnosis, one: Hypothesis) -> int:
    """The recording in which an effect shows."""
    candidate = one.candidate
    channel = candidate.channel
    for mismatch in found.mismatches:
        if mismatch.channel == channel and one.columns[mismatch.recording] is not None:
            return mismatch.recording
    return next(r for r, column in enumerate(one.columns) if column is not None)


def _affected(case: Case, column: Column) -> tuple[locate.Channel | None, np.ndarray]:
    """The channel that a column disturbs most, and how: SI, at the middle of the epochs of a sensor, else at nodes."""
    over = {(c.name, c.axis): c for c in locate.channels(case)}
    driven, measured = disturbances(case, column)
    best, most, how = None, 0.0, np.zeros(0)
    for channel in over.values():
        if channel.row < 0:
            part = driven[:, 3 * SENSORS.index(_kind(channel)) + "xyz".index(channel.axis)]
        else:
            part = np.where(np.isfinite(case.seen.residual[:, channel.row]), measured[:, channel.row], np.nan)
        energy = float(np.nanmean(part**2)) / channel.size**2 if np.isfinite(part).any() else 0.0
        if energy > most:
            best, most, how = channel, energy, part
    return best, how


def disturbances(case: Case, column: Column) -> tuple[np.ndarray, np.ndarray]:
    """What a column is to each accelerometer and gyro (epochs, 6), x, y, z, and to each measurement (nodes, 9), in SI.

    A drive D of an epoch is the error (D . e) / (e . e) of a sensor whose axis of unit error drives e: its own
    multiplier and slow factor; of a missing term of the Earth what it is along that axis.
    """
    whole = case.assembled([column])
    own = len(case.nuisances) + 1
    driven = np.zeros((whole.slow_epochs.shape[1], 6))
    for (c, target, source, slow), weight in zip(whole.drive_terms, whole.drive_weights, strict=True):
        if c != own or target == TO_POSITION:  # a position that moves is the error of no sensor
            continue
        sensor = SENSORS[0] if target == TO_VELOCITY else SENSORS[1]
        sign = 1.0 if sensor == SENSORS[0] else -1.0
        for axis in range(3):
            along = whole.sources[:, drives.source(sensor, axis, "1")]
            part = drives.strength(whole.sources[:, source], along)
            driven[:, 3 * SENSORS.index(sensor) + axis] += sign * weight * whole.slow_epochs[slow] * part
    measured = np.zeros((case.model.nodes_s.size, 9))
    for (c, source, slow), weight in zip(whole.observation_terms, whole.observation_weights, strict=True):
        if c == own:
            measured += weight * whole.slow_nodes[slow][:, None] * whole.observed[:, source]
    return driven, measured


def _window_means(case: Case, channel: locate.Channel, values: np.ndarray, edges_s: np.ndarray) -> np.ndarray:
    return _means(case.model.middle_s if channel.row < 0 else case.model.nodes_s, values, edges_s)


def _means(time_s: np.ndarray, values: np.ndarray, edges_s: np.ndarray) -> np.ndarray:
    """Mean of the values that are known in each window (n,), NaN where there is none."""
    known = np.isfinite(values)
    window = np.clip(np.searchsorted(edges_s, time_s[known], side="right") - 1, 0, edges_s.size - 2)
    count = np.bincount(window, minlength=edges_s.size - 1)
    total = np.bincount(window, weights=values[known], minlength=edges_s.size - 1)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _kind(channel: locate.Channel) -> str:
    if channel.row < 0 or channel.name.startswith(SENSORS):
        return channel.name.partition(".")[0]
    return ("position", "velocity", "attitude")[channel.row // 3]


def _drive_unit(candidate: Candidate, channel: locate.Channel) -> tuple[float, str]:
    """The factor and the unit of what the value multiplies: that of the channel over that of the value."""
    of_channel, unit = UNITS[_kind(channel)][0], candidate.unit
    if unit == of_channel:
        return 1.0, ""
    for above in (of_channel, f"({of_channel})"):
        for between in ("/", " per unit of "):
            if unit.startswith(above + between):
                below = unit.removeprefix(above + between)
                return 1.0, below if "^" in below else below.strip("()")
    for above in ("ppm", "urad"):
        if unit == above or unit.startswith(f"{above}/"):
            factor, times = MULTIPLIED[_kind(channel)]
            return factor, f"{times} {unit.removeprefix(above).removeprefix('/')}".strip()
    return 1.0, f"{of_channel} per {unit}"
