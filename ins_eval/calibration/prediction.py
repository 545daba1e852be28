"""How wrong a compensated reading will be in a run that is still to come.

A curve is drawn through all runs; a new run is another draw of everything that differs between runs (shift, creep,
wander). So what counts are the runs, not the readings. For each position (+1, 0, -1 g):

    error of a reading = middle(T, r) + deviation of the run(T, r) + scatter within the run

The middle, what the model leaves in the mean of the runs, is a `BranchCurve`. The mean square B of a run's deviation
from it near each knot has one degree of freedom less than there are runs; the mean square W of the readings within
their run has many. A new run differs from the mean of n runs by B (1 + 1/n) + W, and the interval is Student's t of
Satterthwaite's degrees of freedom times its root. +1 g and -1 g share B and W.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass

import numpy as np

from ins_eval.calibration.branches import KNOTS_C, BranchCurve, branches, hats, supported
from ins_eval.calibration.four_point import RATE_FILTER_S, runs_of, settled
from ins_eval.errors import DataRefused
from ins_eval.recording import ChamberReadings
from ins_eval.thermal import filtered_rate

POSITIONS = (1, 0, -1)


@dataclass(frozen=True, eq=False)
class RunErrors:
    """What a model leaves in one run: compensated minus true specific force in ug, (n,) each."""

    position: int  # nearest whole g
    ramp_c_per_min: float
    temperature_c: np.ndarray
    rate_c_per_min: np.ndarray
    error_ug: np.ndarray


@dataclass(frozen=True, eq=False)
class Prediction:
    """95 % interval of the error (compensated minus true) of one reading in a new run, by position in g."""

    middle_ug: dict[int, BranchCurve]
    half_width_ug: dict[int, BranchCurve]

    def interval95_ug(
        self, position: int, temperature_c: np.ndarray, rate_c_per_min: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper end in ug, (n,) each, at readings (n,) in degC and rates (n,) in degC/min."""
        middle = self.middle_ug[position].evaluate(temperature_c, rate_c_per_min)
        half_width = self.half_width_ug[position].evaluate(temperature_c, rate_c_per_min)
        return middle - half_width, middle + half_width


def errors_of_runs(chamber: ChamberReadings, scale, bias_ug, rate_filter_s: float = RATE_FILTER_S) -> list[RunErrors]:
    """Errors of every run after compensation by eq. (5) with the curves `scale` and `bias_ug`."""
    found = []
    for run in runs_of(chamber):
        keep = settled(run.elapsed_s, rate_filter_s)
        temperature = run.temperature_c[keep]
        rate = filtered_rate(run.elapsed_s, run.temperature_c, rate_filter_s)[keep]
        felt = 1e6 * (run.output[keep] / scale.evaluate(temperature, rate) - run.input_g)
        error_ug = felt - bias_ug.evaluate(temperature, rate)
        found.append(RunErrors(run.position, run.ramp_c_per_min, temperature, rate, error_ug))
    return found


def predict(runs: list[RunErrors]) -> Prediction:
    """What the errors of past runs say of a new one in any of their positions.

    Raises: DataRefused where a position has only one run.
    """
    from scipy import stats  # imported here, for it takes long and every model's child imports this module

    by_position: dict[int, list[RunErrors]] = defaultdict(list)
    for run in runs:
        by_position[run.position].append(run)
    for position in POSITIONS:
        if len(by_position[position]) < 2:
            raise DataRefused(
                f"calibration: {len(by_position[position])} run(s) at {position:+d} g show nothing of how runs "
                "differ, so no interval of a new run can be given; calibrate at two or more rates"
            )
    lowest, highest = (end([end(run.temperature_c) for run in runs]) for end in (np.min, np.max))
    knots = supported(KNOTS_C, lowest, highest)
    middle = {position: _middle(by_position[position]) for position in POSITIONS}
    half_width: dict[int, np.ndarray] = {}
    for group in ((1, -1), (0,)):
        parts = [_mean_squares(by_position[position], middle[position], knots) for position in group]
        between, within = np.mean(parts, axis=0)
        count = np.mean([len(by_position[position]) for position in group])
        freedom = sum(len(by_position[position]) - 1 for position in group)
        shared = between * (1.0 + 1.0 / count)
        total = shared + within
        freedom = freedom * (total / np.maximum(shared, 1e-12 * total + 1e-300)) ** 2
        ends = np.split(stats.t.ppf(0.975, np.minimum(freedom, 1e9)) * np.sqrt(total), 2)
        half_width |= {position: BranchCurve(knots, *ends) for position in group}
    return Prediction(middle, half_width)


def _middle(runs: list[RunErrors]) -> BranchCurve:
    columns = ("temperature_c", "rate_c_per_min", "error_ug")
    return branches(*(np.concatenate([getattr(run, column) for run in runs]) for column in columns))


def _mean_squares(runs: list[RunErrors], middle: BranchCurve, knots_c: np.ndarray) -> np.ndarray:
    """B and W near each knot of the falling and the rising branch, (2, 2m); a branch unseen has that of the other."""
    count, sums = 0.0, np.zeros((2, 2 * knots_c.size))
    for run in runs:
        share = hats(knots_c, run.temperature_c, run.rate_c_per_min)
        weight = share.sum(axis=0)
        deviation = run.error_ug - middle.evaluate(run.temperature_c, run.rate_c_per_min)
        mean = share.T @ deviation / np.maximum(weight, 1e-300)
        square = share.T @ deviation**2 / np.maximum(weight, 1e-300)
        sums += weight * (mean**2, np.maximum(square - mean**2, 0.0))
        count = count + weight
    squares = sums / np.maximum(count, 1e-300)
    other = np.roll(squares, knots_c.size, axis=1)
    squares = np.where(count > 1.0, squares, other)
    squares[0] *= len(runs) / (len(runs) - 1.0)
    return squares
