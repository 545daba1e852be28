"""Means and regressions of errors that are correlated in time, with intervals that respect it.

A mean of n correlated values is worth n / tau independent ones, tau = 1 + 2 sum_k rho_k the integrated
autocorrelation time in epochs, summed over Geyer's initial positive sequence. A regression is whitened by an
autocorrelation of first order and its covariance is that of Newey and West for what remains.

Sources: Geyer, Statistical Science 7 (1992) 473; Andrews and Monahan, Econometrica 60 (1992) 953.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import stdtrit

from ins_eval.metrics import CONFIDENCE, Estimate

FEWEST_INDEPENDENT = 2.0  # values that an interval needs
LARGEST_CORRELATION = 0.998  # of neighbours: beyond it a constant and the noise are one
REPEATS = 4  # of finding the correlation and fitting again


class Series(NamedTuple):
    """One series of a regression: `design` (n, p) and `values` (n,) at `time_s` (n,), which may have gaps."""

    time_s: np.ndarray
    design: np.ndarray
    values: np.ndarray


class Fit(NamedTuple):
    """Coefficients (p,), their covariance (p, p), and the quantile that makes a two-sided 95 % interval."""

    coefficients: np.ndarray
    covariance: np.ndarray
    quantile: float

    def estimate(self, index: int, unit: float = 1.0) -> Estimate:
        """One coefficient with its interval, in units of `unit`."""
        value, half = self.coefficients[index], self.quantile * np.sqrt(self.covariance[index, index])
        return Estimate(float(value / unit), float((value - half) / unit), float((value + half) / unit))


def autocorrelation_time(values: np.ndarray) -> float:
    """Integrated autocorrelation time of a series (n,) in epochs, 1 or more; allows for the mean that is taken off."""
    n = values.size
    x = values - values.mean()
    if n < 4 or not x.any():
        return 1.0
    power = np.abs(np.fft.rfft(x, 2 * n)) ** 2
    rho = np.fft.irfft(power)[:n]
    rho = rho / rho[0]
    tau = 1.0
    for _ in range(3):
        raised = rho + (tau / n) * (1.0 - rho)  # a mean of n values takes about tau / n off every correlation
        pairs = raised[: n // 2 * 2].reshape(-1, 2).sum(axis=1)
        end = int(np.argmax(pairs <= 0.0)) if (pairs <= 0.0).any() else pairs.size
        tau = max(1.0, 2.0 * float(np.minimum.accumulate(pairs[:end]).sum()) - 1.0)
    return min(tau, float(n))


def mean(values: np.ndarray) -> Estimate:
    """Mean of a correlated series (n,); an interval of NaN where it holds too few independent values."""
    value, n = float(np.mean(values)), values.size
    tau = autocorrelation_time(values)
    independent = n / tau
    if independent < FEWEST_INDEPENDENT:
        return Estimate(value, np.nan, np.nan)
    variance = float(np.var(values)) * n / (n - tau) if n > tau else np.nan
    half = stdtrit(independent - 1.0, (1.0 + CONFIDENCE) / 2.0) * np.sqrt(variance / independent)
    return Estimate(value, value - half, value + half)


def root_mean_square(squares: np.ndarray) -> Estimate:
    """Root of the mean of correlated squares (n,); the interval is that of the logarithm of the mean."""
    of_squares = mean(squares)
    if of_squares.value <= 0.0:
        return Estimate(0.0, 0.0, 0.0)
    relative = (of_squares.high - of_squares.value) / of_squares.value
    value = float(np.sqrt(of_squares.value))
    return Estimate(value, value * np.exp(-0.5 * relative), value * np.exp(0.5 * relative))


def regress(several: Sequence[Series]) -> Fit | None:
    """Least squares over several series with common coefficients; each has its own noise, correlated in time.

    None where the columns cannot be separated, or the rows are too few for them.
    """
    parameters = several[0].design.shape[1]
    if sum(one.values.size for one in several) < 2 * parameters + 2:
        return None
    correlations = [0.0] * len(several)
    for _ in range(REPEATS):
        whitened = [_whitened(one, rho) for one, rho in zip(several, correlations, strict=True)]
        found = _weighted(whitened)
        if found is None:
            return None
        coefficients, design, values = found
        correlations = [_neighbour_correlation(one, coefficients) for one in several]
    bread = np.linalg.pinv(sum(a.T @ a for a in design))
    meat = sum(_newey_west(a * (y - a @ coefficients)[:, None]) for a, y in zip(design, values, strict=True))
    independent = sum(
        one.values.size * (1.0 - rho) / (1.0 + rho) for one, rho in zip(several, correlations, strict=True)
    )
    freedom = max(1.0, independent - parameters)
    n = sum(one.values.size for one in several)
    covariance = bread @ meat @ bread * n / (n - parameters)
    return Fit(coefficients, covariance, float(stdtrit(freedom, (1.0 + CONFIDENCE) / 2.0)))


def _whitened(one: Series, rho: float) -> tuple[np.ndarray, np.ndarray]:
    """Each row less what is expected of it after the row before: x_k - rho^(dt/step) x_k-1, in its own sigma."""
    steps = np.diff(one.time_s)
    kept = rho ** (steps / np.median(steps))
    scale = np.sqrt(1.0 - kept**2)[:, None]
    both = np.column_stack([one.design, one.values])
    rows = np.vstack([both[:1], (both[1:] - kept[:, None] * both[:-1]) / scale]) if rho else both
    return rows[:, :-1], rows[:, -1]


def _weighted(whitened) -> tuple[np.ndarray, list[np.ndarray], list[np.ndarray]] | None:
    """Coefficients, and designs and values in the sigma of each series."""
    sigmas = [1.0] * len(whitened)
    coefficients = None
    for _ in range(2):
        design = [a / s for (a, _), s in zip(whitened, sigmas, strict=True)]
        values = [y / s for (_, y), s in zip(whitened, sigmas, strict=True)]
        stacked = np.vstack(design)
        scale = np.linalg.norm(stacked, axis=0)
        if not (scale > 0.0).all():
            return None
        coefficients, _, rank, _ = np.linalg.lstsq(stacked / scale, np.concatenate(values), rcond=1e-9)
        if rank < scale.size:
            return None
        coefficients = coefficients / scale
        residuals = [y - a @ coefficients for a, y in whitened]
        sigmas = [float(np.std(r)) or 1.0 for r in residuals]
    return coefficients, design, values


def _neighbour_correlation(one: Series, coefficients: np.ndarray) -> float:
    """Correlation of neighbouring residuals, raised by what the fit took from it, 0 or more."""
    residual = one.values - one.design @ coefficients
    total = float(residual @ residual)
    if total == 0.0:
        return 0.0
    rho = float(residual[1:] @ residual[:-1]) / total
    parameters = one.design.shape[1]
    return float(np.clip(rho + (parameters + 3.0 * rho) / residual.size, 0.0, LARGEST_CORRELATION))


def _newey_west(scores: np.ndarray) -> np.ndarray:
    """Sum of the covariances of scores (n, p) and their neighbours, with Bartlett's weights."""
    n = len(scores)
    lags = int(4.0 * (n / 100.0) ** (2.0 / 9.0))
    total = scores.T @ scores
    for lag in range(1, min(lags, n - 1) + 1):
        cross = scores[lag:].T @ scores[:-lag]
        total = total + (1.0 - lag / (lags + 1.0)) * (cross + cross.T)
    return total
