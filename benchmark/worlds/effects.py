"""The vocabulary's effects, each with physics of the benchmark's own. Values are true minus believed, as indicated.

`VOCABULARY` states for each name its unit, nominal size, axes and the recordings that can hold it; sizes are drawn
log-uniformly around the nominal one with a random sign. An effect acts on `Departures` of one recording.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numba
import numpy as np

from benchmark.worlds.description import a_description
from benchmark.worlds.heat import lag
from benchmark.worlds.instruments import Departures, Felt
from benchmark.worlds.noise import log_uniform

T0 = 22.0
AXES = ("x", "y", "z")
# axes of an accelerometer: input, pendulous, output
PENDULOUS, OUTPUT = {"x": "z", "y": "z", "z": "x"}, {"x": "y", "y": "x", "z": "y"}
ARCSEC = math.pi / 180.0 / 3600.0


def hours(felt: Felt) -> np.ndarray:
    return felt.time_s / 3600.0


def warm(felt: Felt, i: int) -> np.ndarray:
    return felt.temperature[:, i] - T0


@numba.njit(cache=True)
def _stops(temperature, half, weight, start):
    """Sum of stop operators: each follows the temperature until it slips at plus or minus its half width."""
    state, out = start.copy(), np.empty(temperature.size)
    last = temperature[0]
    for k in range(temperature.size):
        change, last, total = temperature[k] - last, temperature[k], 0.0
        for j in range(half.size):
            state[j] = min(max(state[j] + change, -half[j]), half[j])
            total += weight[j] * state[j]
        out[k] = total
    return out


def hysteresis(temperature: np.ndarray, width_c: float, start: float = 0.0) -> np.ndarray:
    """-1 on the rising and +1 on the falling branch, whatever the speed: a distribution of elementary loops.

    The weights are such that the other branch is reached to 63 % within `width_c` after a reversal at saturation; small
    loops inside are those of the distribution. `start` in -1 .. 1 is the state at the beginning.
    """
    half = width_c * np.geomspace(0.005, 6.0, 60)
    edges = np.concatenate(([0.0], np.sqrt(half[1:] * half[:-1]), [8.0 * width_c]))
    # weight(r) dr with r the half width: after a reversal the sum moves by the integral of weight min(d, 2 r)
    weight = 4.0 / width_c**2 * np.exp(-2.0 * half / width_c) * np.diff(edges)
    weight /= np.sum(weight * half)
    return -_stops(np.ascontiguousarray(temperature), half, weight, -start * half)


def creep(temperature: np.ndarray, dt: float, tau: float, law: str) -> np.ndarray:
    """What viscoelastic memory has followed of the temperature since the start, degC."""
    if law == "one":
        parts = ((1.0, tau),)
    elif law == "several":
        parts = ((0.35, 0.3 * tau), (0.4, tau), (0.25, 3.0 * tau))
    else:  # a power law, as a ladder of relaxations
        taus = tau * np.geomspace(0.03, 30.0, 9)
        weights = (taus / tau) ** -0.35 * np.exp(-0.5 * (np.log(taus / tau) / 1.6) ** 2)
        parts = tuple(zip(weights / weights.sum(), taus, strict=True))
    every = max(round(1.0 / dt), 1)
    slow = temperature[::every]
    followed = sum(share * lag(slow, dt * every, one) for share, one in parts)
    return np.interp(np.arange(temperature.size), np.arange(slow.size) * every, followed - followed[0])


@dataclass(frozen=True)
class Row:
    """A name of the vocabulary: its signal for one unit of value, and where it can be."""

    unit: str
    nominal: float
    target: str  # accel_ug, accel_ppm, gyro_deg_per_h, or a word of its own
    signal: Callable | None = None  # (felt, axis index, parameters) -> (n,)
    axes: tuple = AXES
    kinds: tuple = ("flight", "drive", "oven", "static")
    parameters: Callable = field(default=lambda rng: {})


def _other(rng):
    return {"other_axis": str(rng.choice(AXES))}


def _at(rng):
    return {"at_share": float(rng.uniform(0.15, 0.8))}  # of the recording; `Effect.settle` makes it a time


def _creep_parameters(rng):
    return {
        "time_constant_s": float(np.round(log_uniform(rng, 500, 6000), 1)),
        "law": str(rng.choice(("one", "one", "several", "power"))),
    }


def _index(axis: str) -> int:
    return AXES.index(axis)


MOVING, HOT, ALL = ("flight", "drive"), ("flight", "oven"), ("flight", "drive", "oven", "static")
UG, PPM, DPH = "accel_ug", "accel_ppm", "gyro_deg_per_h"
OF_ONE_SIGN = ("temperature.lag",)
DESCRIPTION = "description"  # written into the files, see `description`
rate = lambda f, i, p: f.rate[:, i]  # noqa: E731
step = lambda f, i, p: (f.time_s >= p["at_s"]).astype(float)  # noqa: E731

VOCABULARY: dict[str, Row] = {
    "accelerometer.bias": Row("ug", 250.0, UG, lambda f, i, p: np.ones(f.time_s.size), kinds=ALL),
    "accelerometer.bias_temperature": Row("ug/degC", 5.0, UG, lambda f, i, p: warm(f, i), kinds=HOT),
    "accelerometer.bias_temperature_quadratic": Row("ug/degC^2", 0.2, UG, lambda f, i, p: warm(f, i) ** 2, kinds=HOT),
    "accelerometer.bias_temperature_rate": Row("ug/(degC/min)", 60.0, UG, rate, kinds=HOT),
    "accelerometer.bias_creep": Row(
        "ug/degC", 7.0, UG, lambda f, i, p: creep(f.temperature[:, i], f.dt, p["time_constant_s"], p["law"]),
        kinds=HOT, parameters=_creep_parameters),
    "accelerometer.bias_step": Row("ug", 35.0, UG, step, kinds=ALL, parameters=_at),
    "accelerometer.bias_drift": Row("ug/h", 25.0, UG, lambda f, i, p: hours(f), kinds=ALL),
    "accelerometer.scale": Row("ppm", 250.0, PPM, lambda f, i, p: np.ones(f.time_s.size), kinds=MOVING),
    "accelerometer.scale_temperature": Row("ppm/degC", 6.0, PPM, lambda f, i, p: warm(f, i), kinds=HOT),
    "accelerometer.scale_temperature_quadratic": Row(
        "ppm/degC^2", 0.2, PPM, lambda f, i, p: warm(f, i) ** 2, kinds=HOT),
    "accelerometer.scale_temperature_rate": Row("ppm/(degC/min)", 60.0, PPM, rate, kinds=HOT),
    "accelerometer.scale_temperature_rate_quadratic": Row(
        "ppm/(degC/min)^2", 250.0, PPM, lambda f, i, p: f.rate[:, i] ** 2, kinds=HOT),
    "accelerometer.scale_temperature_rate_coupling": Row(
        "ppm/(degC degC/min)", 6.0, PPM, lambda f, i, p: f.rate[:, i] * warm(f, i), kinds=HOT),
    "accelerometer.scale_hysteresis": Row(
        "ppm", 25.0, PPM, lambda f, i, p: hysteresis(f.temperature[:, i], p["branch_width_c"], p["begin"]), kinds=HOT,
        parameters=lambda rng: {"branch_width_c": float(np.round(log_uniform(rng, 0.7, 7.0), 2)),
                                "begin": float(np.round(rng.uniform(-1, 1), 2))}),
    "accelerometer.scale_drift": Row("ppm/h", 35.0, PPM, lambda f, i, p: hours(f), kinds=ALL),
    "accelerometer.scale_step": Row("ppm", 150.0, PPM, step, kinds=MOVING, parameters=_at),
    "accelerometer.asymmetry": Row(
        "ppm", 250.0, UG, lambda f, i, p: np.abs(f.force_g[:, i]), kinds=MOVING),
    "accelerometer.quadratic": Row("ug/g^2", 120.0, UG, lambda f, i, p: f.force_g[:, i] ** 2, kinds=MOVING),
    "accelerometer.cubic": Row("ug/g^3", 120.0, UG, lambda f, i, p: f.force_g[:, i] ** 3, kinds=MOVING),
    "accelerometer.cross_pendulous": Row(
        "ug/g^2", 300.0, UG, lambda f, i, p: f.force_g[:, i] * f.force_g[:, _index(PENDULOUS[AXES[i]])], kinds=MOVING),
    "accelerometer.cross_output": Row(
        "ug/g^2", 300.0, UG, lambda f, i, p: f.force_g[:, i] * f.force_g[:, _index(OUTPUT[AXES[i]])], kinds=MOVING),
    "accelerometer.misalignment": Row(
        "urad", 250.0, UG, lambda f, i, p: f.force_g[:, _index(p["other_axis"])], kinds=MOVING, parameters=_other),
    "accelerometer.vibration_rectification": Row(
        "ug/g^2", 500.0, UG, lambda f, i, p: f.extra["vibration_rms_g"] ** 2, kinds=("flight",)),
    "temperature.lag": Row("s", 30.0, "lag", axes=(None,), kinds=HOT),
    "gyro.bias": Row("deg/h", 0.12, DPH, lambda f, i, p: np.ones(f.time_s.size), kinds=ALL),
    "gyro.bias_temperature": Row("(deg/h)/degC", 0.003, DPH, lambda f, i, p: warm(f, i), kinds=HOT),
    "gyro.bias_temperature_rate": Row("(deg/h)/(degC/min)", 0.06, DPH, rate, kinds=HOT),
    "gyro.bias_step": Row("deg/h", 0.03, DPH, step, kinds=ALL, parameters=_at),
    "gyro.bias_drift": Row("(deg/h)/h", 0.02, DPH, lambda f, i, p: hours(f), kinds=ALL),
    "gyro.scale": Row("ppm", 100.0, DPH, lambda f, i, p: 1e-6 * f.turn[:, i] / (ARCSEC), kinds=MOVING),
    "gyro.scale_step": Row(
        "ppm", 100.0, DPH, lambda f, i, p: 1e-6 * f.turn[:, i] * step(f, i, p) / ARCSEC, kinds=MOVING, parameters=_at),
    "gyro.asymmetry": Row("ppm", 250.0, DPH, lambda f, i, p: 1e-6 * np.abs(f.turn[:, i]) / ARCSEC, kinds=MOVING),
    "gyro.misalignment": Row(
        "urad", 80.0, DPH, lambda f, i, p: 1e-6 * f.turn[:, _index(p["other_axis"])] / ARCSEC, kinds=MOVING,
        parameters=_other),
    "gyro.g_sensitivity": Row(
        "(deg/h)/g", 0.06, DPH, lambda f, i, p: f.force_g[:, _index(p["other_axis"])], kinds=MOVING, parameters=_other),
    "alignment.level": Row("arcsec", 60.0, "attitude", axes=("north", "east"), kinds=ALL),
    "alignment.heading": Row("arcsec", 1200.0, "attitude", axes=(None,), kinds=ALL),
    "gps.lever_arm": Row("m", 1.0, "lever", kinds=MOVING),
    "gps.time_offset": Row("s", 0.015, "gps_offset", axes=(None,), kinds=MOVING),
    "reference.time_offset": Row("s", 0.005, "reference_offset", axes=(None,), kinds=MOVING),
    "reference.misalignment": Row("urad", 300.0, "reference_tilt", kinds=MOVING),
    **{f"earth.{flag}": Row("fraction", 1.0, "earth", axes=(None,), kinds=kinds) for flag, kinds in (
        ("rotation", ALL), ("coriolis", MOVING), ("transport_rate", MOVING), ("gravity_height", ALL),
        ("gravity_latitude", ALL))},
    "recording.axis_sign": Row("factor", 1.0, DESCRIPTION, kinds=MOVING),
    "recording.axes_exchanged": Row("factor", 1.0, DESCRIPTION, kinds=MOVING),
    "recording.unit": Row("factor", 1.0, DESCRIPTION, axes=(None,), kinds=MOVING),
    "recording.clock_step": Row("s", 0.1, DESCRIPTION, axes=(None,), kinds=MOVING),
    "recording.clock_drift": Row("ppm", 50.0, DESCRIPTION, axes=(None,), kinds=MOVING),
    "recording.gps_velocity": Row("factor", 1.0, DESCRIPTION, axes=(None, "down"), kinds=MOVING),
    "recording.reference_frame": Row("deg", 5.0, DESCRIPTION, axes=(None,), kinds=MOVING),
}  # fmt: skip


@dataclass(frozen=True)
class Effect:
    """An effect with its size; calling it adds it to the departures of a recording."""

    name: str
    axis: str | None
    value: float
    parameters: dict

    def __call__(self, felt: Felt, departures: Departures) -> None:
        row, value = VOCABULARY[self.name], self.value
        if row.signal is not None:
            i = _index(self.axis)
            total = np.zeros((felt.time_s.size, 3)) + getattr(departures, row.target)
            total[:, i] += value * row.signal(felt, i, self.parameters)
            setattr(departures, row.target, total)
        elif row.target == "lag":
            departures.element_lag_s = departures.element_lag_s + value
        elif row.target == "attitude":
            i = {"north": 0, "east": 1, None: 2}[self.axis]
            departures.attitude_rad[i] += value * ARCSEC
        elif row.target == "lever":
            departures.lever_m[_index(self.axis)] += value
        elif row.target == "gps_offset":
            departures.gps_offset_s += value
        elif row.target == "reference_offset":
            departures.reference_offset_s += value
        elif row.target == "reference_tilt":
            departures.reference_rad[_index(self.axis)] += value * 1e-6
        elif row.target == "earth":
            departures.earth += (self.name.split(".")[1],)

    def settle(self, seconds: float) -> None:
        """Times that were drawn as shares of a recording, now that its duration is known."""
        if "at_share" in self.parameters:
            self.parameters["at_s"] = round(self.parameters.pop("at_share") * seconds, 1)

    def record(self) -> dict:
        """As it stands in the truth."""
        return {"name": self.name, "axis": self.axis, "value": self.value, "unit": VOCABULARY[self.name].unit,
                **self.parameters}  # fmt: skip

    @property
    def channel(self) -> str:
        """The channel in which it is located."""
        group = self.name.split(".")[0]
        if group in ("accelerometer", "gyro"):
            return f"{group}.{self.axis}"
        return {"temperature": "temperature", "alignment": "navigation", "earth": "navigation",
                "gps": "gps.velocity", "reference": "reference.attitude",
                "recording": "clock" if "clock" in self.name else "recording"}[group]  # fmt: skip


def an_effect(rng, name: str, spread=(0.2, 5.0), axis: str | None = "draw") -> Effect:
    """An effect of the vocabulary with its size drawn log-uniformly within `spread` times the nominal one."""
    row = VOCABULARY[name]
    drawn = int(rng.integers(len(row.axes)))
    if row.target == PPM or name in ("accelerometer.quadratic", "accelerometer.cubic"):
        drawn = int(rng.choice(3, p=(0.2, 0.2, 0.6)))  # most often where specific force is
    axis = row.axes[drawn] if axis == "draw" else axis
    parameters = row.parameters(rng)
    if "other_axis" in parameters and parameters["other_axis"] == axis and name != "gyro.g_sensitivity":
        parameters["other_axis"] = AXES[(AXES.index(axis) + 1 + int(rng.integers(2))) % 3]
    if name.startswith("earth."):
        return Effect(name, None, 1.0, parameters)
    if row.target == DESCRIPTION:
        value, parameters = a_description(rng, name, axis)
        return Effect(name, axis, value, parameters)
    sign = 1.0 if name in OF_ONE_SIGN else rng.choice((-1.0, 1.0))
    value = float(f"{sign * row.nominal * log_uniform(rng, *spread):.5g}")
    return Effect(name, axis, value, parameters)
