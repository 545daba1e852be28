"""Overlapping Allan deviation of a signal at rest, and the noise coefficients that make it.

    s2(tau) = 3 Q^2 / tau^2 + N^2 / tau + (2 ln 2 / pi) B^2 + K^2 tau / 3

N is white noise (random walk of the integral), B flicker (bias instability), K random walk of the signal and Q
quantisation of the integral. Source: IEEE Std 952-1997, annex C; the overlapping estimate: NIST SP 1065, section 5.2.2.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc, gammainc, gammaincc, ndtr

TERMS = ("quantisation", "white", "flicker", "random_walk")  # Q, N, B, K
CONFIDENCE = 0.95
LONGEST_SHARE = 0.25  # of the longest stretch: the longest averaging time
FITTED_SHARE = 0.125  # longer times have too few independent differences for a covariance of their own
ROUNDS = 6  # of weights by the fit itself
FREQUENCIES = 10_000
LARGEST_FACTOR = 1e4  # of a coefficient squared, where nothing bounds it from above
LEAST_SKEWNESS = 1.6e-5  # below it a distribution counts as normal
LEAST_SAMPLES = 32
MISFIT_CHANCE = 1e-3
MOST_LEFT_OUT = 7  # octaves at the short end, up to 64 samples: slower filters are no noise of a sample
# Further octaves where some are: what they lack is too little to be seen as a misfit, and biases. Calibrated on white
# noise behind a trapezoid and a first-order filter: 42 of 48 intervals of 95 % hold it, 1 of 48 without a margin.
MARGIN = 2


@dataclass(frozen=True, eq=False)
class AllanDeviation:
    """Deviation at averaging times tau_s (t,), in the unit of the signal; `counts` are the differences behind each."""

    interval_s: float
    tau_s: np.ndarray
    deviation: np.ndarray
    counts: np.ndarray
    duration_s: float  # of all stretches together


@dataclass(frozen=True)
class Coefficient:
    """A noise coefficient with its 95 % interval in SI; where it is not `visible` the interval begins at 0."""

    value: float
    low: float
    high: float
    visible: bool


@dataclass(frozen=True, eq=False)
class NoiseFit:
    """The coefficients of an Allan deviation; of a signal in u: Q in u s, N in u sqrt(s), B in u, K in u/sqrt(s)."""

    quantisation: Coefficient
    white: Coefficient
    flicker: Coefficient
    random_walk: Coefficient

    def deviation(self, tau_s: np.ndarray, term: str | None = None) -> np.ndarray:
        """That of the fit, or of one term of it, (t,)."""
        squared = np.array([getattr(self, one).value * (term in (None, one)) for one in TERMS]) ** 2
        return np.sqrt(_model(np.asarray(tau_s, dtype=float)) @ squared)


def allan_deviation(stretches: Sequence[np.ndarray], interval_s: float, per_octave: int = 1) -> AllanDeviation:
    """Overlapping Allan deviation of all stretches together.

    s2(m dt) = sum (x[k+2m] - 2 x[k+m] + x[k])^2 / (2 (m dt)^2 count),   x the integral of the signal

    Parameters
    ----------
    stretches : the signal in each stretch, (n,) samples that are means over `interval_s`
    per_octave : averaging times in each doubling
    """
    longest = max((len(one) for one in stretches), default=0)
    if longest < LEAST_SAMPLES:
        empty = np.empty(0)
        return AllanDeviation(interval_s, empty, empty, empty, interval_s * sum(map(len, stretches)))
    most = int(LONGEST_SHARE * longest)
    sizes = np.unique(np.round(2.0 ** np.arange(0.0, np.log2(most) + 1e-9, 1.0 / per_octave)).astype(int))
    sums, counts = np.zeros(sizes.size), np.zeros(sizes.size)
    for one in stretches:
        x = np.concatenate([[0.0], np.cumsum(np.asarray(one, dtype=float) - np.mean(one))]) * interval_s
        for k, m in enumerate(sizes[2 * sizes <= len(one)]):
            second = x[2 * m :] - 2.0 * x[m:-m] + x[: -2 * m]
            sums[k] += second @ second
            counts[k] += second.size
    tau_s = sizes * interval_s
    deviation = np.sqrt(sums / (2.0 * tau_s**2 * counts))
    return AllanDeviation(interval_s, tau_s, deviation, counts, interval_s * sum(map(len, stretches)))


def fit_noise(seen: AllanDeviation) -> NoiseFit | None:
    """Fit the four coefficients to an Allan deviation; None where they are not determined.

    Generalised least squares in the variance, with no coefficient below 0. The covariance of the estimates at two
    averaging times is that of the fitted spectrum S,

        cov(s2_i, s2_j) = (2 / count) integral |H_i|^2 |H_j|^2 S^2 df,   |H_m|^2 = 2 sin^4(pi m f) / (m sin(pi f))^2

    with f in cycles a sample. A filter within a sensor, or a trapezoid between two rates, makes neighbouring samples
    alike: white noise then lies low at times of a few samples (a trapezoid: by 1 - 3/(4m) in variance). Where the four
    terms do not make what was seen but do make it without the shortest times, these and `MARGIN` octaves more are left
    out. Where they do not make that either, every interval is widened by the misfit.

    Not determined is what has too few times or no noise, and what is so little made of these terms (pulses of a slow
    rate, say) that the weights of a fit never become those of its own spectrum: a coefficient then lies outside the
    interval that its own variances give it.
    """
    octaves = _octaves(seen)
    if octaves.size <= len(TERMS) or not (seen.deviation[octaves] > 0.0).all():
        return None
    fewer = min(MOST_LEFT_OUT, octaves.size - len(TERMS) - 1)
    fitted = whole = _fitted(seen, octaves)
    left_out = 0
    while fitted[1] > 1.0 and left_out < fewer:
        left_out += 1
        fitted = _fitted(seen, octaves[left_out:])
    short = octaves[:left_out]
    if fitted[1] > 1.0 or (seen.deviation[short] ** 2 > _model(seen.tau_s[short]) @ fitted[0]).any():
        fitted = whole  # what lies above the terms, a spike or a vibration, no filter has made
    elif left_out:
        fitted = _fitted(seen, octaves[min(left_out + MARGIN, fewer) :])
    theta, excess, squared, covariance, spectra = fitted
    design = _model(spectra.tau_s)
    found = []
    for k in range(len(TERMS)):
        used = [j for j in range(len(TERMS)) if theta[j] > 0.0 or j == k]  # unbiased beside what is seen
        weighted = np.linalg.solve(covariance, design[:, used])
        weights = np.linalg.solve(design[:, used].T @ weighted, weighted.T)[used.index(k)]
        found.append(_coefficient(k, theta, weights, squared, (spectra, excess)))
    settled = all(one.low <= one.value <= one.high for one in found)
    return NoiseFit(*found) if settled else None


def _fitted(seen: AllanDeviation, octaves: np.ndarray) -> tuple[np.ndarray, float, np.ndarray, np.ndarray, _Spectra]:
    """Coefficients squared (4,), misfit, variances seen (t,), their covariance and spectra at the rows `octaves`."""
    from scipy.optimize import nnls  # imported here, for it takes long and few need it

    tau_s, squared, counts = seen.tau_s[octaves], seen.deviation[octaves] ** 2, seen.counts[octaves]
    design = _model(tau_s)
    spectra = _Spectra(seen.interval_s, np.rint(tau_s / seen.interval_s), counts)
    covariance = np.diag(squared**2 * tau_s / (counts * seen.interval_s))
    for _ in range(ROUNDS):
        half = np.linalg.inv(np.linalg.cholesky(covariance))
        scaled = half @ design
        size = np.linalg.norm(scaled, axis=0)
        theta = nnls(scaled / size, half @ squared)[0] / size
        covariance = spectra.covariance(theta)
    excess = _excess(squared - design @ theta, covariance, int(np.count_nonzero(theta)))
    return theta, excess, squared, covariance, spectra


def _excess(residual: np.ndarray, covariance: np.ndarray, terms: int) -> float:
    """By how much the fit misses in variance, above what chance allows; 1 where the model holds."""
    freedom = residual.size - terms
    squares = float(residual @ np.linalg.solve(covariance, residual))
    return squares / freedom if chdtrc(freedom, squares) < MISFIT_CHANCE else 1.0


def _octaves(seen: AllanDeviation) -> np.ndarray:
    """Rows of the averaging times that double, as far as the fit goes."""
    sizes = np.rint(seen.tau_s / seen.interval_s).astype(int)
    longest = seen.tau_s[-1] * FITTED_SHARE / LONGEST_SHARE if sizes.size else 0.0
    return np.flatnonzero((sizes & (sizes - 1) == 0) & (seen.tau_s <= longest * (1.0 + 1e-9)))


def _model(tau_s: np.ndarray) -> np.ndarray:
    """Variance of each term with coefficient 1, (t, 4)."""
    one = np.ones_like(tau_s)
    return np.column_stack([3.0 / tau_s**2, 1.0 / tau_s, 2.0 * np.log(2.0) / np.pi * one, tau_s / 3.0])


class _Spectra:
    """Filters of the Allan variance and spectra of the terms at frequencies (q,) in cycles a sample."""

    def __init__(self, interval_s: float, sizes: np.ndarray, counts: np.ndarray):
        self.tau_s = sizes * interval_s
        f = np.geomspace(1e-3 / sizes[-1], 0.5, FREQUENCIES)
        self._width = 2.0 * np.gradient(f)  # both signs of frequency
        sine = np.sin(np.pi * f)
        self._filters = 2.0 * np.sin(np.pi * np.outer(sizes, f)) ** 4 / (sizes[:, None] * sine) ** 2
        rate = f / interval_s
        self._terms = (
            np.stack([(2.0 * sine / interval_s) ** 2 * interval_s, np.ones_like(f), 1.0 / (2.0 * np.pi * rate),
                      1.0 / (2.0 * np.pi * rate) ** 2]) / interval_s
        )  # fmt: skip
        self._counts = counts[:, None]

    def covariance(self, theta: np.ndarray) -> np.ndarray:
        """Of the estimates of the variance at all averaging times, (t, t)."""
        weighted = self._filters * (theta @ self._terms) * np.sqrt(2.0 * self._width / self._counts)
        return weighted @ weighted.T

    def cumulants(self, theta: np.ndarray, weights: np.ndarray) -> tuple[float, float]:
        """Second and third of a weighted sum of these estimates."""
        spectrum = theta @ self._terms
        second = 2.0 * np.sum(((weights @ (self._filters / self._counts**0.5)) * spectrum) ** 2 * self._width)
        third = 8.0 * np.sum(((weights @ (self._filters / self._counts ** (2 / 3))) * spectrum) ** 3 * self._width)
        return float(second), float(third)


def _coefficient(
    k: int, theta: np.ndarray, weights: np.ndarray, squared: np.ndarray, spread: tuple[_Spectra, float]
) -> Coefficient:
    """The coefficient of term k: its interval holds every value that would make what was seen not too unlikely.

    The weighted sum of the variances that estimates the coefficient squared is a quadratic form in Gaussian noise; its
    distribution is taken to be that of Pearson's type III with the same first three cumulants.
    """
    seen = float(weights @ squared)
    spectra, excess = spread

    def chance(true: float) -> float:
        """That the estimate comes out as low as it was seen, or lower."""
        at = theta.copy()
        at[k] = true
        second, third = spectra.cumulants(at, weights)
        second, third = excess * second, excess**1.5 * third
        if second == 0.0:
            return float(seen > true)
        return _chance_below((seen - true) / np.sqrt(second), third / second**1.5)

    tail = 0.5 * (1.0 - CONFIDENCE)
    least = float(np.sqrt(excess * spectra.cumulants(theta, weights)[0]))
    visible = chance(0.0) > 1.0 - tail
    low = _crossing(chance, 1.0 - tail, (0.0, seen)) if visible else 0.0
    high = max(seen, 0.0) + least
    while chance(high) > tail and high < LARGEST_FACTOR * least:
        high *= 2.0
    if high > max(seen, 0.0) + least:
        high = _crossing(chance, tail, (0.5 * high, high))
    value, low, high = (float(np.sqrt(v)) for v in (theta[k], low, max(high, theta[k])))
    return Coefficient(value, low, high, visible)


def _chance_below(at: float, skewness: float) -> float:
    """Pearson's type III distribution function, of mean 0 and variance 1: a shifted gamma distribution."""
    if abs(skewness) < LEAST_SKEWNESS:
        return float(ndtr(at))
    beta = 2.0 / skewness
    shape = beta * beta
    past_end = max(beta * (at + shape / beta), 0.0)
    return float((gammainc if skewness > 0.0 else gammaincc)(shape, past_end))


def _crossing(chance: Callable[[float], float], level: float, between: tuple[float, float]) -> float:
    """Where a falling chance crosses a level; the farther end where it does not."""
    from scipy.optimize import brentq

    low, high = between
    if (chance(low) - level) * (chance(high) - level) >= 0.0:
        return high
    return brentq(lambda true: chance(true) - level, low, high, xtol=1e-4 * high)
