"""System-level refinement: what an oven run shows that the chamber did not."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ins_eval.calibration.branches import BranchCurve, branches
from ins_eval.compensation import CompensationModel, Samples, evaluated
from ins_eval.errors import UsageError
from ins_eval.recording import ChamberReadings

BIN_S = 10.0  # the residual is averaged over this time: temperature moves by less than 0.1 degC in it
KNOT_SPACING_C = 5.0
# In bins: a branch that hardly any reading touches stays by the other. A run passes 5 degC in about a hundred
# bins, so the width of a supported loop shrinks by about 1 %.
RIDGE_BINS = 1.0

OvenRun = tuple[Samples, float | np.ndarray]  # samples, and the specific force (scalar or (n,) m/s^2) truly felt


class Refined:
    """Any model, less the residual that it leaves in an oven with the temperatures of the flight.

    a = a_model - d(T, r),   d: a `BranchCurve` through (a_model - a_known) of one or more oven runs

    Only a bias is refined: in the oven the unit stands still, so a scale factor cannot be separated from it. With
    `constant` False each run keeps a constant of its own, its turn-on bias, and d has zero mean over the runs.
    Until `refine` is called it gives what the wrapped model gives.
    Source: Paper A, section 3.1, "the temperature compensated output ... was collected to refine".
    """

    def __init__(self, model: CompensationModel, constant: bool = True):
        self.model = model
        self.constant = constant
        self.name = f"{model.name}_refined"
        self.residual_: BranchCurve | None = None  # m/s^2

    def fit(self, chamber: ChamberReadings) -> Refined:
        """Fit the wrapped model to the chamber and forget an earlier refinement."""
        self.model.fit(chamber)
        self.residual_ = None
        return self

    def refine(self, runs: Sequence[OvenRun]) -> Refined:
        """Draw the residual through oven runs, each a pair (samples, known specific force in m/s^2)."""
        if not runs:
            raise UsageError(f"{self.name}: refine was given no oven run; give one or more (samples, known force)")
        binned = [_binned(samples, self.model.specific_force(samples) - known) for samples, known in runs]
        temperature, rate, residual = (np.concatenate(column) for column in zip(*binned, strict=True))
        run = np.repeat(np.arange(len(binned)), [columns[0].size for columns in binned])
        low, high = np.floor(temperature.min() / KNOT_SPACING_C), np.ceil(temperature.max() / KNOT_SPACING_C)
        knots = KNOT_SPACING_C * np.arange(low, high + 1)
        self.residual_ = branches(temperature, rate, residual, knots, RIDGE_BINS, None if self.constant else run)
        return self

    def specific_force(self, samples: Samples) -> np.ndarray:
        """Specific force along the input axis, (n,) m/s^2."""
        force = self.model.specific_force(samples)
        if self.residual_ is None:
            return force
        return force - evaluated(self.residual_, samples)


def _binned(samples: Samples, residual: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Temperature, rate and residual, averaged over bins of time; bins without samples are left out."""
    bin_of = np.floor((samples.time_s - samples.time_s[0]) / BIN_S).astype(np.int64)
    count = np.bincount(bin_of)
    filled = count > 0

    def mean(column: np.ndarray) -> np.ndarray:
        return np.bincount(bin_of, weights=column)[filled] / count[filled]

    of_units = np.array([mean(unit) for unit in residual.T]).T if residual.ndim == 2 else mean(residual)
    return mean(samples.temperature_c), mean(samples.rate_c_per_min), of_units
