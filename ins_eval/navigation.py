"""A recording to its navigation errors: compensation, alignment, mechanization, comparison. Simulated or real."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.spatial.transform import Rotation

from ins_eval import metrics
from ins_eval.alignment import Alignment, AlignmentNoise, align
from ins_eval.compensation import CompensationModel, Samples
from ins_eval.earth import EARTH_RATE, radii
from ins_eval.effects import effects_left, turned_start
from ins_eval.errors import DataRefused
from ins_eval.initialization import Initialization, find
from ins_eval.recording import PARKED, Recording, Start
from ins_eval.recording.belief import Belief
from ins_eval.recording.stillness import Stretch, choose_alignment, still_stretches
from ins_eval.reference import AttitudeErrors, Errors, compare, compare_attitude, standstill
from ins_eval.strapdown import SAMPLES_PER_STEP, Solution, Vertical, navigate
from ins_eval.thermal import filtered_rate
from ins_eval.units import DEG, DEG_PER_H

STANDING_SPEED_MPS = 0.5  # a receiver that reports more on average does not stand
UNKNOWN_RAD = 30.0 * DEG  # a stated attitude sigma from which on the attitude is as good as unknown
NORTH_RAD = 10.0 * DEG  # gyros that do not find the heading at rest to that do not find north
EARTH_RATE_TOLERANCE = 0.1  # of Earth rate: gyros of which no bias sigma is known must show it so well


@dataclass(frozen=True)
class Evaluation:
    """One recording navigated once: the solution, how it was aligned (None: attitude given or found), its errors.

    `initialization` is how its start was found where neither an attitude nor gyros that find north gave one.
    """

    solution: Solution
    alignment: Alignment | None
    errors: Errors
    initialization: Initialization | None = None
    attitude: AttitudeErrors | None = None  # where the reference has one


def samples(recording: Recording, kind: type[Samples] = Samples) -> Iterator[Samples]:
    """What a compensation model may see of each accelerometer, x, y, z, of a recording whose output is in pulses.

    Without a thermometer the temperature is the believed reference temperature and its rate zero.
    """
    imu, believed = recording.imu, recording.belief.accelerometer
    if imu.temperature_c is None:
        readings = [np.full(imu.time_s.size, believed.reference_temperature_c)]
    else:
        readings = list(imu.temperature_c.T) if imu.temperature_c.ndim == 2 else [imu.temperature_c]
    interval_s = recording.interval_s
    for axis in range(3):
        if axis < len(readings):
            reading = np.ascontiguousarray(readings[axis])
            rate = filtered_rate(imu.time_s, reading, believed.rate_filter_s)
        yield kind(imu.time_s, imu.accelerometer[:, axis] / interval_s, reading, rate)


def compensate(seen: Iterable[Samples], triad: Sequence[CompensationModel], interval_s: np.ndarray) -> np.ndarray:
    """Velocity increments (n, 3) in m/s that three fitted models make of the samples they see, each of `interval_s`."""
    velocity = np.empty((interval_s.size, 3))
    for axis, (of_axis, model) in enumerate(zip(seen, triad, strict=True)):
        np.multiply(model.specific_force(of_axis), interval_s, out=velocity[:, axis])
    return velocity


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


def beginning(recording: Recording, dv_b: np.ndarray) -> Stretch | Initialization | None:
    """Where and how navigation begins, as `evaluate` takes it; `dv_b` (n, 3) m/s as there.

    1. None: the attitude of the start is stated, and not to be aligned (see `standstill_to_align_on`).
    2. A stretch at rest, where the gyros find north on it.
    3. Else what `initialization.find` makes of the standstill and of the first motion.

    Raises: DataRefused where none of them is there.
    """
    sigma = recording.start.attitude_sigma_rad
    if sigma is not None and max(sigma) >= UNKNOWN_RAD:
        recording = replace(recording, start=replace(recording.start, attitude_rad=None, attitude_sigma_rad=None))
    try:
        stretch = standstill_to_align_on(recording)
    except DataRefused:
        stretch = None
    else:
        if stretch is None or _finds_north(recording, stretch):
            return stretch
    return find(recording, *without_bias(recording, dv_b))


def _finds_north(recording: Recording, stretch: Stretch) -> bool:
    """Whether the gyros are good enough for a heading: by the bias that is believed, else by what they show at rest."""
    latitude = recording.start.latitude_rad
    stated = recording.belief.gyro.model_dump(exclude_unset=True).get("bias_sigma_deg_per_h")
    if stated is not None:
        return DEG_PER_H * stated < NORTH_RAD * EARTH_RATE * np.cos(latitude)
    time_s = recording.imu.time_s
    inside = (time_s > stretch.start_s) & (time_s <= stretch.end_s)
    dtheta_b, _ = without_bias(recording, recording.imu.accelerometer)
    rate_b = dtheta_b[inside].sum(axis=0) / stretch.duration_s
    up_b = recording.imu.accelerometer[inside].sum(axis=0)
    vertical = float(rate_b @ up_b / np.linalg.norm(up_b)) - EARTH_RATE * np.sin(latitude)
    off = max(abs(float(np.linalg.norm(rate_b)) - EARTH_RATE), abs(vertical))
    return off < EARTH_RATE_TOLERANCE * EARTH_RATE


def without_bias(recording: Recording, dv_b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angle increments (n, 3) rad and velocity increments (n, 3) m/s without the believed biases.

    dtheta - b_g dt,   dv - b_a dt

    Of accelerometers in pulses the bias is in the compensation that made `dv_b`, and nothing more is taken off.
    """
    belief = recording.belief
    of_force = belief.accelerometer.bias_mps2 if recording.imu.accelerometer_form == "increment" else None
    return (
        _less(recording, recording.imu.gyro, belief.gyro.bias_radps),
        _less(recording, dv_b, of_force),
    )


def _less(recording: Recording, increments: np.ndarray, bias: Sequence[float] | None) -> np.ndarray:
    if bias is None or not any(bias):
        return increments
    return increments - np.asarray(bias) * recording.interval_s[:, None]


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
    align_on: Stretch | Initialization | None = None,
    until_s: float = np.inf,
    every: int = 1,
    vertical: Vertical | None = None,
    start: Start | None = None,
) -> Evaluation:
    """Navigate a recording by pure inertial mechanization and compare it with what is known.

    Parameters
    ----------
    dv_b : (n, 3) velocity increments, m/s: of accelerometers in pulses what `compensate` makes of them, else those of
        the recording; the believed biases of gyros and accelerometers are taken off here (`without_bias`)
    align_on : stretch at rest on which to align; navigation begins at its end. An initialization: navigation begins
        with its state, and the biases that it found are taken off. None: the attitude of the start is taken
    until_s : end of navigation
    every : one row of the solution for so many steps of four samples
    vertical : None: damped by the height that the recording believes in, free where there is none
    start : where to begin instead of the recording's own start, taken as it is

    Notes
    -----
    The recording is one of which the believed effects were taken off (`effects.without_effects`).
    Compared with `recording.reference` where there is one, else with its GPS, else
    with the known standstill of a parked recording; for GPS and reference the solution is carried to the antenna and
    the believed time offset is applied.

    Raises: DataRefused where there is nothing to begin with or to compare with, and where the solution is no number.
    """
    if left := effects_left(recording.belief):
        raise ValueError(f"{recording.name}: take the believed {left[0].name} off first, see effects.without_effects")
    imu, believed = recording.imu, recording.belief
    dtheta_b, dv_b = without_bias(recording, dv_b)
    begin = start or recording.start
    alignment = found = None
    if isinstance(align_on, Initialization):
        begin, found = start or align_on.start, align_on
        dtheta_b, dv_b = found.without_errors(dtheta_b, dv_b, recording.interval_s)
    elif align_on is not None:
        rows = slice(*np.searchsorted(imu.time_s, [align_on.start_s + 1e-6, align_on.end_s + 1e-6]))
        at = replace(begin, time_s=float(imu.time_s[rows.start - 1]) if rows.start else begin.time_s)
        alignment = align(imu.time_s[rows], dtheta_b[rows], dv_b[rows], at, alignment_noise(recording.belief))
        begin = alignment.start
    elif begin.attitude_rad is None:
        raise DataRefused(
            f"{recording.name}: the attitude of the start is unknown and there is no standstill to find it on; "
            "give one of them"
        )
    if start is None and found is None:
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
    _check_finite(solution, recording)
    attitude = None
    if recording.reference is not None:
        attitude = compare_attitude(solution, recording.reference, believed.reference.time_offset_s)
    return Evaluation(solution, alignment, _compared(recording, solution, attitude), found, attitude)


def _check_finite(solution: Solution, recording: Recording) -> None:
    """Raises DataRefused where the solution is no number any more: its steps are too long, or its units are wrong."""
    numbers = np.column_stack([solution.velocity_n, solution.latitude_rad, solution.quaternion_nb])
    lost = ~np.isfinite(numbers).all(axis=1)
    if not lost.any():
        return
    every_s = float(np.median(np.diff(recording.imu.time_s)))
    raise DataRefused(
        f"{recording.name}: the solution grows beyond all numbers by {solution.time_s[np.argmax(lost)]:.6g} s, of "
        f"samples that are {every_s:.6g} s apart, four of which make a step; check the units of times, gyros "
        "and accelerometers (milliseconds given for seconds?), or cut the recording before"
    )


def numeric_floor(ideal: Recording, vertical: Vertical | None = None) -> tuple[Errors, float, float]:
    """What navigation alone makes of a recording without any sensor error, given its true attitude.

    Returns errors, the largest horizontal position error in m and the largest horizontal velocity error in m/s.
    """
    errors = evaluate(ideal, ideal.imu.accelerometer, vertical=vertical).errors
    return errors, float(np.hypot(errors.north_m, errors.east_m).max()), float(np.abs(errors.velocity_n[:, :2]).max())


def polar_error_m(solution: Solution, rate_hz: float) -> float:
    """Horizontal error, m, that the frame's turning leaves near a pole, where north turns within a step.

        integral of |v| (v_E tan L / R * step)^3 / 24 dt

    The twenty-fourth part of the cube is what circles about a pole at 89.9 and 89.99 degrees show, of which all is
    known.
    """
    step_s = SAMPLES_PER_STEP / rate_hz
    v_n, v_e, _ = solution.velocity_n[1:].T
    _, transverse = radii(solution.latitude_rad[1:])
    turned = v_e * np.tan(solution.latitude_rad[1:]) / (transverse + solution.height_m[1:]) * step_s
    return float(np.sum(np.hypot(v_n, v_e) * np.abs(turned) ** 3 * np.diff(solution.time_s)) / 24.0)


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


def alignment_noise(belief: Belief) -> AlignmentNoise:
    """What the fine alignment allows for of an instrument of which that is believed."""
    gyro, accelerometer = belief.gyro, belief.accelerometer
    stated = {
        "gyro_bias_deg_per_h": gyro.bias_sigma_deg_per_h,
        "angle_random_walk_deg_per_sqrt_h": gyro.angle_random_walk_deg_per_sqrt_h,
        "velocity_random_walk_ug_per_sqrt_hz": accelerometer.velocity_random_walk_ug_per_sqrt_hz,
    }
    return AlignmentNoise(**{name: value for name, value in stated.items() if value is not None})


def _compared(recording: Recording, solution: Solution, attitude: AttitudeErrors | None) -> Errors:
    believed = recording.belief
    if recording.reference is not None and np.isfinite(recording.reference.latitude_rad).any():
        fixes, section = recording.reference, believed.reference
    elif recording.gps is not None:
        fixes, section = recording.gps, believed.gps
    elif recording.kind in PARKED:
        return compare(solution, standstill(solution, recording.start))
    elif attitude is not None:
        return _of_attitude_alone(attitude.time_s)
    else:
        raise DataRefused(
            f"{recording.name}: it moves, and has neither GPS nor a reference; there is nothing to compare with, "
            "expected fixes; name them under [gps] or [reference] of the mapping and import it again"
        )
    return compare(at_antenna(solution, section.lever_arm_m), fixes, section.time_offset_s)


def _of_attitude_alone(time_s: np.ndarray) -> Errors:
    """Epochs (m,) at which nothing is known of position and velocity."""
    silent = np.full(time_s.size, np.nan)
    return Errors(time_s, silent, silent, silent, np.full((time_s.size, 3), np.nan), np.isfinite(silent), ())


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


@dataclass(frozen=True)
class Measures:
    """Velocity RMS by axis, radial error rates by definition and attitude RMS by axis of one navigated recording.

    A group that the comparison lacks is empty. `final_radial_error_m` is that at the last epoch with a position.
    """

    velocity_rms_mps: Mapping[str, float] = field(default_factory=dict)
    radial_error_rate_nmi_per_h: Mapping[str, float] = field(default_factory=dict)
    attitude_rms_deg: Mapping[str, float] = field(default_factory=dict)
    final_radial_error_m: float | None = None


def measures(evaluation: Evaluation) -> Measures:
    """Measure the errors of one navigated recording, see `metrics`; the final radial error is left open."""
    errors, time_s = since_start(evaluation)
    later = errors.valid & (time_s > 0.0) & np.isfinite(errors.north_m + errors.east_m)
    moving = errors.valid & np.isfinite(errors.velocity_n[:, :2]).all(axis=1)
    velocity, rates, attitude = {}, {}, {}
    if moving.any():
        rms = metrics.velocity_rms(errors.velocity_n, moving)
        velocity = {a: float(value) for a, value in rms._asdict().items() if np.isfinite(value)}
    if later.any():
        rates = radial_error_rates(np.column_stack([errors.north_m, errors.east_m])[later], time_s[later])
    if evaluation.attitude is not None:
        rms_deg = metrics.root_mean_square(evaluation.attitude.phi_n.T) / DEG
        attitude = dict(zip(("north", "east", "down"), rms_deg.tolist(), strict=True))
    return Measures(velocity, rates, attitude)


def radial_error_rates(position_m: np.ndarray, time_s: np.ndarray) -> dict[str, float]:
    """Radial error rates in nmi/h of errors (m, 2) in m at times (m,) since the start, by definition."""
    rates = metrics.radial_error_rates(position_m, time_s)
    return {
        "final": float(rates.final),
        "least_squares": float(rates.least_squares),
        "radial_error_rate_rms": float(rates.rms),
    }
