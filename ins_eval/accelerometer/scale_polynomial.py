"""Scale factor with temperature and its rate: the six-term polynomial of eq. (11).

K1 = alpha r^2 + beta dT^2 + eta r dT + epsilon r + mu dT + gamma,   dT = T - T0

Source: Paper A, eqs (11), (12) and (15)-(17). The paper leaves three things open, so each can be selected:

* T0: 22 degC is its only documented reference (step 1 of the chamber test);
* the unit of r: in degC/s the printed rate terms would be below 1 ppm, so degC/min;
* the sign of the odd rate terms eta and epsilon: the text says that the falling branch is the upper one, the
  printed signs make it the lower one. ``"text"`` turns both signs, ``"printed"`` keeps them.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from ins_eval.accelerometer.effect import AccelerometerEffect, Positive, SharedCourse
from ins_eval.accelerometer.run import ThermalRun
from ins_eval.scale_factor import TERMS, scale_factor_terms
from ins_eval.tables import Strict

# the power of r in each term, in the order of TERMS: where a rate unit and the rate sign enter
RATE_POWER = np.array([2, 0, 1, 1, 0, 0])


class ScaleFactor(Strict):
    """The printed coefficients of one accelerometer; gamma in pulse/(g s)."""

    name: str
    alpha: float
    beta: float
    eta: float
    epsilon: float
    mu: float
    gamma: Positive


class ScalePolynomial(SharedCourse):
    """Eq. (11) with the coefficients of known `units`, which are dealt to the axes and perturbed."""

    name: ClassVar[str] = "scale_polynomial"
    quantity = "scale_ppm"
    units: Annotated[tuple[ScaleFactor, ...], Field(min_length=1)]
    coefficients_in: Literal["pulse", "ppm"]  # pulse/(g s) as printed, or ppm of gamma; gamma itself is in pulse/(g s)
    reference_temperature_c: float
    rate_unit: Literal["degC/min", "degC/s"]
    rate_sign: Literal["text", "printed"]
    rate_filter_s: Positive
    spread: Annotated[float, Field(ge=0.0, lt=1.0)]  # each coefficient but gamma is uniform within 1 -+ spread

    def for_axes(
        self, rng: np.random.Generator
    ) -> tuple[AccelerometerEffect, AccelerometerEffect, AccelerometerEffect]:
        """One of the units for each axis, in random order."""
        drawn = np.resize(rng.permutation(len(self.units)), 3)
        x, y, z = (self.model_copy(update={"units": (self.units[k],)}) for k in drawn)
        return x, y, z

    def coefficients(self, unit: ScaleFactor) -> np.ndarray:
        """Coefficients (6,) in the order of `TERMS`, in pulse/(g s), degC and degC/min, sign of the rate applied."""
        value = np.array([getattr(unit, term) for term in TERMS])
        if self.coefficients_in == "ppm":
            value[:5] *= 1e-6 * unit.gamma
        if self.rate_unit == "degC/s":
            value = value / 60.0**RATE_POWER
        return np.where(RATE_POWER == 1, -value, value) if self.rate_sign == "text" else value

    def draw(self, rng: np.random.Generator, drawn: Mapping[str, Any]) -> np.ndarray:
        """Coefficients (6,) of one accelerometer, around the first of `units`."""
        factor = 1.0 + self.spread * rng.uniform(-1.0, 1.0, size=5)
        return self.coefficients(self.units[0]) * np.append(factor, 1.0)

    def sizes(self, unit: np.ndarray, run: ThermalRun, normal: np.ndarray | float) -> np.ndarray:
        return 1e6 * unit[..., :5] / unit[..., 5:]

    def courses(self, run: ThermalRun) -> np.ndarray:
        def compute(run: ThermalRun) -> np.ndarray:
            difference = run.temperature_c - self.reference_temperature_c
            return scale_factor_terms(difference, run.rate_c_per_min(self.rate_filter_s))[:, :5]

        return run.state((self.name, self.reference_temperature_c, self.rate_filter_s), compute)
