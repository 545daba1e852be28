"""A model that is worse than another by as much as a third is better: the negative control of a gate."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ins_eval.compensation import CompensationModel, Samples
from ins_eval.compensation.refined import OvenRun
from ins_eval.recording import ChamberReadings


class Mirrored:
    """2 a - b: `b` reflected in `a`.

    Whatever `b` changes of `a`'s output is changed the other way. If `b` removes part of `a`'s error, this adds
    as much, so a gate that `b` passes against `a` must fail here.
    """

    def __init__(self, a: CompensationModel, b: CompensationModel):
        self.a, self.b = a, b
        self.name = f"2 {a.name} - {b.name}"

    def fit(self, chamber: ChamberReadings) -> Mirrored:
        """Fit both models."""
        self.a.fit(chamber)
        self.b.fit(chamber)
        return self

    def refine(self, runs: Sequence[OvenRun]) -> Mirrored:
        """Refine whichever of the two models takes a refinement."""
        for model in (self.a, self.b):
            if hasattr(model, "refine"):
                model.refine(runs)
        return self

    def specific_force(self, samples: Samples) -> np.ndarray:
        """Specific force along the input axis, (n,) m/s^2."""
        return 2.0 * self.a.specific_force(samples) - self.b.specific_force(samples)
