"""One accelerometer: its loop, and how its parts follow temperature and age."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ins_eval.digital_loop.model import Loop


@dataclass(frozen=True)
class Unit:
    """A loop with the temperature coefficient (ppm/degC) and ageing (ppm/year) of each of its parts."""

    loop: Loop
    temperature_ppm_per_c: Mapping[str, float]
    ageing_ppm_per_year: Mapping[str, float]

    def at(self, temperature_c: float, years: float = 0.0) -> Loop:
        """The loop at a temperature, after years of ageing; at the bench's temperature and new it is the nominal one.

        value = nominal (1 + coefficient (T - T_bench)) (1 + ageing years)
        """
        above_c = temperature_c - self.loop.parameters.bench.temperature.value
        loop = self.loop
        for part, ppm_per_c in self.temperature_ppm_per_c.items():
            loop = loop.with_drift(part, ppm_per_c * above_c)
        for part, ppm_per_year in self.ageing_ppm_per_year.items():
            loop = loop.with_drift(part, ppm_per_year * years)
        return loop
