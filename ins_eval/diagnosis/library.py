"""Effects that can be told apart by a column: what each drives, in which unit, and how large it usually is.

One row an effect, after the vocabulary of the answer. A row names the sensor, the multiplier that is integrated at
the sample rate (`drives`), the slow factor, the SI value of one unit, and a nominal size that is one sigma of the
prior's middle scale. Effects that need more than a row (receiver, start, Earth) are made by a function below.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from ins_eval.diagnosis.columns import EARTH_TERMS, Column, Drive, Measured, Missing, Slow
from ins_eval.diagnosis.error_model import ErrorModel
from ins_eval.diagnosis.null import Believed
from ins_eval.diagnosis.temperature import Temperature
from ins_eval.output_equation import SENSOR_AXES
from ins_eval.thermal import lagged
from ins_eval.units import ARCSEC, DEG_PER_H, HOUR, PPM, STANDARD_GRAVITY, UG

AXES = "xyz"
CREEP_TIMES_S = (300.0, 600.0, 1200.0, 2400.0, 4800.0)
HYSTERESIS_WIDTHS_C = (0.5, 1.0, 2.0, 4.0, 8.0)
STEPS = 40  # instants at which a step is tried, over the whole recording
LEVER_ARM_M, DELAY_S = 0.5, 0.02
LEVEL, HEADING = 20.0 * ARCSEC, 200.0 * ARCSEC


@dataclass(frozen=True)
class Row:
    """An effect of an accelerometer or a gyro that is multiplier x slow factor."""

    name: str
    sensor: str
    multiplier: str
    slow: str
    unit: str
    si: float
    nominal: float


A, G = "accelerometer", "gyro"
_PER_G = 1.0 / STANDARD_GRAVITY
ROWS = (
    Row("accelerometer.bias", A, "1", "1", "ug", UG, 100.0),
    Row("accelerometer.bias_temperature", A, "1", "T", "ug/degC", UG, 4.0),
    Row("accelerometer.bias_temperature_quadratic", A, "1", "T^2", "ug/degC^2", UG, 0.1),
    Row("accelerometer.bias_temperature_rate", A, "1", "r", "ug/(degC/min)", UG, 100.0),
    Row("accelerometer.bias_drift", A, "1", "t", "ug/h", UG / HOUR, 30.0),
    Row("accelerometer.scale", A, "f", "1", "ppm", PPM, 100.0),
    Row("accelerometer.scale_temperature", A, "f", "T", "ppm/degC", PPM, 5.0),
    Row("accelerometer.scale_temperature_quadratic", A, "f", "T^2", "ppm/degC^2", PPM, 0.1),
    Row("accelerometer.scale_temperature_rate", A, "f", "r", "ppm/(degC/min)", PPM, 100.0),
    Row("accelerometer.scale_temperature_rate_quadratic", A, "f", "r^2", "ppm/(degC/min)^2", PPM, 300.0),
    Row("accelerometer.scale_temperature_rate_coupling", A, "f", "r T", "ppm/(degC degC/min)", PPM, 5.0),
    Row("accelerometer.scale_drift", A, "f", "t", "ppm/h", PPM / HOUR, 30.0),
    Row("accelerometer.quadratic", A, "f^2", "1", "ug/g^2", UG * _PER_G**2, 20.0),
    Row("accelerometer.cubic", A, "f^3", "1", "ug/g^3", UG * _PER_G**3, 20.0),
    Row("accelerometer.cross_pendulous", A, "f f_pendulous", "1", "ug/g^2", UG * _PER_G**2, 20.0),
    Row("accelerometer.cross_output", A, "f f_output", "1", "ug/g^2", UG * _PER_G**2, 20.0),
    Row("accelerometer.misalignment", A, "f_pendulous", "1", "urad", 1e-6, 50.0),
    Row("accelerometer.misalignment", A, "f_output", "1", "urad", 1e-6, 50.0),
    Row("gyro.bias", G, "1", "1", "deg/h", DEG_PER_H, 0.05),
    Row("gyro.bias_temperature", G, "1", "T", "(deg/h)/degC", DEG_PER_H, 1e-3),
    Row("gyro.bias_temperature_rate", G, "1", "r", "(deg/h)/(degC/min)", DEG_PER_H, 0.05),
    Row("gyro.bias_drift", G, "1", "t", "(deg/h)/h", DEG_PER_H / HOUR, 0.01),
    Row("gyro.scale", G, "w", "1", "ppm", PPM, 50.0),
    Row("gyro.misalignment", G, "w_next", "1", "urad", 1e-6, 50.0),
    Row("gyro.misalignment", G, "w_last", "1", "urad", 1e-6, 50.0),
    Row("gyro.g_sensitivity", G, "f", "1", "(deg/h)/g", DEG_PER_H * _PER_G, 0.02),
    Row("gyro.g_sensitivity", G, "f_next", "1", "(deg/h)/g", DEG_PER_H * _PER_G, 0.02),
    Row("gyro.g_sensitivity", G, "f_last", "1", "(deg/h)/g", DEG_PER_H * _PER_G, 0.02),
)


@dataclass(frozen=True)
class Candidate:
    """One column with what it stands for; its coefficient times `nominal` is the value in `unit`."""

    name: str
    axis: str | None
    unit: str
    nominal: float
    column: Column
    parameters: dict[str, float | str] = field(default_factory=dict)
    centre: float = 0.0  # other than 0: what physics fixes the coefficient to, in nominal sizes


def slow_factors(model: ErrorModel, seen: Temperature | None) -> Slow:
    """Time, and of each axis temperature, rate and their products."""
    slow = Slow()
    start_s = model.nodes_s[0]
    slow.add("t", lambda time_s: time_s - start_s, model)
    for axis in range(3) if seen is not None else ():
        t, r = seen.smooth_c - seen.reference_c, seen.rate_c_per_min
        for name, values in {"T": t, "T^2": t**2, "r": r, "r^2": r**2, "r T": r * t}.items():
            slow.add(f"{name} {AXES[axis]}", seen.at(values, axis), model)
    return slow


def candidates(believed: Believed, model: ErrorModel, seen: Temperature | None, slow: Slow) -> list[Candidate]:
    """Every effect that this recording could show."""
    return [
        *_of_rows(seen),
        *_creep(seen, model, slow),
        *_hysteresis(seen, model, slow),
        *_steps(model, slow),
        *_of_receiver(believed),
        *_of_start(believed),
        *_of_earth(believed),
    ]


def _drive(sensor: str, axis: int, multiplier: str, size: float, slow: str = "1") -> Column:
    return Column("", (Drive(sensor, axis, multiplier, size, slow),))


def _of_rows(seen: Temperature | None) -> Iterator[Candidate]:
    for row in ROWS:
        thermal = row.slow not in ("1", "t")
        if thermal and seen is None:
            continue
        for axis in range(3):
            slow = f"{row.slow} {AXES[axis]}" if thermal else row.slow
            other = _other_axis(row, axis)
            yield Candidate(
                row.name,
                AXES[axis],
                row.unit,
                row.nominal,
                _drive(row.sensor, axis, row.multiplier, row.si * row.nominal, slow),
                {"other_axis": other} if other else {},
            )


def _other_axis(row: Row, axis: int) -> str | None:
    """The axis that a multiplier takes from elsewhere."""
    _, pendulous, output = SENSOR_AXES[AXES[axis]]
    places = {"f_pendulous": pendulous, "f_output": output}
    if row.sensor == "gyro":
        ahead, behind = (axis + 1) % 3, (axis + 2) % 3
        places = {"w_next": ahead, "w_last": behind, "f": axis, "f_next": ahead, "f_last": behind}
    return AXES[places[row.multiplier]] if row.multiplier in places else None


def _creep(seen: Temperature | None, model: ErrorModel, slow: Slow) -> Iterator[Candidate]:
    if seen is None:
        return
    for tau in CREEP_TIMES_S:
        for axis in range(3):
            memory = lagged(seen.time_s, np.ascontiguousarray(seen.smooth_c[:, axis]), tau)
            values = np.repeat((memory - memory[0])[:, None], 3, axis=1)
            name = slow.add(f"creep {tau:g} {AXES[axis]}", seen.at(values, axis), model)
            column = _drive(A, axis, "1", UG * 4.0, name)
            yield Candidate("accelerometer.bias_creep", AXES[axis], "ug/degC", 4.0, column, {"time_constant_s": tau})


def _hysteresis(seen: Temperature | None, model: ErrorModel, slow: Slow) -> Iterator[Candidate]:
    if seen is None:
        return
    for width in HYSTERESIS_WIDTHS_C:
        for axis in range(3):
            side = branch(seen.smooth_c[:, axis], width)
            name = slow.add(f"branch {width:g} {AXES[axis]}", seen.at(np.repeat(side[:, None], 3, 1), axis), model)
            column = _drive(A, axis, "f", PPM * 30.0, name)
            yield Candidate(
                "accelerometer.scale_hysteresis", AXES[axis], "ppm", 30.0, column, {"branch_width_c": width}
            )


def branch(temperature_c: np.ndarray, width_c: float) -> np.ndarray:
    """+1 on the falling, -1 on the rising branch: dh = (-sign(dT) - h) |dT| / width, from the branch it starts on."""
    steps = np.diff(temperature_c)
    out = np.empty(temperature_c.size)
    far = np.flatnonzero(np.abs(temperature_c - temperature_c[0]) > 0.1 * width_c)
    out[0] = -np.sign(temperature_c[far[0]] - temperature_c[0]) if far.size else 0.0
    for k, step in enumerate(steps):
        out[k + 1] = -np.sign(step) + (out[k] + np.sign(step)) * np.exp(-abs(step) / width_c)
    return out


def _steps(model: ErrorModel, slow: Slow) -> Iterator[Candidate]:
    start_s, end_s = float(model.nodes_s[0]), float(model.nodes_s[-1])
    for at_s in np.linspace(start_s, end_s, STEPS + 2)[1:-1]:
        window = slow.add_window(float(at_s), end_s + 1.0, model)
        for axis in range(3):
            where = {"at_s": float(at_s)}
            yield Candidate(
                "accelerometer.bias_step", AXES[axis], "ug", 50.0, _drive(A, axis, "1", UG * 50.0, window), where
            )
            column = _drive(G, axis, "1", DEG_PER_H * 0.02, window)
            yield Candidate("gyro.bias_step", AXES[axis], "deg/h", 0.02, column, where)


def _of_receiver(believed: Believed) -> Iterator[Candidate]:
    recording = believed.recording
    if recording.gps is not None:
        for axis in AXES:
            column = Column("", (Measured(f"arm_{axis}", LEVER_ARM_M),))
            yield Candidate("gps.lever_arm", axis, "m", LEVER_ARM_M, column)
    for name, fixes in (("reference", recording.reference), ("gps", recording.gps)):
        if fixes is not None:
            yield Candidate(f"{name}.time_offset", None, "s", DELAY_S, Column("", (Measured("delay", DELAY_S),)))
            return


def _of_start(believed: Believed) -> Iterator[Candidate]:
    for k, (name, axis, size) in enumerate(
        (("alignment.level", "north", LEVEL), ("alignment.level", "east", LEVEL), ("alignment.heading", None, HEADING))
    ):
        start = np.zeros(9)
        start[6 + k] = size
        yield Candidate(name, axis, "arcsec", size / ARCSEC, Column("", start=tuple(start)))


def _of_earth(believed: Believed) -> Iterator[Candidate]:
    earth = believed.recording.belief.earth
    for term in EARTH_TERMS:
        if not getattr(earth, term):
            # physics fixes the coefficient to 1
            yield Candidate(f"earth.{term}", None, "1", 0.05, Column("", (Missing(term, 0.05),)), centre=20.0)
