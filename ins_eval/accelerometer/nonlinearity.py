"""Non-linearity, cross-coupling and misalignment: the terms of eq. (1) beyond bias and scale factor.

error = K2 ai^2 + K3 ai^3 + Kip ai ap + Kio ai ao + delta_o ap - delta_p ao

with the specific force in g along the input (i), pendulous (p) and output (o) axis.
Source: Paper A, eq. (1), and Table 5 for K2 (scale-factor linearity 30 ppm: of the output at 1 g). The paper holds
the other terms to be negligible; they are zero by default.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple

import numpy as np

from ins_eval.accelerometer.effect import Effect, NotNegative

# body axes (0, 1, 2) that are input, pendulous and output axis of the accelerometers x, y and z
SENSOR_AXES = {"x": (0, 2, 1), "y": (1, 2, 0), "z": (2, 0, 1)}


class Coefficients(NamedTuple):
    """Of one accelerometer, in ug/g^2 (k3: ug/g^3) and urad."""

    k2: float
    k3: float
    kip: float
    kio: float
    delta_o: float
    delta_p: float


class Nonlinearity(Effect):
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
        i, p, o = force_g[..., 0], force_g[..., 1], force_g[..., 2]
        if not any(unit[1:]):  # the usual case, at a third of the cost
            return unit.k2 * i * i
        along = i * (i * (unit.k2 + unit.k3 * i) + unit.kip * p + unit.kio * o)
        return along + unit.delta_o * p - unit.delta_p * o
