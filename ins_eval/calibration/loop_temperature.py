"""How readings of a digital loop follow temperature, and readings put back to one temperature.

In the laboratory a unit makes its own tests at several temperatures, within a day, so that nothing ages. Each of its
readings (slope of the scan, N_on - N_off, N_out at 1 g) then has a line of its own,

    reading(T) = reading(T0) (1 + alpha (T - T0)),    reading(T0) of the same unit,

by least squares. Later readings are divided by 1 + alpha (T - T0), T as the unit's thermometer gives it. What is left
is drift that is not temperature. A thermometer that is always wrong by the same takes nothing away; one that is not
where the parts are does.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ins_eval.calibration.loop_gains import Gain, slope
from ins_eval.units import PPM


class TemperatureLine(NamedTuple):
    """A reading at T0 = `at_c` (degC), and its coefficient alpha in ppm/degC with its interval."""

    at_c: float
    reading: float
    ppm_per_c: Gain

    def put_back(self, readings: np.ndarray, temperature_c: np.ndarray) -> np.ndarray:
        """What `readings` (...) made at `temperature_c` (...) would be at T0."""
        return readings / (1.0 + PPM * self.ppm_per_c.value * (temperature_c - self.at_c))


def fit(temperature_c: np.ndarray, readings: np.ndarray, at_c: float) -> TemperatureLine:
    """The line through `readings` (n,) at `temperature_c` (n,), n > 2."""
    found = slope(temperature_c, readings)
    reading = float(np.mean(readings) + found.value * (at_c - np.mean(temperature_c)))
    per_c = sorted(part / (PPM * reading) for part in (found.low, found.high))
    sigma = found.sigma / abs(PPM * reading)
    return TemperatureLine(at_c, reading, Gain(found.value / (PPM * reading), sigma, *per_c))
