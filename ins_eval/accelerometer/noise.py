"""White noise of the output.

The mean over an interval of length t has the standard deviation N / sqrt(t), N being the velocity random walk.
Source: assumed 2 ug/sqrt(Hz).
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from ins_eval.accelerometer.effect import AccelerometerEffect, NotNegative


class Noise(AccelerometerEffect):
    """White noise; independent from interval to interval."""

    name: ClassVar[str] = "noise"
    density_ug_per_sqrt_hz: NotNegative

    def noise_ug(self, interval_s: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        return self.of(rng.standard_normal(np.size(interval_s)), interval_s)

    def of(self, normal: np.ndarray | float, interval_s: np.ndarray | float) -> np.ndarray:
        """The noise in ug that standard normal numbers stand for, each the mean over an interval."""
        return self.density_ug_per_sqrt_hz / np.sqrt(interval_s) * normal
