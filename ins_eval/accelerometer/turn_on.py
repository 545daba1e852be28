"""Turn-on bias: a constant that is new at each switch-on.

Source: Paper A, Table 5 (bias repeatability 50 ug in a month) for oven and flight. The positions of one chamber
test follow each other within days; their 20 ug are assumed.
"""

from __future__ import annotations

from typing import Any, ClassVar

from ins_eval.accelerometer.effect import AccelerometerEffect, Contribution, NotNegative
from ins_eval.accelerometer.run import ThermalRun
from ins_eval.streams import Streams


class TurnOn(AccelerometerEffect):
    """Normal, redrawn at each run."""

    name: ClassVar[str] = "turn_on"
    sigma_ug: NotNegative  # oven and flight
    chamber_sigma_ug: NotNegative  # from run to run in the chamber

    def contribution(self, unit: Any, run: ThermalRun, streams: Streams) -> Contribution:
        sigma = self.chamber_sigma_ug if run.kind == "chamber" else self.sigma_ug
        return Contribution(bias_ug=sigma * streams.rng().standard_normal())
