"""Gains of a digital closed loop that are no longer those of the calibration: a constant scale-factor error in flight.

The loop integrates, so its output follows the feedback alone, k_t k_VI k_DA N = k0 a. A drift of k_VI k_DA by f and of
the torquer by t multiplies K1 by 1 / ((1 + f) (1 + t)); a drift of the forward gain does nothing. What remains after a
self-calibration is worked out in `ensemble.ageing` from a loop of parts; here an accelerometer is given the result.

Chamber and oven come before the ageing, so only a flight feels it.
Source: Paper B (IEEE Access 2019), eqs (9)-(13) and (24)-(30).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from ins_eval.accelerometer.effect import SharedCourse
from ins_eval.accelerometer.run import ThermalRun


class LoopGain(SharedCourse):
    """Each accelerometer has one of the scale-factor changes of a population of loops; unless stated there is none."""

    name: ClassVar[str] = "loop_gain"
    quantity = "scale_ppm"
    scale_ppm: Annotated[tuple[float, ...], Field(min_length=1)] = (0.0,)

    def draw(self, rng: np.random.Generator, drawn: Mapping[str, Any]) -> float:
        """The change in ppm; from two lists of the same length it is that of the same loop."""
        return self.scale_ppm[rng.integers(len(self.scale_ppm))]

    def courses(self, run: ThermalRun) -> np.ndarray:
        return np.ones((1, 1))

    def sizes(self, unit: np.ndarray | float, run: ThermalRun, normal: np.ndarray | float) -> np.ndarray:
        return np.asarray(unit * (run.kind == "flight"))[..., None]
