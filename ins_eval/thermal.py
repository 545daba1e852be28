"""From flight to ambient, to the temperature of the IMU, to its reading and the rate of that reading."""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from ins_eval.errors import UsageError
from ins_eval.profile import Thermal, load
from ins_eval.trajectory import Trajectory
from ins_eval.units import HOUR

AIR_HEAT_CAPACITY = 1004.7  # J/(kg K), dry air at constant pressure
TROPOPAUSE_M = 11000.0  # ICAO standard atmosphere (Doc 7488): no lapse above
# of its pressure: T(0) / lapse, g M / (R lapse), and R T / (g M) above the tropopause
LAPSE_HEIGHT_M, PRESSURE_EXPONENT, SCALE_HEIGHT_M = 44331.0, 5.25588, 6341.6
BEFORE_STEP_S = 60.0  # of the temperatures before switch-on


@numba.njit(cache=True)
def _lagged(time_s, signal, time_constant_s, start):
    y = np.empty(signal.size)
    y[0] = start
    for k in range(1, signal.size):
        dt = time_s[k] - time_s[k - 1]
        decay = np.exp(-dt / time_constant_s)
        slope = (signal[k] - signal[k - 1]) / dt
        # exact response to a straight line between the two samples
        y[k] = signal[k] - slope * time_constant_s + (y[k - 1] - signal[k - 1] + slope * time_constant_s) * decay
    return y


def lagged(time_s: np.ndarray, signal: np.ndarray, time_constant_s: float, start: float | None = None) -> np.ndarray:
    """First-order lag, exact for a signal that is straight between samples.

    tau y' = x - y,   y(0) = `start`, or x(0) where it is None.

    Parameters: `time_s`, `signal` (n,); `time_constant_s` > 0. Returns (n,) in the unit of `signal`.
    """
    signal = np.ascontiguousarray(signal, dtype=float)
    return _lagged(
        np.ascontiguousarray(time_s, dtype=float), signal, time_constant_s, signal[0] if start is None else start
    )


def filtered_rate(time_s: np.ndarray, temperature_c: np.ndarray, time_constant_s: float = 180.0) -> np.ndarray:
    """Causal rate of a temperature in degC/min: tau y' = T - y, r = 60 (T - y) / tau.

    The same filter serves chamber, oven and flight, so that a coefficient means the same in all three.
    y starts at the first reading. Parameters: (n,), (n,), s. Returns (n,).
    """
    return 60.0 * (temperature_c - lagged(time_s, temperature_c, time_constant_s)) / time_constant_s


@dataclass(frozen=True)
class Thermometer:
    """A digital thermometer: a first-order lag, a conversion every `period_s`, whole steps, held in between.

    The step of 0.0625 degC is the DS18B20's 12-bit resolution (Paper A, section 3.1).
    """

    lag_s: float = 10.0
    step_c: float = 0.0625
    period_s: float = 1.0

    def read(self, time_s: np.ndarray, temperature_c: np.ndarray) -> np.ndarray:
        """Readings (n,) in degC at `time_s` of the true `temperature_c`, both (n,)."""
        felt = lagged(time_s, temperature_c, self.lag_s) if self.lag_s > 0 else temperature_c
        conversion = np.floor((time_s - time_s[0]) / self.period_s + 1e-9)
        latest = np.searchsorted(conversion, conversion, side="left")  # first sample of the current period
        return np.round(felt[latest] / self.step_c) * self.step_c


@dataclass(frozen=True, eq=False)
class Temperature:
    """True temperature of the IMU (n,) in degC at `time_s` (n,).

    `excess_c` (n,): by how much it is warmer than the air that flows past it. `self_heating_c`: how much warmer its own
    heat would keep it. `before`: what it lived through until it was switched on; None: long at the first temperature.
    """

    time_s: np.ndarray
    temperature_c: np.ndarray
    excess_c: np.ndarray
    self_heating_c: float
    before: Temperature | None = None


def thermometer_step(reading_c: np.ndarray) -> float:
    """The smallest change between readings, (n,) or (n, m), that are not equal; 0 where the reading never changes."""
    changes = np.abs(np.diff(reading_c, axis=0)).ravel()
    changes = changes[changes > 1e-9]
    return float(np.quantile(changes, 0.1)) if changes.size else 0.0


def standard_pressure(height_m: np.ndarray) -> np.ndarray:
    """Pressure of the standard atmosphere at `height_m` (n,), as a share of that at sea level, (n,).

    (1 - h / 44331 m)^5.25588 up to 11 km, from there on isothermal. Source: ICAO Doc 7488.
    """
    below = (1.0 - np.minimum(height_m, TROPOPAUSE_M) / LAPSE_HEIGHT_M) ** PRESSURE_EXPONENT
    return below * np.exp(-np.maximum(height_m - TROPOPAUSE_M, 0.0) / SCALE_HEIGHT_M)


def imu_temperature(trajectory: Trajectory, period_s: float = 1.0) -> Temperature:
    """Lumped heat balance of the IMU over a flight, from switching it on.

    tau T' = T_amb(h) + r V^2 / (2 c_p) + P - T

    T_amb is the standard atmosphere shifted to the ground temperature, or falls from there with
    ``thermal.lapse_c_per_km`` up to 11 km. The second term is the recovery of the air stream's stagnation temperature,
    P the self-heating in degC: given, or solved so that T meets ``thermal.anchor``. The IMU begins at ambient
    temperature, or at that to which ``thermal.before`` brought it (the same balance, P only while it was on).
    A profile with ``thermal.same_as`` repeats the history of that profile.
    """
    thermal = trajectory.profile.thermal
    if thermal.same_as is not None:
        other = Trajectory(load(thermal.same_as))
        if other.profile.thermal.same_as is not None:
            raise UsageError(
                f"{trajectory.profile.name}: repeats the temperatures of '{thermal.same_as}', which has none of its "
                "own; name a profile that has"
            )
        if (other.start_s, other.end_s) != (trajectory.start_s, trajectory.end_s):
            raise UsageError(
                f"{trajectory.profile.name}: runs from {trajectory.start_s:g} s to {trajectory.end_s:g} s, but repeats "
                f"the temperatures of '{thermal.same_as}' from {other.start_s:g} s to {other.end_s:g} s; give both the "
                "same duration_s and stand_s"
            )
        return imu_temperature(other, period_s)
    time_s = np.arange(trajectory.start_s, trajectory.end_s + 0.5 * period_s, period_s)
    truth = trajectory.truth(time_s)
    speed_squared = np.sum(truth.velocity_n**2, axis=1)
    ambient = _still_air_c(thermal, truth.height_m) + thermal.recovery_factor * speed_squared / (
        2.0 * AIR_HEAT_CAPACITY
    )
    before = _Before(thermal, time_s[0])
    cold = lagged(time_s, ambient, thermal.time_constant_s, before.cold_c[-1] if thermal.before else None)
    # response to one degree of self-heating
    warmed = 1.0 - (1.0 - before.warmed[-1]) * np.exp(-(time_s - time_s[0]) / thermal.time_constant_s)
    self_heating_c = thermal.self_heating_c
    if thermal.anchor is not None:
        at = np.searchsorted(time_s, thermal.anchor.time_s)
        if not 0 < at < time_s.size:
            raise UsageError(
                f"{trajectory.profile.name}: thermal.anchor.time_s = {thermal.anchor.time_s:g} lies outside the "
                "flight; move it inside"
            )
        self_heating_c = (thermal.anchor.temperature_c - cold[at]) / warmed[at]
    temperature_c = cold + self_heating_c * warmed
    return Temperature(
        time_s, temperature_c, temperature_c - ambient, float(self_heating_c), before.temperature(self_heating_c)
    )


class _Before:
    """The IMU before it was switched on for the flight: cooled and warmed by ``thermal.before`` up to `end_s`.

    `cold_c` (m,) is its temperature without heat of its own, `warmed` (m,) what one degree of self-heating adds.
    """

    def __init__(self, thermal: Thermal, end_s: float):
        hours = np.array([0.0, *(stretch.hours for stretch in thermal.before)])
        corners_s = end_s - HOUR * (hours.sum() - np.cumsum(hours))
        count = int(np.ceil((end_s - corners_s[0]) / BEFORE_STEP_S)) + 1
        self.time_s = np.linspace(corners_s[0], end_s, count)
        of = np.clip(np.searchsorted(corners_s, self.time_s, side="right") - 1, 0, max(len(thermal.before) - 1, 0))
        self.air_c, on = (
            np.array([getattr(stretch, key) for stretch in thermal.before] or [0.0], dtype=float)[of]
            for key in ("air_c", "on")
        )
        self.cold_c = lagged(self.time_s, self.air_c, thermal.time_constant_s)
        self.warmed = lagged(self.time_s, on, thermal.time_constant_s, start=0.0)

    def temperature(self, self_heating_c: float) -> Temperature | None:
        """The same as a history without its last point, at which the flight begins; None where nothing was before."""
        if self.time_s.size < 2:
            return None
        temperature_c = self.cold_c + self_heating_c * self.warmed
        excess_c = temperature_c - self.air_c
        return Temperature(self.time_s[:-1], temperature_c[:-1], excess_c[:-1], self_heating_c)


def _still_air_c(thermal: Thermal, height_m: np.ndarray) -> np.ndarray:
    """Temperature of the air at `height_m` (n,), the first of which is the ground."""
    if thermal.lapse_c_per_km is None:
        standard_c = _standard_temperature_c(height_m)
        return standard_c + (thermal.ground_c - _standard_temperature_c(height_m[:1])[0])
    climbed_m = np.minimum(height_m, TROPOPAUSE_M) - min(height_m[0], TROPOPAUSE_M)
    return thermal.ground_c - 1e-3 * thermal.lapse_c_per_km * climbed_m


def _standard_temperature_c(height_m: np.ndarray) -> np.ndarray:
    from ambiance import Atmosphere  # imported here, for it takes long and every model's child imports this module

    return Atmosphere(height_m).temperature - 273.15
