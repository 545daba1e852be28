"""Turn-on bias: a constant that is new at each switch-on.

Source: Paper A, Table 5 (bias repeatability 50 ug in a month) for oven and flight. The positions of one chamber
test follow each other within days; their 20 ug are assumed.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from ins_eval.accelerometer.effect import NotNegative, SharedCourse
from ins_eval.accelerometer.run import ThermalRun


class TurnOn(SharedCourse):
    """Normal, redrawn at each run."""

    name: ClassVar[str] = "turn_on"
    quantity = "bias_ug"
    redrawn = True
    sigma_ug: NotNegative  # oven and flight
    chamber_sigma_ug: NotNegative  # from run to run in the chamber

    def courses(self, run: ThermalRun) -> np.ndarray:
        return np.ones((1, 1))

    def sizes(self, unit: Any, run: ThermalRun, normal: np.ndarray | float) -> np.ndarray:
        sigma = self.chamber_sigma_ug if run.kind == "chamber" else self.sigma_ug
        return np.asarray(sigma * normal)[..., None]
