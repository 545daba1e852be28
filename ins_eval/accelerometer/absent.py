"""The absent effect: its constants are drawn as ever, so that no other draw moves, and it does nothing."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ins_eval.accelerometer.effect import AccelerometerEffect


class Absent(AccelerometerEffect):
    """Stands for an effect that is switched off."""

    of: AccelerometerEffect

    @property
    def name(self) -> str:  # type: ignore[override]
        """The name of the effect that is switched off."""
        return self.of.name

    def for_axes(
        self, rng: np.random.Generator
    ) -> tuple[AccelerometerEffect, AccelerometerEffect, AccelerometerEffect]:
        x, y, z = self.of.for_axes(rng)
        return Absent(of=x), Absent(of=y), Absent(of=z)

    def draw(self, rng: np.random.Generator, drawn: Mapping[str, Any]) -> Any:
        return self.of.draw(rng, drawn)
