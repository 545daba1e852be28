"""A recording as its files should have been described: signs, order, units, clocks, frames.

The effects `recording.*` of a belief say what the description of a recording has wrong; `mended` takes them off before
anything else is done with it. Columns that stand for each other are exchanged first; then signs and units, then clocks.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ins_eval.errors import UsageError
from ins_eval.recording import ChamberReadings, Fixes, Imu, Recording
from ins_eval.recording.belief import Belief, EffectBelief
from ins_eval.units import DEG

FAMILY = "recording."
AXES = ("x", "y", "z")
SENSORS = ("gyro", "accelerometer")
ENU, MAGNETIC = "ENU", "magnetic north"
FRAMES = (ENU, MAGNETIC)  # east-north-up for north-east-down; heading from magnetic north
ORDER = ("axes_exchanged", "axis_sign", "unit", "gps_velocity", "reference_frame", "clock_step", "clock_drift")


def mended(recording: Recording) -> Recording:
    """The recording with the effects `recording.*` of its belief taken off, of which none is left in it.

    Raises: UsageError for one that means nothing.
    """
    wrong = [one for one in recording.belief.effects if one.name.startswith(FAMILY)]
    if not wrong:
        return recording
    for k, one in enumerate(recording.belief.effects):
        if one.name.startswith(FAMILY):
            check(one, f"effects[{k}] ({one.name})")
    left = tuple(one for one in recording.belief.effects if one not in wrong)
    recording = replace(recording, belief=recording.belief.model_copy(update={"effects": left}))
    here = [one for one in wrong if one.recording in (None, recording.name)]
    for one in sorted(here, key=lambda one: ORDER.index(one.name.removeprefix(FAMILY))):
        recording = _mended(recording, one)
    return recording


def mended_chamber(readings: ChamberReadings, belief: Belief, name: str) -> tuple[ChamberReadings, Belief]:
    """The same for an accelerometer in a chamber: the unit and the sign of its output."""
    output = readings.output
    for one in belief.effects:
        if one.name in (f"{FAMILY}unit", f"{FAMILY}axis_sign") and one.recording in (None, name):
            output = output / one.value
    left = tuple(one for one in belief.effects if not one.name.startswith(FAMILY))
    return replace(readings, output=output), belief.model_copy(update={"effects": left})


def check(one: EffectBelief, where: str) -> None:
    """Refuse, in one sentence, a wrong description that means nothing; raises UsageError."""
    what = one.name.removeprefix(FAMILY)
    if what not in ORDER:
        return  # the vocabulary says which names there are
    of_sensor = what in ("axes_exchanged", "axis_sign", "unit")
    if of_sensor and one.sensor not in SENSORS:
        raise UsageError(f"{where}: sensor is {one.sensor or 'not given'}, expected {' or '.join(SENSORS)}; correct it")
    if what in ("axes_exchanged", "axis_sign") and one.axis not in AXES:
        raise UsageError(f"{where}: the axis is {one.axis or 'not given'}, expected x or y or z; correct it")
    others = [axis for axis in AXES if axis != one.axis]
    if what == "axes_exchanged" and one.other_axis not in others:
        raise UsageError(
            f"{where}: other_axis is {one.other_axis or 'not given'}, expected {' or '.join(others)}; correct it"
        )
    signs = {"axis_sign": (-1.0,), "axes_exchanged": (1.0, -1.0)}.get(what, ())
    signs = (-1.0,) if what == "gps_velocity" and one.axis == "down" else signs
    if signs and one.value not in signs:
        expected = " or ".join(f"{sign:g}" for sign in signs)
        raise UsageError(f"{where}: the value is {one.value:g}, expected {expected}; correct it")
    if what in ("unit", "gps_velocity") and not signs and not one.value > 0.0:
        raise UsageError(f"{where}: the factor is {one.value:g}, expected one above 0; correct it")
    if what == "clock_drift" and not one.value > -1e6:
        raise UsageError(f"{where}: the drift is {one.value:g} ppm, expected more than -1e6; time does not run back")
    if what == "clock_step" and one.at_s is None:
        raise UsageError(f"{where}: 'at_s' is missing; add it")
    if what == "reference_frame" and one.frame_found not in FRAMES:
        expected = " or ".join(f"'{frame}'" for frame in FRAMES)
        raise UsageError(f"{where}: frame_found is {one.frame_found or 'not given'}, expected {expected}; correct it")


def _mended(recording: Recording, one: EffectBelief) -> Recording:
    what = one.name.removeprefix(FAMILY)
    if what in ("axes_exchanged", "axis_sign", "unit"):
        return _of_sensor(recording, one.sensor, lambda values: values @ _turn(what, one).T)
    if what == "clock_step":
        return replace(
            recording,
            gps=_later(recording.gps, one, recording.belief.gps.time_offset_s),
            reference=_later(recording.reference, one, recording.belief.reference.time_offset_s),
        )
    if what == "clock_drift":
        return _steady(recording, one.value)
    if what == "gps_velocity":
        factor = np.array([1.0, 1.0, -1.0]) if one.axis == "down" else np.full(3, 1.0 / one.value)
        gps = recording.gps
        return recording if gps is None else replace(recording, gps=replace(gps, velocity_n=factor * gps.velocity_n))
    table = "gps" if recording.reference is None else "reference"
    fixes = getattr(recording, table)
    return recording if fixes is None else replace(recording, **{table: _reframed(fixes, one)})


def _turn(what: str, one: EffectBelief) -> np.ndarray:
    """The matrix (3, 3) that makes what is right of what was read."""
    matrix = np.eye(3)
    if what == "unit":
        return matrix / one.value
    k = AXES.index(one.axis)
    if what == "axis_sign":
        matrix[k, k] = -1.0
        return matrix
    j = AXES.index(one.other_axis)
    matrix[[k, j]] = one.value * matrix[[j, k]]
    return matrix


def _of_sensor(recording: Recording, sensor: str, change) -> Recording:
    imu = recording.imu
    return recording if imu is None else replace(recording, imu=replace(imu, **{sensor: change(getattr(imu, sensor))}))


def _later(fixes: Fixes | None, one: EffectBelief, offset_s: float) -> Fixes | None:
    """Fixes on the clock of the IMU as it is from the jump on; those that it puts before an earlier one are left out.

    The IMU's own stamps stay: each of its samples covers the step that its rate makes, before and after the jump.
    """
    if fixes is None:
        return None
    behind = fixes.time_s - offset_s >= one.at_s - max(one.value, 0.0)  # the first is stamped early already
    time_s = fixes.time_s + one.value * behind
    reached = np.maximum.accumulate(np.concatenate([[-np.inf], time_s[:-1]]))
    return replace(fixes, time_s=time_s).rows(time_s > reached)


def _steady(recording: Recording, ppm: float) -> Recording:
    """The stamps of the IMU at the pace of the others, counted from the start; increments stay what they are."""
    if recording.imu is None:
        return recording
    start_s = recording.start.time_s
    imu: Imu = recording.imu
    time_s = start_s + (imu.time_s - start_s) / (1.0 + 1e-6 * ppm)
    return replace(recording, imu=replace(imu, time_s=time_s))


def _reframed(fixes: Fixes, one: EffectBelief) -> Fixes:
    if one.frame_found == ENU:
        return replace(fixes, velocity_n=fixes.velocity_n[:, [1, 0, 2]] * [1.0, 1.0, -1.0])
    if fixes.attitude_rad is None:  # its heading is its course
        return turned(fixes, -one.value * DEG)
    return replace(fixes, attitude_rad=fixes.attitude_rad - np.array([0.0, 0.0, one.value * DEG]))


def turned(fixes: Fixes, angle_rad: float) -> Fixes:
    """The fixes with their velocities turned to the right; what is missing stays missing."""
    cosine, sine = np.cos(angle_rad), np.sin(angle_rad)
    velocity_n = fixes.velocity_n.copy()
    velocity_n[:, :2] = velocity_n[:, :2] @ np.array([[cosine, sine], [-sine, cosine]])
    return replace(fixes, velocity_n=velocity_n)
