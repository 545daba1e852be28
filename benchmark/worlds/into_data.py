"""Effects written into the columns of a real recording: `indicated = true + value * signal`, in formulas of its own.

A value is true minus believed, in what is indicated; ppm are of what is indicated. T0 and the rate filter are those
that the recording believes. Each function changes a copy of the tables in place.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmark.worlds.earth import to_euler
from benchmark.worlds.heat import filtered_rate
from benchmark.worlds.receivers import moved, rotations
from benchmark.worlds.recorded import ACCEL, ANGLES, DEG, GYRO, NAVIGATORS, Recorded, attitudes

AXES = "xyz"
T0_C, FILTER_S = 22.0, 180.0  # where the recording states none, as the form has it
G0 = 9.80665  # m/s^2
DEG_PER_H = DEG / 3600.0
UG = 1e-6 * G0
COLUMNS = {"gyro": GYRO, "accelerometer": ACCEL}
SI = {"gyro": DEG_PER_H, "accelerometer": UG}  # of one unit of a bias


@dataclass(frozen=True)
class Applied:
    """An effect with its size, as it stands in the truth."""

    name: str
    axis: str | None
    value: float
    unit: str
    parameters: dict

    @property
    def sensor(self) -> str:
        return self.parameters.get("sensor", self.name.split(".")[0])

    @property
    def channels(self) -> tuple[str, ...]:
        """Where it may be located."""
        if self.sensor in COLUMNS:
            axes = {self.axis, self.parameters.get("other_axis")} & set(AXES)
            of_data = ("recording",) if self.name.startswith("recording.") else ()
            return tuple(f"{self.sensor}.{axis}" for axis in sorted(axes or AXES)) + of_data
        if "clock" in self.name or "time_offset" in self.name:
            return ("clock", "gps.position", "gps.velocity", "reference.attitude", "navigation")
        if self.name.startswith("reference.") or self.name == "recording.reference_frame":
            return ("reference.attitude", "recording")
        return ("gps.position", "gps.velocity", "recording")

    def record(self) -> dict:
        return {"name": self.name, "axis": self.axis, "value": self.value, "unit": self.unit, **self.parameters}


def apply(recorded: Recorded, effect: Applied, late_s: float = 0.0) -> Recorded:
    """The same recording with the effect in its data; its fixes are `late_s` later than believed already."""
    out = recorded.copy()
    if effect.name == "gps.lever_arm":
        _lever(out, effect, late_s)
    else:
        OF_NAME[effect.name](out, effect)
    return out


def signal(recorded: Recorded, effect: Applied) -> np.ndarray:
    """What the value multiplies over time, (n,): 1, the time, a step, the temperature or its rate."""
    t = recorded.time_s - recorded.start_s
    law = effect.name.split(".")[1].removeprefix("bias").removeprefix("scale").lstrip("_")
    if law == "":
        return np.ones(t.size)
    if law == "step":
        return (recorded.time_s >= effect.parameters["at_s"]).astype(float)
    if law == "drift":
        return t / 3600.0
    temperature = recorded.tables["chamber" if recorded.kind == "chamber" else "imu"]["temperature_c"]
    believed = recorded.head.get("accelerometer", {})
    warm = temperature - believed.get("reference_temperature_c", T0_C)
    if law == "temperature":
        return warm
    if law == "temperature_quadratic":
        return warm**2
    if law == "temperature_rate":
        step_s = float(np.median(recorded.step_s))
        return filtered_rate(temperature, step_s, believed.get("rate_filter_s", FILTER_S))
    raise ValueError(f"{effect.name}: has no law in this world")


def _bias(out: Recorded, effect: Applied) -> None:
    """value s(t) added to a rate or a specific force, or to the output of a chamber in counts."""
    added = effect.value * signal(out, effect)
    if out.kind == "chamber":
        table = out.tables["chamber"]
        table["output"] = table["output"] + added * 1e-6 * _counts(out, effect.axis)
        return
    column = COLUMNS[effect.sensor][AXES.index(effect.axis)]
    out.tables["imu"][column] = out.tables["imu"][column] + added * SI[effect.sensor] * out.step_s


def _counts(out: Recorded, axis: str) -> float:
    """Counts a second of 1 g."""
    return float(out.head["accelerometer"][axis]["scale"]["gamma"])


def _scale(out: Recorded, effect: Applied) -> None:
    """(1 + 1e-6 value s(t)) times what is indicated."""
    factor = 1.0 + 1e-6 * effect.value * signal(out, effect)
    name, column = ("chamber", "output") if out.kind == "chamber" else (
        "imu", COLUMNS[effect.sensor][AXES.index(effect.axis)])  # fmt: skip
    out.tables[name][column] = out.tables[name][column] * factor


def _misalignment(out: Recorded, effect: Applied) -> None:
    """value urad of what acts along the other axis."""
    names = COLUMNS[effect.sensor]
    own, other = (names[AXES.index(axis)] for axis in (effect.axis, effect.parameters["other_axis"]))
    imu = out.tables["imu"]
    imu[own] = imu[own] + 1e-6 * effect.value * imu[other]


def _g_sensitivity(out: Recorded, effect: Applied) -> None:
    """value (deg/h)/g of the specific force along an axis."""
    imu = out.tables["imu"]
    own, force = GYRO[AXES.index(effect.axis)], ACCEL[AXES.index(effect.parameters["other_axis"])]
    imu[own] = imu[own] + effect.value * DEG_PER_H * imu[force] / G0


def _late(name: str) -> Callable[[Recorded, Applied], None]:
    """The stamps of a navigator are later by value."""

    def change(out: Recorded, effect: Applied) -> None:
        out.tables[name]["time_s"] = out.tables[name]["time_s"] + effect.value

    return change


def _clock_step(out: Recorded, effect: Applied) -> None:
    """Stamps of the IMU are late by value from a time on; it counts on, so the fixes are stamped earlier by it."""
    table = out.tables["gps" if "gps" in out.tables else "reference"]
    table["time_s"] = table["time_s"] - effect.value * (table["time_s"] >= effect.parameters["at_s"])


def _clock_drift(out: Recorded, effect: Applied) -> None:
    """The clock of the IMU is fast by value."""
    t, t0 = out.tables["imu"]["time_s"], out.start_s
    out.tables["imu"]["time_s"] = t0 + (t - t0) * (1.0 + 1e-6 * effect.value)


def _lever(out: Recorded, effect: Applied, late_s: float = 0.0) -> None:
    """The antenna is farther out by value along a body axis; it turns with the body, when the fix was measured."""
    fixes, imu = out.tables["gps"], out.tables["imu"]
    at, arm = fixes["time_s"] - out.head["gps"].get("time_offset_s", 0.0) - late_s, np.zeros(3)
    arm[AXES.index(effect.axis)] = effect.value
    c = attitudes(out.tables["reference"], at)
    rate = out.triad(GYRO) / out.step_s[:, None]
    turn = np.column_stack([np.interp(at, imu["time_s"], one) for one in rate.T])
    _move(fixes, np.einsum("nij,j->ni", c, arm))
    added = np.einsum("nij,nj->ni", c, np.cross(turn, arm))
    for i, axis in enumerate("ned"):
        fixes[f"velocity_{axis}_mps"] = fixes[f"velocity_{axis}_mps"] + added[:, i]


def _move(fixes: dict[str, np.ndarray], ned_m: np.ndarray) -> None:
    lla = np.column_stack([fixes["latitude_deg"] * DEG, fixes["longitude_deg"] * DEG, fixes["height_m"]])
    lla = moved(lla, ned_m)
    fixes["latitude_deg"], fixes["longitude_deg"], fixes["height_m"] = lla[:, 0] / DEG, lla[:, 1] / DEG, lla[:, 2]


def _reference_turned(out: Recorded, effect: Applied) -> None:
    """The box of the better navigator is turned about a body axis."""
    turned = np.zeros((1, 3))
    turned[0, AXES.index(effect.axis)] = 1e-6 * effect.value
    table = out.tables["reference"]
    c = attitudes(table, table["time_s"]) @ rotations(turned)
    roll, pitch, heading = to_euler(c)
    for name, angle in zip(ANGLES, (roll, pitch, np.mod(heading, 2.0 * math.pi)), strict=True):
        table[name] = angle / DEG


def _reference_frame(out: Recorded, effect: Applied) -> None:
    """Headings count from magnetic north: they are smaller by the declination."""
    table = out.tables["reference"]
    table["heading_deg"] = np.mod(table["heading_deg"] + effect.value, 360.0)


def _axis_sign(out: Recorded, effect: Applied) -> None:
    """A column has the other sign."""
    column = COLUMNS[effect.sensor][AXES.index(effect.axis)]
    out.tables["imu"][column] = -out.tables["imu"][column]


def _axes_exchanged(out: Recorded, effect: Applied) -> None:
    """Two columns stand for each other."""
    names, imu = COLUMNS[effect.sensor], out.tables["imu"]
    own, other = (names[AXES.index(axis)] for axis in (effect.axis, effect.parameters["other_axis"]))
    imu[own], imu[other] = imu[other], imu[own]


def _unit(out: Recorded, effect: Applied) -> None:
    """All columns of a sensor are value times too large."""
    if out.kind == "chamber":
        out.tables["chamber"]["output"] = out.tables["chamber"]["output"] * effect.value
        return
    for column in COLUMNS[effect.sensor]:
        out.tables["imu"][column] = out.tables["imu"][column] * effect.value


def _gps_velocity(out: Recorded, effect: Applied) -> None:
    """The velocities of the receiver are value times too large, or one axis of them."""
    for axis in "d" if effect.axis == "down" else "ned":
        name = f"velocity_{axis}_mps"
        out.tables["gps"][name] = out.tables["gps"][name] * effect.value


LAWS = ("temperature", "temperature_quadratic", "temperature_rate")
OF_NAME: dict[str, Callable[[Recorded, Applied], None]] = {
    **{f"{sensor}.bias{law}": _bias for sensor in COLUMNS
       for law in ("", "_step", "_drift", *(f"_{one}" for one in LAWS))},
    **{f"{sensor}.scale{law}": _scale for sensor in COLUMNS
       for law in ("", "_step", "_drift", *(f"_{one}" for one in LAWS))},
    **{f"{sensor}.misalignment": _misalignment for sensor in COLUMNS},
    "gyro.g_sensitivity": _g_sensitivity,
    **{f"{name}.time_offset": _late(name) for name in NAVIGATORS},
    "gps.lever_arm": _lever,
    "reference.misalignment": _reference_turned,
    "recording.axis_sign": _axis_sign,
    "recording.axes_exchanged": _axes_exchanged,
    "recording.unit": _unit,
    "recording.clock_step": _clock_step,
    "recording.clock_drift": _clock_drift,
    "recording.gps_velocity": _gps_velocity,
    "recording.reference_frame": _reference_frame,
}  # fmt: skip
