"""Bias with the temperature of the inner elements.

K0 = omega1 d + omega2 d^2 + omega3 d^3,   d = Te - T0

Source: the size of omega1 is the bias temperature sensitivity of a comparable accelerometer (Paper A, Table 1,
GJN096-D: 50 ug/degC); the spread and the higher orders are assumed. The constant bias is calibrated away and left out.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from ins_eval.accelerometer.effect import LogSigma, NotNegative, SharedCourse
from ins_eval.accelerometer.run import ThermalRun


class BiasTemperature(SharedCourse):
    """Cubic in the element temperature; omega1 is log-normal in size and random in sign."""

    name: ClassVar[str] = "bias_temperature"
    quantity = "bias_ug"
    reference_temperature_c: float
    omega1_ug_per_c: NotNegative  # median size in the population
    omega1_sigma: LogSigma  # standard deviation of ln |omega1|
    omega2_sigma_ug_per_c2: NotNegative
    omega3_sigma_ug_per_c3: NotNegative

    def draw(self, rng: np.random.Generator, drawn: Mapping[str, Any]) -> np.ndarray:
        """omega1, omega2, omega3 in ug/degC, ug/degC^2, ug/degC^3, (3,)."""
        sign = rng.choice((-1.0, 1.0))
        omega1 = sign * self.omega1_ug_per_c * np.exp(self.omega1_sigma * rng.standard_normal())
        omega2, omega3 = rng.standard_normal(2)
        return np.array([omega1, self.omega2_sigma_ug_per_c2 * omega2, self.omega3_sigma_ug_per_c3 * omega3])

    def sizes(self, unit: np.ndarray, run: ThermalRun, normal: np.ndarray | float) -> np.ndarray:
        return unit

    def courses(self, run: ThermalRun) -> np.ndarray:
        def compute(run: ThermalRun) -> np.ndarray:
            d = run.element_c - self.reference_temperature_c
            return np.column_stack((d, d**2, d**3))

        return run.state((self.name, self.reference_temperature_c), compute)
