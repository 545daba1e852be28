"""Thermal lag: pendulum, coil and adhesive follow the surface, where the thermometer sits, late.

tau Te' = T - Te,   Te(0) = T(0)

Assumed: tau of 3 min; neither the paper nor a data sheet gives one.
"""

from __future__ import annotations

from typing import ClassVar

from ins_eval.accelerometer.effect import AccelerometerEffect, NotNegative
from ins_eval.accelerometer.run import ThermalRun


class ThermalLag(AccelerometerEffect):
    """First-order lag of the inner elements behind the surface."""

    name: ClassVar[str] = "thermal_lag"
    lag_s: NotNegative

    def inside(self, run: ThermalRun) -> ThermalRun:
        return run.with_element_lag(self.lag_s)
