"""A recording to its navigation errors: compensation, alignment, mechanization, comparison. Simulated or real."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ins_eval.alignment import Alignment, AlignmentNoise, align
from ins_eval.compensation import CompensationModel, Samples
from ins_eval.errors import DataRefused
from ins_eval.recording import Fixes, Recording
from ins_eval.reference import Errors, compare, standstill
from ins_eval.strapdown import Solution, Vertical, navigate
from ins_eval.thermal import filtered_rate


@dataclass(frozen=True)
class Evaluation:
    """One recording navigated once: the solution, how it was aligned (None: attitude given), its errors."""

    solution: Solution
    alignment: Alignment | None
    errors: Errors


def samples(recording: Recording) -> tuple[Samples, ...]:
    """What a compensation model may see of the three accelerometers of a recording whose output is in pulses."""
    imu = recording.imu
    if imu.temperature_c is None:
        raise DataRefused(
            f"{recording.name}: output in pulses without a temperature; expected temperature_c to compensate with"
        )
    interval_s = np.diff(imu.time_s, prepend=recording.start.time_s)
    of_axis = imu.temperature_c if imu.temperature_c.ndim == 2 else imu.temperature_c[:, None]
    readings = [np.ascontiguousarray(column) for column in of_axis.T]
    rates = [filtered_rate(imu.time_s, reading) for reading in readings]
    return tuple(
        Samples(
            imu.time_s,
            imu.accelerometer[:, axis] / interval_s,
            readings[axis % len(readings)],
            rates[axis % len(rates)],
        )
        for axis in range(3)
    )


def compensate(seen: Sequence[Samples], triad: Sequence[CompensationModel], start_s: float) -> np.ndarray:
    """Velocity increments (n, 3) in m/s that the three fitted models make of the samples they see."""
    interval_s = np.diff(seen[0].time_s, prepend=start_s)
    return np.stack(
        [model.specific_force(of_axis) * interval_s for of_axis, model in zip(seen, triad, strict=True)], axis=1
    )


def evaluate(
    recording: Recording,
    velocity: np.ndarray,
    align_between_s: tuple[float, float] | None = None,
    until_s: float = np.inf,
    every: int = 1,
    vertical: Vertical = "damped",
    noise: AlignmentNoise | None = None,
) -> Evaluation:
    """Navigate a recording by pure inertial mechanization and compare it with what is known.

    Parameters
    ----------
    velocity : (n, 3) compensated velocity increments, m/s
    align_between_s : stretch at rest on which to align; navigation begins at its end. None: the attitude of the
        recording's start is taken
    until_s : end of navigation
    every : one row of the solution for so many steps of four samples

    Notes
    -----
    Compared with `recording.reference` where there is one, else with its GPS, else with the known standstill of
    a parked recording. The vertical channel is damped by baro height where recorded, else by the start's height.
    """
    imu = recording.imu
    begin = recording.start
    alignment = None
    if align_between_s is not None:
        first, last = np.searchsorted(imu.time_s, np.asarray(align_between_s) + 1e-6 * np.array([1.0, 1.0]))
        at = replace(begin, time_s=float(imu.time_s[first - 1]) if first else begin.time_s)
        alignment = align(imu.time_s[first:last], imu.gyro[first:last], velocity[first:last], at, noise)
        begin = alignment.start
    elif begin.attitude_rad is None:
        raise DataRefused(
            f"{recording.name}: the attitude of the start is unknown and there is no standstill to find it on; "
            "give one of them"
        )
    rest = slice(
        int(np.searchsorted(imu.time_s, begin.time_s + 1e-6)), int(np.searchsorted(imu.time_s, until_s + 1e-6))
    )
    aid = None if imu.height_baro_m is None else imu.height_baro_m[rest]
    solution = navigate(imu.time_s[rest], imu.gyro[rest], velocity[rest], begin, aid, vertical, every)
    return Evaluation(solution, alignment, compare(solution, _reference(recording, solution)))


def _reference(recording: Recording, solution: Solution) -> Fixes:
    fixes = recording.reference or recording.gps
    if fixes is not None:
        return fixes
    if recording.kind in ("static", "oven"):
        return standstill(solution, recording.start)
    raise DataRefused(f"{recording.name}: moves, and has neither GPS nor a reference; there is nothing to compare with")
