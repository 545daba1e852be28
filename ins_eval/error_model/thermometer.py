"""What the readings of a thermometer leave open of a compensated output.

Compensation takes the temperature that the readings tell (`ins_eval.effects.reading`). By how much that is off is known
as a covariance C, and through the slopes of the believed compensation it is an error of each accelerometer. The few
modes of it that stand out, which are slow, are uncertain columns, common to the axes that share a thermometer. The rest
is noise of the density that it has at low frequencies, slope^2 sum_j C(t, t_j) h.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.linalg import solveh_banded

from ins_eval.compensation import Samples
from ins_eval.effects.reading import thermometers
from ins_eval.error_model.columns import Column, Drive, SlowFactor
from ins_eval.error_model.null import Believed, triad
from ins_eval.navigation import samples
from ins_eval.recording.belief import UNSTATED_DENSITY_UG
from ins_eval.thermal import filtered_rate
from ins_eval.units import UG

if TYPE_CHECKING:
    from ins_eval.compensation import CompensationModel
    from ins_eval.error_model.propagation import ErrorModel

WARMER_C = 0.05  # of a difference quotient of what is believed: laws are straight over so little; by reasoning
MODES, ITERATIONS = 8, 12  # most of a thermometer, and of subspace iteration for them
LEAST_SIGMA, STANDS_OUT = 1.0, 2.0  # of a mode against the white noise, and against the last one found; by reasoning


class LeftOpen(NamedTuple):
    """`columns` that carry one sigma each, and the density (epochs, 3) in (m/s^2)^2 s of the rest."""

    columns: list[Column]
    density: np.ndarray


def left_open(believed: Believed, model: ErrorModel, slow: SlowFactor) -> LeftOpen:
    """What the temperatures that were told leave open of each accelerometer."""
    recording, out = believed.recording, LeftOpen([], np.zeros((model.middle_s.size, 3)))
    if recording.imu.temperature_c is None or recording.imu.accelerometer_form != "pulse":
        return out
    known = thermometers(recording)
    axes = [range(3)] if len(known) == 1 else [[k] for k in range(3)]
    seen, compensations = list(samples(recording)), triad(believed)
    accelerometer = recording.belief.accelerometer
    white = UG * (accelerometer.velocity_random_walk_ug_per_sqrt_hz or UNSTATED_DENSITY_UG)
    for number, (told, of) in enumerate(zip(known, axes, strict=True), start=1):
        if told.information is None:
            continue
        slopes = [_slopes(compensations[axis], seen[axis], told.at_s) for axis in of]
        bin_s = np.gradient(told.at_s)
        modes = _modes(told.information, bin_s * sum(np.square(slope / white) for slope, _ in slopes))
        for k, mode in enumerate(modes, start=1):
            name = f"mode {k} of the readings of thermometer {number}"
            rate = filtered_rate(told.at_s, mode, accelerometer.rate_filter_s)
            terms = []
            for axis, (slope, slope_rate) in zip(of, slopes, strict=True):
                error = partial(np.interp, xp=told.at_s, fp=slope * mode + slope_rate * rate)
                terms.append(Drive("accelerometer", axis, "1", 1.0, slow.add(f"{name} {axis}", error, model)))
            out.columns.append(Column(name, tuple(terms)))
        lasting = solveh_banded(told.information, bin_s) - sum(mode * (mode @ bin_s) for mode in modes)
        for axis, (slope, _) in zip(of, slopes, strict=True):
            density = slope**2 * np.maximum(lasting, 0.0)
            out.density[:, axis] = np.interp(model.middle_s, told.at_s, density)
    return out


def _slopes(compensation: CompensationModel, given: Samples, at_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives of the compensated output by temperature and by its rate, each (count,)."""
    rows = np.clip(np.searchsorted(given.time_s, at_s), 0, given.time_s.size - 1)
    few = Samples(*(getattr(given, name)[rows] for name in ("time_s", "output", "temperature_c", "rate_c_per_min")))
    base = compensation.specific_force(few)
    warmer = Samples(few.time_s, few.output, few.temperature_c + WARMER_C, few.rate_c_per_min)
    faster = Samples(few.time_s, few.output, few.temperature_c, few.rate_c_per_min + WARMER_C)
    slope = (compensation.specific_force(warmer) - base) / WARMER_C
    return slope, (compensation.specific_force(faster) - base) / WARMER_C


def _modes(information: np.ndarray, weight: np.ndarray) -> list[np.ndarray]:
    """The main modes (count,) in degC of a covariance whose inverse has the bands `information`, measured in `weight`.

    By subspace iteration of W^1/2 C W^1/2, W the squares of what 1 degC makes against the noise.
    """
    root = np.sqrt(weight)
    turns = np.arange(min(MODES, root.size))[None, :] * (np.arange(root.size)[:, None] + 0.5) * np.pi / root.size
    basis = np.cos(turns)
    for _ in range(ITERATIONS):
        basis, _ = np.linalg.qr(root[:, None] * solveh_banded(information, root[:, None] * basis))
    spread = solveh_banded(information, root[:, None] * basis)
    size, turn = np.linalg.eigh(basis.T @ (root[:, None] * spread))
    sigma = np.sqrt(np.maximum(size, np.finfo(float).tiny))  # none where nothing believed depends on temperature
    modes = spread @ turn / sigma
    least = max(LEAST_SIGMA, STANDS_OUT * sigma.min())
    return [modes[:, k] for k in np.argsort(sigma)[::-1] if sigma[k] > least]
