"""A recording to its navigation errors: compensation, alignment, mechanization, comparison. Simulated or real."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from ins_eval import metrics
from ins_eval.alignment import Alignment, AlignmentNoise, align
from ins_eval.compensation import CompensationModel, Samples
from ins_eval.earth import radii
from ins_eval.effects import turned_start, without_effects
from ins_eval.errors import DataRefused
from ins_eval.recording import Fixes, Recording, Start
from ins_eval.recording.stillness import Stretch, choose_alignment, still_stretches
from ins_eval.reference import Errors, compare, standstill
from ins_eval.strapdown import Solution, Vertical, navigate
from ins_eval.thermal import filtered_rate

STANDING_SPEED_MPS = 0.5  # a receiver that reports more on average does not stand
PARKED = ("static", "oven")


@dataclass(frozen=True)
class Evaluation:
    """One recording navigated once: the solution, how it was aligned (None: attitude given), its errors."""

    solution: Solution
    alignment: Alignment | None
    errors: Errors


def samples(recording: Recording) -> tuple[Samples, ...]:
    """What a compensation model may see of the three accelerometers of a recording whose output is in pulses.

    Without a thermometer the temperature is the believed reference temperature and its rate zero.
    """
    imu, believed = recording.imu, recording.belief.accelerometer
    if imu.temperature_c is None:
        readings = [np.full(imu.time_s.size, believed.reference_temperature_c)]
    else:
        columns = imu.temperature_c if imu.temperature_c.ndim == 2 else imu.temperature_c[:, None]
        readings = [np.ascontiguousarray(column) for column in columns.T]
    rates = [filtered_rate(imu.time_s, reading, believed.rate_filter_s) for reading in readings]
    return tuple(
        Samples(
            imu.time_s,
            imu.accelerometer[:, axis] / recording.interval_s,
            readings[axis % len(readings)],
            rates[axis % len(rates)],
        )
        for axis in range(3)
    )


def compensate(seen: Sequence[Samples], triad: Sequence[CompensationModel], interval_s: np.ndarray) -> np.ndarray:
    """Velocity increments (n, 3) in m/s that three fitted models make of the samples they see, each of `interval_s`."""
    return np.stack(
        [model.specific_force(of_axis) * interval_s for of_axis, model in zip(seen, triad, strict=True)], axis=1
    )


def standstill_to_align_on(recording: Recording) -> Stretch | None:
    """The stretch at rest on which to align, or None where the attitude of the start is to be taken.

    1. Where the recording says until when it stood (``start.still_until_s``), from its start until then.
    2. None where the start's attitude comes with a sigma, or where it is given and the vehicle moves.
    3. Else by rule: the quiet stretches (`recording.quiet`), less those in which GPS or reference moves.

    Raises: DataRefused where an alignment is needed and no stretch is quiet.
    """
    start = recording.start
    if start.still_until_s is not None:
        return Stretch(start.time_s, start.still_until_s)
    if start.attitude_rad is not None and (start.attitude_sigma_rad is not None or recording.kind not in PARKED):
        return None
    stretches = [s for s in still_stretches(recording.imu) if _stands(recording, s)]
    return choose_alignment(stretches)


def _stands(recording: Recording, stretch: Stretch) -> bool:
    """Whether GPS or reference, where there is one, reports next to no speed throughout a stretch."""
    if recording.kind in PARKED:
        return True
    fixes = recording.reference or recording.gps
    if fixes is None:
        return True
    inside = (fixes.time_s > stretch.start_s) & (fixes.time_s <= stretch.end_s) & fixes.valid
    return bool(inside.any() and np.hypot(*fixes.velocity_n[inside, :2].T).mean() < STANDING_SPEED_MPS)


def evaluate(
    recording: Recording,
    dv_b: np.ndarray,
    align_on: Stretch | None = None,
    until_s: float = np.inf,
    every: int = 1,
    vertical: Vertical | None = None,
    start: Start | None = None,
    folder: str | Path = ".",
) -> Evaluation:
    """Navigate a recording by pure inertial mechanization and compare it with what is known.

    Parameters
    ----------
    dv_b : (n, 3) compensated velocity increments, m/s
    align_on : stretch at rest on which to align; navigation begins at its end. None: the attitude of the start is taken
    until_s : end of navigation
    every : one row of the solution for so many steps of four samples
    vertical : None: damped by the height that the recording believes in, free where there is none
    start : where to begin instead of the recording's own start, taken as it is
    folder : of the recording, where a believed compensation file is relative to it

    Notes
    -----
    Believed effects are taken off and gyros corrected for the believed bias. Compared with `recording.reference` where
    there is one, else with its
    GPS, else with the known standstill of a parked recording; for GPS and reference the solution is carried to the
    antenna and the believed time offset is applied.
    """
    recording, dv_b = without_effects(recording, dv_b, folder)
    imu, believed = recording.imu, recording.belief
    dtheta_b = (
        imu.gyro - np.asarray(believed.gyro.bias_radps) * recording.interval_s[:, None]
        if any(believed.gyro.bias_radps or ())
        else imu.gyro
    )
    begin = start or recording.start
    alignment = None
    if align_on is not None:
        rows = slice(*np.searchsorted(imu.time_s, [align_on.start_s + 1e-6, align_on.end_s + 1e-6]))
        at = replace(begin, time_s=float(imu.time_s[rows.start - 1]) if rows.start else begin.time_s)
        alignment = align(imu.time_s[rows], dtheta_b[rows], dv_b[rows], at, _alignment_noise(recording))
        begin = alignment.start
    elif begin.attitude_rad is None:
        raise DataRefused(
            f"{recording.name}: the attitude of the start is unknown and there is no standstill to find it on; "
            "give one of them"
        )
    if start is None:
        begin = turned_start(begin, believed)
    rest = slice(*np.searchsorted(imu.time_s, [begin.time_s + 1e-6, until_s + 1e-6]))
    aid = height_aid(recording)
    solution = navigate(
        imu.time_s[rest],
        dtheta_b[rest],
        dv_b[rest],
        begin,
        None if aid is None else aid[rest],
        vertical or ("damped" if aid is not None or recording.kind in PARKED else "free"),
        every,
        believed.earth,
    )
    return Evaluation(solution, alignment, _compared(recording, solution))


def numeric_floor(ideal: Recording, vertical: Vertical | None = None) -> tuple[Errors, float, float]:
    """What navigation alone makes of a recording without any sensor error, given its true attitude.

    Returns errors, the largest horizontal position error in m and the largest horizontal velocity error in m/s.
    """
    errors = evaluate(ideal, ideal.imu.accelerometer, vertical=vertical).errors
    return errors, float(np.hypot(errors.north_m, errors.east_m).max()), float(np.abs(errors.velocity_n[:, :2]).max())


def height_aid(recording: Recording) -> np.ndarray | None:
    """Height (n,) at every sample that steadies the vertical channel, as believed; None where there is none."""
    source = recording.belief.height.source
    if source == "baro" and recording.imu.height_baro_m is not None:
        return recording.imu.height_baro_m
    fixes = recording.gps
    if source == "none" or fixes is None or not (known := fixes.valid & np.isfinite(fixes.height_m)).any():
        return None
    stamps = fixes.time_s[known] - recording.belief.gps.time_offset_s
    return np.interp(recording.imu.time_s, stamps, fixes.height_m[known])


def _alignment_noise(recording: Recording) -> AlignmentNoise:
    gyro, accelerometer = recording.belief.gyro, recording.belief.accelerometer
    stated = {
        "gyro_bias_deg_per_h": gyro.bias_sigma_deg_per_h,
        "angle_random_walk_deg_per_sqrt_h": gyro.angle_random_walk_deg_per_sqrt_h,
        "velocity_random_walk_ug_per_sqrt_hz": accelerometer.velocity_random_walk_ug_per_sqrt_hz,
    }
    return AlignmentNoise(**{name: value for name, value in stated.items() if value is not None})


def _compared(recording: Recording, solution: Solution) -> Errors:
    believed = recording.belief
    if recording.reference is not None and np.isfinite(recording.reference.latitude_rad).any():
        fixes, section = recording.reference, believed.reference
    elif recording.gps is not None:
        fixes, section = recording.gps, believed.gps
    elif recording.kind in PARKED:
        return compare(solution, standstill(solution, recording.start))
    else:
        raise DataRefused(
            f"{recording.name}: it moves, and has neither GPS nor a reference with positions; there is nothing to "
            "compare with"
        )
    return compare(at_antenna(solution, section.lever_arm_m), fixes, section.time_offset_s)


def at_antenna(solution: Solution, lever_arm_m: Sequence[float]) -> Solution:
    """The solution carried to an antenna at `lever_arm_m` (3,) m from the IMU, body axes.

    r_antenna = r + C l,   v_antenna = v + d(C l)/dt

    The derivative is that of the arm in the navigation frame, from neighbouring rows; the turning of that frame
    itself (3e-5 m/s for an arm of 1 m) is left out.
    """
    if not any(lever_arm_m):
        return solution
    arm_n = Rotation.from_quat(solution.quaternion_nb, scalar_first=True).apply(np.asarray(lever_arm_m, dtype=float))
    meridian, transverse = radii(solution.latitude_rad)
    return replace(
        solution,
        latitude_rad=solution.latitude_rad + arm_n[:, 0] / (meridian + solution.height_m),
        longitude_rad=solution.longitude_rad
        + arm_n[:, 1] / ((transverse + solution.height_m) * np.cos(solution.latitude_rad)),
        height_m=solution.height_m - arm_n[:, 2],
        velocity_n=solution.velocity_n + np.gradient(arm_n, solution.time_s, axis=0),
    )


def since_start(evaluation: Evaluation) -> tuple[Errors, np.ndarray]:
    """Errors, and their epochs (m,) in s since the start of navigation."""
    return evaluation.errors, evaluation.errors.time_s - evaluation.solution.time_s[0]


def measures(evaluation: Evaluation) -> dict[str, dict[str, float]]:
    """Velocity RMS and radial error rates of one navigated recording, by the names that the metrics have."""
    errors, time_s = since_start(evaluation)
    later = errors.valid & (time_s > 0.0)
    rates = metrics.radial_error_rates(np.column_stack([errors.north_m, errors.east_m])[later], time_s[later])
    rms = metrics.velocity_rms(errors.velocity_n, errors.valid)
    return {
        "velocity_rms_mps": {axis: float(value) for axis, value in rms._asdict().items()},
        "radial_error_rate_nmi_per_h": {
            "final": float(rates.final),
            "least_squares": float(rates.least_squares),
            "radial_error_rate_rms": float(rates.rms),
        },
    }


@dataclass(frozen=True)
class Restarts:
    """How errors grow with the time since navigation was started afresh: RMS over `count` starts, (m,) each."""

    after_s: np.ndarray
    position_rms_m: np.ndarray
    velocity_rms_mps: np.ndarray
    count: int


def restarts(recording: Recording, dv_b: np.ndarray, every_s: float) -> Restarts:
    """Navigate in pieces of `every_s`, each started from the fix and the attitude that the reference has then.

    For instruments that cannot find north and drift away within minutes. The errors of a piece are taken relative to
    those at its start, so that the noise of the fix it started from is in them twice.
    Raises: DataRefused where there is no attitude to start from or no piece lies between valid fixes.
    """
    reference, fixes = recording.reference, recording.gps or recording.reference
    if reference is None or reference.attitude_rad is None:
        raise DataRefused(
            f"{recording.name}: a start afresh needs an attitude, and there is no reference with roll_deg, pitch_deg "
            "and heading_deg; add that table or leave out --restart-every"
        )
    section = recording.belief.gps if recording.gps is not None else recording.belief.reference
    known = np.isfinite(reference.attitude_rad).all(axis=1)
    turning = Slerp(reference.time_s[known], Rotation.from_euler("ZYX", reference.attitude_rad[known][:, ::-1]))
    instants = fixes.time_s - section.time_offset_s
    span = (
        max(reference.time_s[known][0], recording.imu.time_s[0]),
        min(reference.time_s[known][-1], recording.imu.time_s[-1]),
    )
    after_s = np.arange(1.0, every_s + 0.5)
    position, speed = [], []
    next_s = -np.inf
    for k in np.flatnonzero(fixes.valid):
        if instants[k] < max(next_s, span[0]) or instants[k] + every_s > span[1]:
            continue
        next_s = instants[k] + every_s
        errors = _piece(recording, dv_b, fixes, k, float(instants[k]), turning, every_s)
        if errors is not None:
            at = np.interp(instants[k] + after_s, errors.time_s[errors.valid], np.arange(errors.valid.sum()))
            rows = np.flatnonzero(errors.valid)[np.round(at).astype(int)]
            first = np.flatnonzero(errors.valid)[0]
            position.append(
                np.hypot(errors.north_m[rows] - errors.north_m[first], errors.east_m[rows] - errors.east_m[first])
            )
            speed.append(np.hypot(*(errors.velocity_n[rows, :2] - errors.velocity_n[first, :2]).T))
    if not position:
        raise DataRefused(
            f"{recording.name}: no stretch of {every_s:g} s lies between valid fixes and attitudes; "
            "give a shorter --restart-every"
        )
    return Restarts(
        after_s,
        metrics.root_mean_square(np.array(position).T),
        metrics.root_mean_square(np.array(speed).T),
        len(position),
    )


def _piece(recording, dv_b, fixes: Fixes, k: int, at_s: float, turning: Slerp, every_s: float) -> Errors | None:
    """Errors over `every_s` from fix `k` on, or None where fewer than two fixes are valid in it."""
    first = int(np.searchsorted(recording.imu.time_s, at_s + 1e-6))
    begin_s = float(recording.imu.time_s[first - 1]) if first else recording.start.time_s
    roll_pitch_heading = turning(np.clip(begin_s, turning.times[0], turning.times[-1])).as_euler("ZYX")[::-1]
    start = Start(
        begin_s,
        float(fixes.latitude_rad[k]),
        float(fixes.longitude_rad[k]),
        float(fixes.height_m[k]),
        tuple(float(v) for v in fixes.velocity_n[k]),
        tuple(float(a) for a in roll_pitch_heading),
    )
    try:
        return evaluate(recording, dv_b, until_s=at_s + every_s, start=start).errors
    except DataRefused:
        return None
