"""What must hold of any recording before it is navigated: one sentence for the first thing that does not.

`validate` refuses what cannot be right and writes down what is only suspicious (a stuck or saturated channel).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ins_eval.earth import EARTH_RATE, gravity
from ins_eval.errors import DataRefused
from ins_eval.limits import BY_UNIT, OTHER, within
from ins_eval.recording import PARKED, Fixes, Imu, Recording, consistency
from ins_eval.recording.consistency.rest import (
    EARTH_RATE_FACTOR,
    at_rest,
    mix_up,
    rests,
    turns_as_the_earth,
)
from ins_eval.recording.stamps import LONGEST_STEP, gaps
from ins_eval.recording.stuck import held, saturated, spikes
from ins_eval.units import DEG, DEG_PER_H

GRAVITY_TOLERANCE = 0.03  # of gravity: what the accelerometers of a navigator may be off by; by reasoning
BIAS_SIGMAS = 5.0  # of the believed gyro bias
LARGEST_BIAS_RADPS = 20.0 * DEG  # of any gyro in use: the tolerance of the coarsest data sheet (MPU-6050)
LARGEST_BIAS_G = 0.25  # of any accelerometer in use: likewise (z of ADXL350)
LARGEST_TILT_DEG = 45.0  # between gravity as measured and as the start has it
MOVING_MPS, MOVING_SHARE = 3.0, 0.1  # of who drives, and of the fixes; receivers at rest err by less; by reasoning
LARGEST_RATE_RADPS = BY_UNIT["radps"][1]
LARGEST_SPECIFIC_FORCE_MPS2 = BY_UNIT["mps2"][1]
LARGEST_PULSE_COUNT = 1e9
CHANNELS = ("gyro x", "gyro y", "gyro z", "accelerometer x", "accelerometer y", "accelerometer z")


def validate(
    recording: Recording, found: Sequence[consistency.Finding] | None = None, judged: bool = False
) -> Recording:
    """Return the recording with suspicions added to its notes.

    Checked are shapes, finite values, time (strictly increasing, no sample missing) and
    plausible magnitudes; of a recording at rest also that the specific force is gravity, on the axis and with
    the sign that the start's attitude gives it (level if there is none), and that the gyros show about Earth rate.
    Then the list of `consistency`, the same for the form and for every importer; `found` where it is known already.
    Where what is believed is `judged`, biases at rest may be as large as those of any sensor in use.
    Raises `DataRefused`.
    """
    where = f"recording '{recording.name}'"
    for table, fixes in (("gps", recording.gps), ("reference", recording.reference), ("solution", recording.solution)):
        if fixes is not None:
            _check_fixes(fixes, f"{where}, {table}")
    if recording.imu is None:
        return recording
    _check_start(recording, where)
    _check_shapes(recording.imu, where)
    _check_finite(recording.imu, where)
    step_s = _check_time(recording, where)
    _check_range(recording.imu, step_s, where)
    if recording.kind in PARKED:
        _check_rest(recording, where, judged)
    suspicions = [
        *consistency.report(recording, consistency.findings(recording) if found is None else found, where),
        *_suspicions(recording, step_s),
    ]
    return replace(recording, notes=(*recording.notes, *(note for note in suspicions if note not in recording.notes)))


def _check_start(recording: Recording, where: str) -> None:
    start = recording.start
    values = [start.time_s, start.latitude_rad, start.longitude_rad, start.height_m, *start.velocity_n]
    if not np.isfinite([*values, *(start.attitude_rad or ())]).all():
        raise DataRefused(f"{where}: the start holds a value that is not finite; give every number of the start")
    if abs(start.latitude_rad) > np.pi / 2:
        raise DataRefused(
            f"{where}: the start's latitude is {start.latitude_rad / DEG:g} degrees, expected -90 to 90; correct it"
        )


def _check_shapes(imu: Imu, where: str) -> None:
    n = len(imu.time_s)
    if n < 2:
        raise DataRefused(f"{where}: {n} IMU samples, expected at least two; check that the file is complete")
    expected = {"time_s": [(n,)], "gyro": [(n, 3)], "accelerometer": [(n, 3)]}
    expected |= {"temperature_c": [(n,), (n, 3)], "height_baro_m": [(n,)]}
    for column, shapes in expected.items():
        values = getattr(imu, column)
        if values is not None and values.shape not in shapes:
            raise DataRefused(
                f"{where}: IMU column {column} has shape {values.shape}, expected {shapes[0]} beside {n} times; "
                "check the table's columns"
            )


def _check_finite(imu: Imu, where: str) -> None:
    for column in ("time_s", "gyro", "accelerometer", "temperature_c", "height_baro_m"):
        values = getattr(imu, column)
        sound = np.isfinite if column in ("gyro", "accelerometer") else within  # of which `_check_range` says more
        if values is None or sound(values).all():
            continue
        bad = ~sound(values.reshape(len(values), -1)).all(axis=1)
        raise DataRefused(
            f"{where}: {column} is not finite, or beyond {OTHER[1]:g}, in {bad.sum()} IMU samples, first in sample "
            f"{np.argmax(bad) + 1} of {len(bad)}; `ins-eval import ins-recording FOLDER -o NEW` fills or cuts there"
        )


def _check_time(recording: Recording, where: str) -> float:
    """Return the median step in s."""
    time_s = recording.imu.time_s
    steps = np.diff(time_s)
    step_s = float(np.median(steps))
    back = np.flatnonzero(steps <= 0.0)
    if back.size:
        k = back[0]
        raise DataRefused(
            f"{where}: time goes from {time_s[k]:.6g} to {time_s[k + 1]:.6g} s at IMU sample {k + 2}, "
            "expected strictly increasing times; sort the rows and drop repeated ones"
        )
    first_s = float(time_s[0] - recording.start.time_s)
    if not 0.0 < first_s <= LONGEST_STEP * step_s:
        raise DataRefused(
            f"{where}: the first IMU sample ends {first_s:.6g} s after the start, expected about one step of "
            f"{step_s:.6g} s; set the start's time one step before the first sample"
        )
    found = gaps(time_s, least=1.0)
    if found.size:
        k = found[0]
        more = f" and {found.size - 1} more" if found.size > 1 else ""
        raise DataRefused(
            f"{where}: a gap of {steps[k]:.6g} s after {time_s[k]:.6g} s (IMU sample {k + 1}){more}, expected steps of "
            f"{step_s:.6g} s; `ins-eval import ins-recording FOLDER -o NEW` fills gaps of up to half a second "
            "and cuts the recording at longer ones"
        )
    return step_s


def _check_range(imu: Imu, step_s: float, where: str) -> None:
    """Refuse what no navigation instrument measures."""
    pulses = imu.accelerometer_form == "pulse"
    for name, values, limit, unit in (
        ("gyro", imu.gyro, LARGEST_RATE_RADPS * step_s, "rad"),
        ("accelerometer", imu.accelerometer, LARGEST_SPECIFIC_FORCE_MPS2 * step_s, "m/s"),
    ):
        limit, unit = (LARGEST_PULSE_COUNT, "pulses") if pulses and name == "accelerometer" else (limit, unit)
        size = np.abs(values).max(axis=1)
        if size.max() > limit:
            k = np.argmax(size)
            raise DataRefused(
                f"{where}: {name} reads {size[k]:.3g} {unit} in sample {k + 1} at {imu.time_s[k]:.6g} s, expected at "
                f"most {limit:.3g}; check its unit and whether increments or rates are given"
            )


def _check_fixes(fixes: Fixes, where: str) -> None:
    m = len(fixes.time_s)
    expected = {"latitude_rad": (m,), "longitude_rad": (m,), "height_m": (m,), "velocity_n": (m, 3), "valid": (m,)}
    for column, shape in (expected | {"attitude_rad": (m, 3)}).items():
        values = getattr(fixes, column)
        if values is not None and values.shape != shape:
            raise DataRefused(
                f"{where}: {column} has shape {values.shape}, expected {shape} beside {m} times; check its columns"
            )
        if values is not None and (bad := np.flatnonzero(np.isfinite(values) & ~within(values))).size:
            row = int(bad[0]) // int(np.prod(shape[1:]))
            raise DataRefused(
                f"{where}, fix {row + 1}, column {column}: {values.flat[bad[0]]:g}, expected {OTHER[0]:g} to "
                f"{OTHER[1]:g}; correct that value or leave the row out"
            )
    if not np.isfinite(fixes.time_s).all() or (np.diff(fixes.time_s) <= 0.0).any():
        raise DataRefused(
            f"{where}: times are not finite and strictly increasing; sort the rows and drop repeated ones"
        )
    valid = fixes.valid.astype(bool)
    position = np.column_stack([fixes.latitude_rad, fixes.longitude_rad, fixes.height_m])[valid]
    delivered = np.isfinite(position).any(axis=0)  # any of them may be missing throughout
    there = np.isfinite(position[:, delivered])
    # groups may have rows of their own
    apart = ~there.any(axis=1) & np.isfinite(fixes.velocity_n[valid, :2]).all(axis=1)
    if not (there.all(axis=1) | apart).all():
        raise DataRefused(f"{where}: a fix marked valid has no position; mark it valid = 0 or leave the row out")
    if (np.abs(position[:, 0]) > np.pi / 2).any():  # NaN compares false
        raise DataRefused(
            f"{where}: a latitude of {np.abs(position[:, 0]).max() / DEG:.6g} degrees, expected -90 to 90; "
            "check the unit and the order of the columns"
        )


def _check_rest(recording: Recording, where: str, judged: bool) -> None:
    """At rest the accelerometers show gravity upwards, the gyros about Earth rate, and no table that it drives."""
    start = recording.start
    for table in ("gps", "reference"):
        if (fixes := getattr(recording, table)) is not None:
            _check_stands(recording, fixes, f"{where}, {table}")
    imu, duration_s = at_rest(recording)
    force_b = imu.accelerometer.sum(axis=0) / duration_s
    size = float(np.linalg.norm(force_b))
    if imu.accelerometer_form == "increment":
        expected = float(gravity(start.latitude_rad, start.height_m))
        if abs(size / expected - 1.0) > (LARGEST_BIAS_G if judged else GRAVITY_TOLERANCE):
            raise DataRefused(
                f"{where}: the mean specific force at rest is {size:.4g} m/s^2, {size / expected:.3g} times gravity, "
                f"expected {expected:.5g}{_guess(size / expected, duration_s / len(imu.time_s), 'accelerometer')}; "
                "convert the accelerometer to m/s over the sample"
            )
    _check_direction([one.accelerometer.sum(axis=0) for one, _ in rests(recording)], start.attitude_rad, where)
    _check_rate_at_rest(recording, imu.gyro.sum(axis=0) / duration_s, force_b, where, judged)


def _check_stands(recording: Recording, fixes: Fixes, where: str) -> None:
    speed = np.linalg.norm(fixes.velocity_n[fixes.valid, :2], axis=1)
    speed = speed[np.isfinite(speed)]
    usual = float(np.quantile(speed, 1.0 - MOVING_SHARE)) if speed.size else 0.0
    if usual > MOVING_MPS:
        raise DataRefused(
            f"{where}: it moves faster than {usual:.3g} m/s in {100.0 * MOVING_SHARE:.0f} % of the fixes, expected "
            f"rest, as of kind '{recording.kind}'; state the kind 'drive' or 'flight'"
        )


def _check_rate_at_rest(
    recording: Recording, mean_b: np.ndarray, force_b: np.ndarray, where: str, judged: bool
) -> None:
    """The gyros show Earth rate beside a bias that is believed, or that nobody ruled out.

    Where no bias is stated, a large one is refused only as a mix-up of units: it multiplies Earth rate by a known
    factor and keeps its direction, so that its part along gravity is sin(latitude). A bias seldom does both.
    """
    gyro = recording.belief.gyro
    duration_s = recording.imu.time_s[-1] - recording.start.time_s
    taken_off = np.zeros(3) if gyro.bias_radps is None else np.asarray(gyro.bias_radps)
    rate, left = float(np.linalg.norm(mean_b)), float(np.linalg.norm(mean_b - taken_off))
    guess = _guess(left / EARTH_RATE, duration_s / len(recording.imu.time_s), "gyro")
    if judged:
        most = LARGEST_BIAS_RADPS
    elif gyro.bias_sigma_deg_per_h is not None:  # a unit too coarse for Earth rate
        most = max(EARTH_RATE_FACTOR * EARTH_RATE, BIAS_SIGMAS * DEG_PER_H * gyro.bias_sigma_deg_per_h)
    else:
        named = guess and gyro.bias_radps is None and turns_as_the_earth(recording, mean_b, force_b)
        most = EARTH_RATE_FACTOR * EARTH_RATE if named else LARGEST_BIAS_RADPS
    if rate > EARTH_RATE / EARTH_RATE_FACTOR and left < most:
        return
    beside = f" beside the believed bias of {np.linalg.norm(taken_off) / DEG_PER_H:.4g}" if taken_off.any() else ""
    raise DataRefused(
        f"{where}: the mean gyro rate at rest is {left / DEG_PER_H:.4g} deg/h{beside}, {left / EARTH_RATE:.3g} times "
        f"Earth rate, expected about 15.04{guess}; convert the gyro to rad over the sample, check that the vehicle "
        "stood still, or believe in so large a bias with [gyro] bias_radps or bias_sigma_deg_per_h"
    )


def _check_direction(forces_b: list[np.ndarray], attitude_rad: tuple[float, float, float] | None, where: str) -> None:
    """The specific force at rest points up: against the down axis, as the start's attitude turns it.

    Of a box that is turned between stretches, in one of these at least: nobody says in which it had that attitude.
    """
    roll, pitch, _ = attitude_rad or (0.0, 0.0, 0.0)
    expected_b = np.array([np.sin(pitch), -np.sin(roll) * np.cos(pitch), -np.cos(roll) * np.cos(pitch)])
    ups_b = [force / np.linalg.norm(force) for force in forces_b if force.any()]
    if not ups_b:
        return
    up_b = max(ups_b, key=lambda one: float(one @ expected_b))
    cosine = float(up_b @ expected_b)
    if cosine >= np.cos(LARGEST_TILT_DEG * DEG):
        return
    shown = ", ".join(f"{value:.2f}" for value in up_b)
    guess = "does z point up?" if cosine < -np.cos(LARGEST_TILT_DEG * DEG) else "are the axes in another order?"
    raise DataRefused(
        f"{where}: at rest the specific force points along ({shown}) in forward, right, down, expected near "
        f"({', '.join(f'{value:.2f}' for value in expected_b)}); {guess} turn the axes to forward-right-down"
    )


def _guess(factor: float, step_s: float, sensor: str) -> str:
    found = mix_up(factor, step_s, sensor)
    return "" if found is None else f" ({found[1]}?)"


def _suspicions(recording: Recording, step_s: float) -> list[str]:
    """One sentence on stamps that are late, and for each channel that seems stuck or saturated, or spikes."""
    imu, notes = recording.imu, []
    if recording.start.latitude_rad == recording.start.longitude_rad == 0.0:
        notes.append(
            "Warning: the start is at exactly 0° N 0° E, where gravity and Earth rate may be others; state it."
        )
    late = np.diff(imu.time_s) > LONGEST_STEP * step_s
    if late.any():  # and no gap, which is refused
        notes.append(
            f"{np.count_nonzero(late)} samples are stamped late by more than half a step of {step_s:.4g} s, the next "
            f"as much less, first after {imu.time_s[np.argmax(late)]:.6g} s: jitter, none is missing."
        )
    for name, values in zip(CHANNELS, (*imu.gyro.T, *imu.accelerometer.T), strict=True):
        notes += _stuck(name, values, recording) + _saturated(name, values) + _spikes(name, values, imu.time_s)
    return notes


def _stuck(name: str, values: np.ndarray, recording: Recording) -> list[str]:
    """A run of one value that is longer than chance makes."""
    run = held(values, recording)
    if run is None:
        return []
    begin_s, end_s, _ = run
    if begin_s == recording.start.time_s and end_s == recording.imu.time_s[-1]:
        return [f"The {name} channel holds one value throughout: dead, or an ideal simulation."]
    seen = f"the {name} channel holds one value for {end_s - begin_s:.4g} s up to {end_s:.6g} s: stuck?"
    return [f"{consistency.WARNING}{seen}"]


def _saturated(name: str, values: np.ndarray) -> list[str]:
    return [
        f"{consistency.WARNING}the {name} channel is at its {which} value in {piled} samples: saturated?"
        for which, piled in saturated(values).items()
    ]


def _spikes(name: str, values: np.ndarray, time_s: np.ndarray) -> list[str]:
    rows = spikes(values)
    if not rows.size:
        return []
    one = rows.size == 1
    seen = f"a sample of the {name} channel stands" if one else f"{rows.size} samples of the {name} channel stand"
    return [
        f"{consistency.WARNING}{seen} far from both neighbours, which agree, first at {time_s[rows[0]]:.6g} s: "
        f"{'a fault, or a shock? What it says' if one else 'faults, or shocks? What they say'} is taken as motion."
    ]
