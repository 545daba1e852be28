"""Hysteresis of the permanent magnet: memory of the way the temperature came, whatever the speed.

A play (backlash) operator of half-width h follows the temperature T only when it is pushed,

p_k = max(T_k - h, min(T_k + h, p_k-1)),   p_0 = T_0,

so (p - T) / h is +1 on a long falling branch, -1 on a long rising one, and closes minor loops. The magnet is the
equally weighted sum of several such operators:

dK1 / gamma = A mean_i (p_i - T) / h_i

with the falling branch as the upper curve (Paper A, section 3.1 and Fig. 5). Two branches are 2 A apart.
Operators: F. Preisach's picture in the form of Prandtl and Ishlinskii. Assumed: three widths, equal weights;
A = 200 ppm reproduces the residual of Paper A's Table 4, which eq. (11) alone would not leave.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

import numba
import numpy as np
from pydantic import Field

from ins_eval.accelerometer.effect import LogSigma, NotNegative, Positive, SharedCourse
from ins_eval.accelerometer.run import ThermalRun


@numba.njit(cache=True)
def play(temperature_c, half_width_c):
    """State of a play operator of half-width `half_width_c` driven by `temperature_c` (n,); starts in the middle."""
    state = np.empty(temperature_c.size)
    state[0] = temperature_c[0]
    for k in range(1, temperature_c.size):
        pulled = min(temperature_c[k] + half_width_c, state[k - 1])
        state[k] = max(temperature_c[k] - half_width_c, pulled)
    return state


class MagnetHysteresis(SharedCourse):
    """Rate-independent loop of the scale factor; the amplitude is drawn for each accelerometer."""

    name: ClassVar[str] = "magnet_hysteresis"
    quantity = "scale_ppm"
    half_opening_ppm: NotNegative  # median A of the population
    half_opening_sigma: LogSigma  # standard deviation of ln A
    half_widths_c: Annotated[tuple[Positive, ...], Field(min_length=1)]

    def draw(self, rng: np.random.Generator, drawn: Mapping[str, Any]) -> float:
        """A in ppm."""
        return self.half_opening_ppm * np.exp(self.half_opening_sigma * rng.standard_normal())

    def sizes(self, unit: np.ndarray | float, run: ThermalRun, normal: np.ndarray | float) -> np.ndarray:
        return np.asarray(unit)[..., None]

    def courses(self, run: ThermalRun) -> np.ndarray:
        return self._branch(run)[:, None]

    def _branch(self, run: ThermalRun) -> np.ndarray:
        """Where the magnet stands between the rising (-1) and the falling (+1) branch, (n,)."""

        def compute(run: ThermalRun) -> np.ndarray:
            surface = run.whole.temperature_c
            return run.cut(np.mean([(play(surface, h) - surface) / h for h in self.half_widths_c], axis=0))

        return run.state((self.name, self.half_widths_c), compute)
