"""Scale-factor repeatability: a constant that is new at each switch-on.

Source: Paper A, Table 5 (30 ppm in a month).
"""

from __future__ import annotations

from typing import Any, ClassVar

from ins_eval.accelerometer.effect import AccelerometerEffect, Contribution, NotNegative
from ins_eval.accelerometer.run import ThermalRun
from ins_eval.streams import Streams


class ScaleRepeatability(AccelerometerEffect):
    """Normal, redrawn at each run."""

    name: ClassVar[str] = "scale_repeatability"
    sigma_ppm: NotNegative

    def contribution(self, unit: Any, run: ThermalRun, streams: Streams) -> Contribution:
        return Contribution(scale_ppm=self.sigma_ppm * streams.rng().standard_normal())
