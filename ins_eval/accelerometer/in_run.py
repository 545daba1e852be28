"""In-run bias instability: a first-order Gauss-Markov process, stationary from switch-on.

b' = -b / tau + w,   std(b) = sigma

Source: assumed 25 ug and 30 min; Paper A, Table 5 allows 50 ug.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from ins_eval.accelerometer.effect import AccelerometerEffect, Contribution, NotNegative, Positive
from ins_eval.accelerometer.run import ThermalRun
from ins_eval.random_processes import gauss_markov, gauss_markov_of
from ins_eval.streams import Streams


class InRun(AccelerometerEffect):
    """Gauss-Markov bias, a new history at each run."""

    name: ClassVar[str] = "in_run"
    sigma_ug: NotNegative
    correlation_s: Positive

    def contribution(self, unit: Any, run: ThermalRun, streams: Streams) -> Contribution:
        return Contribution(bias_ug=gauss_markov(run.time_s, self.sigma_ug, self.correlation_s, streams.rng()))

    def wander_ug(self, normal: np.ndarray, run: ThermalRun) -> np.ndarray:
        """The same of m units, (n, m), made of standard normal numbers (n, m)."""
        return gauss_markov_of(normal, run.time_s, self.sigma_ug, self.correlation_s)
