"""Scale-factor repeatability: a constant that is new at each switch-on.

Source: Paper A, Table 5 (30 ppm in a month).
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from ins_eval.accelerometer.effect import NotNegative, SharedCourse
from ins_eval.accelerometer.run import ThermalRun


class ScaleRepeatability(SharedCourse):
    """Normal, redrawn at each run."""

    name: ClassVar[str] = "scale_repeatability"
    quantity = "scale_ppm"
    redrawn = True
    sigma_ppm: NotNegative

    def courses(self, run: ThermalRun) -> np.ndarray:
        return np.ones((1, 1))

    def sizes(self, unit: Any, run: ThermalRun, normal: np.ndarray | float) -> np.ndarray:
        return np.asarray(self.sigma_ppm * normal)[..., None]
