"""Non-linearity, cross-coupling and misalignment: the terms of eq. (1) beyond bias and scale factor.

The equation and its inverse stand in `ins_eval.output_equation`.
Source: Paper A, eq. (1), and Table 5 for K2 (scale-factor linearity 30 ppm: of the output at 1 g). The paper holds
the other terms to be negligible; they are zero by default.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from ins_eval.accelerometer.effect import AccelerometerEffect, NotNegative
from ins_eval.output_equation import Coefficients, force_error_ug


class Nonlinearity(AccelerometerEffect):
    """Constants of eq. (1); each is normal over the population."""

    name: ClassVar[str] = "nonlinearity"
    k2_sigma_ug_per_g2: NotNegative
    k3_sigma_ug_per_g3: NotNegative = 0.0
    kip_sigma_ug_per_g2: NotNegative = 0.0
    kio_sigma_ug_per_g2: NotNegative = 0.0
    delta_o_sigma_urad: NotNegative = 0.0
    delta_p_sigma_urad: NotNegative = 0.0

    def draw(self, rng: np.random.Generator, drawn: Mapping[str, Any]) -> Coefficients:
        sigma = (
            self.k2_sigma_ug_per_g2,
            self.k3_sigma_ug_per_g3,
            self.kip_sigma_ug_per_g2,
            self.kio_sigma_ug_per_g2,
            self.delta_o_sigma_urad,
            self.delta_p_sigma_urad,
        )
        return Coefficients(*(np.array(sigma) * rng.standard_normal(6)))

    def force_error_ug(self, unit: Coefficients, force_g: np.ndarray) -> np.ndarray | float:
        return force_error_ug(unit, force_g)
