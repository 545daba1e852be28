"""What a physical effect is: parameters of a population, and where they act on the way from force to pulses.

    surface temperature -> `inside` -> `contribution` (slow errors of bias and scale factor)
    specific force -> `force_error_ug` -> `noise_ug` -> pulses -> `counted`

An effect overrides the one or two places where it acts; everywhere else it does nothing. To add one, write a
file like ``turn_on.py`` and name its class in ``model.EFFECTS``.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field

from ins_eval.accelerometer.run import ThermalRun
from ins_eval.limits import SMALLEST_DIVISOR
from ins_eval.streams import Streams
from ins_eval.tables import Strict

Positive = Annotated[float, Field(ge=SMALLEST_DIVISOR)]
NotNegative = Annotated[float, Field(ge=0.0)]
LogSigma = Annotated[float, Field(ge=0.0, le=5.0)]  # standard deviation of a logarithm: e^5 either way


class Contribution(NamedTuple):
    """What one effect adds over a run: bias in ug and scale factor in ppm of gamma, each (n,) or a constant."""

    bias_ug: np.ndarray | float = 0.0
    scale_ppm: np.ndarray | float = 0.0


class AccelerometerEffect(Strict):
    """An effect that does nothing; its fields are the parameters of a population, units in their names.

    `unit` is what `draw` returned for one accelerometer: its constants for life.
    """

    name: ClassVar[str]

    def for_axes(
        self, rng: np.random.Generator
    ) -> tuple[AccelerometerEffect, AccelerometerEffect, AccelerometerEffect]:
        """This effect for the axes x, y, z of one instrument, where they differ by more than chance."""
        return self, self, self

    def draw(self, rng: np.random.Generator, drawn: Mapping[str, Any]) -> Any:
        """Constants of one accelerometer; `drawn` holds those of the effects that stand earlier in the population."""
        return None

    def inside(self, run: ThermalRun) -> ThermalRun:
        """The run with the temperature of the inner elements."""
        return run

    def contribution(self, unit: Any, run: ThermalRun, streams: Streams) -> Contribution:
        """Slow errors over a run; `streams` is the node of this effect in it, for what is redrawn at each run."""
        return Contribution()

    def force_error_ug(self, unit: Any, force_g: np.ndarray) -> np.ndarray | float:
        """Error in ug that depends on the specific force `force_g` (..., 3) along input, pendulous and output axis."""
        return 0.0

    def noise_ug(self, interval_s: np.ndarray, rng: np.random.Generator) -> np.ndarray | float:
        """Noise in ug, the mean over each interval (n,)."""
        return 0.0

    def counted(self, pulses: np.ndarray) -> np.ndarray:
        """What leaves as counts of the `pulses` (n,) that were due in each interval."""
        return pulses


class SharedCourse(AccelerometerEffect):
    """A slow error whose course over a run is the same for all units: each has its own size of it.

    error(t) = sum_k course_k(t) size_k

    `quantity` says of what, and `redrawn` whether a size needs a number that is drawn at each run.
    """

    quantity: ClassVar[Literal["bias_ug", "scale_ppm"]]
    redrawn: ClassVar[bool] = False

    def courses(self, run: ThermalRun) -> np.ndarray:
        """What all units share over a run, (n, k); (1, k) of a constant."""
        raise NotImplementedError

    def sizes(self, unit: Any, run: ThermalRun, normal: np.ndarray | float) -> np.ndarray:
        """By how much a unit has each course, (..., k), of the `unit` (..., c) and a standard normal number (...)."""
        raise NotImplementedError

    def contribution(self, unit: Any, run: ThermalRun, streams: Streams) -> Contribution:
        normal = streams.rng().standard_normal() if self.redrawn else 0.0
        error = self.courses(run) @ self.sizes(unit, run, normal)
        return Contribution(**{self.quantity: error if error.size > 1 else float(error[0])})
