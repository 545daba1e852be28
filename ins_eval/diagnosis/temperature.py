"""The temperature that the elements had, and what the steps of the thermometer do to a compensated output.

A regressor is made of the smoothed reading; the residual is made of the reading as it stands. With the same noisy
reading on both sides a lag is found in every recording that has none (errors in variables). The step q of the
thermometer makes an error of variance q^2 / 12 that stays for as long as a step lasts; through the slope of the
believed compensation it is noise of the accelerometer, of known size: density 2 sigma^2 times its correlation time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import savgol_filter

from ins_eval.compensation import Samples
from ins_eval.diagnosis.null import Believed, triad
from ins_eval.evaluate import samples
from ins_eval.thermal import filtered_rate
from ins_eval.units import MINUTE

SMOOTHING_S = 240.0
GRID_S = 1.0
SHORTEST_STEP_S, LONGEST_STEP_S = 5.0, 300.0
_SLOPE_STEP_C = 0.05


@dataclass(frozen=True, eq=False)
class Temperature:
    """Smoothed temperature (n, 3) in degC of the three accelerometers on a grid (n,) of seconds, and its rate."""

    time_s: np.ndarray
    smooth_c: np.ndarray
    rate_c_per_min: np.ndarray
    reference_c: float

    def at(self, values: np.ndarray, axis: int):
        """The function of time that goes through `values` (n, 3) of this axis."""
        return lambda time_s: np.interp(time_s, self.time_s, values[:, axis])


def temperature(believed: Believed) -> Temperature | None:
    """Temperature from the start of the recording on, so that memory begins where the convention says; or None."""
    recording = believed.recording
    reading = recording.imu.temperature_c
    if reading is None:
        return None
    reading = reading if reading.ndim == 2 else np.repeat(reading[:, None], 3, axis=1)
    time_s = recording.imu.time_s
    grid = np.arange(time_s[0], time_s[-1] + 0.5 * GRID_S, GRID_S)
    at_grid = np.column_stack([np.interp(grid, time_s, column) for column in reading.T])
    window = min(int(SMOOTHING_S / GRID_S) // 2 * 2 + 1, (grid.size - 1) // 2 * 2 - 1)
    smooth = savgol_filter(at_grid, window, 2, axis=0) if window > 3 else at_grid
    belief = recording.belief.accelerometer
    rate = np.column_stack(
        [filtered_rate(grid, np.ascontiguousarray(column), belief.rate_filter_s) for column in smooth.T]
    )
    return Temperature(grid, smooth, rate, belief.reference_temperature_c)


def step_noise(believed: Believed, seen: Temperature | None, middle_s: np.ndarray) -> np.ndarray:
    """Density (epochs, 3) in (m/s^2)^2 s of what the thermometer's steps add to each accelerometer."""
    out = np.zeros((middle_s.size, 3))
    recording = believed.recording
    if seen is None or recording.imu.accelerometer_form != "pulse":
        return out
    filter_s = recording.belief.accelerometer.rate_filter_s
    rows = np.clip(np.searchsorted(recording.imu.time_s, middle_s), 0, recording.imu.time_s.size - 1)
    for axis, (model, told) in enumerate(zip(triad(believed), samples(recording), strict=True)):
        step_c = _step(told.temperature_c)
        few = Samples(*(getattr(told, name)[rows] for name in ("time_s", "output", "temperature_c", "rate_c_per_min")))
        base = model.specific_force(few)
        warmer = Samples(few.time_s, few.output, few.temperature_c + _SLOPE_STEP_C, few.rate_c_per_min)
        faster = Samples(few.time_s, few.output, few.temperature_c, few.rate_c_per_min + _SLOPE_STEP_C)
        slope = (model.specific_force(warmer) - base) / _SLOPE_STEP_C
        slope_rate = (model.specific_force(faster) - base) / _SLOPE_STEP_C
        sigma = step_c / np.sqrt(12.0) * (np.abs(slope) + MINUTE / filter_s * np.abs(slope_rate))
        speed = np.abs(np.gradient(seen.smooth_c[:, axis], seen.time_s))
        lasting = step_c / np.maximum(np.interp(middle_s, seen.time_s, speed), 1e-9)
        out[:, axis] = 2.0 * sigma**2 * np.clip(0.25 * lasting, SHORTEST_STEP_S, LONGEST_STEP_S)
    return out


def _step(reading_c: np.ndarray) -> float:
    """The smallest change between readings that are not equal; 0 where the reading never changes."""
    changes = np.abs(np.diff(reading_c))
    changes = changes[changes > 1e-9]
    return float(np.quantile(changes, 0.1)) if changes.size else 0.0
