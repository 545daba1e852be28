"""The temperature behind the readings of a thermometer that has steps and noise.

A reading r says that T plus noise lies within half a step q of r. With logistic noise of scale s and standard deviation
sigma = pi s / sqrt(3), and L the logistic function,

    p(r | T) = L((r + q/2 - T) / s) - L((r - q/2 - T) / s),

and temperatures are smooth: their second differences over intervals h are normal with variance S h^3 (an integrated
random walk). The logarithm is concave (Boyd and Vandenberghe, Convex Optimization, 2004, 3.5), so Newton's method finds
the most probable course; S and sigma are those of the highest evidence (Laplace). Mean and covariance of the course are
those of expectation propagation (Minka, Expectation Propagation for Approximate Bayesian Inference, 2001).

A filter of fixed length follows each step that lasts longer than it: through 70 ug/degC a step of 0.06 degC that lasts
ten minutes is then an error of 2 ug that no white noise describes.
"""

from __future__ import annotations

import weakref
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numba
import numpy as np
from scipy.linalg import cholesky_banded, solveh_banded
from scipy.special import expit

from ins_eval.thermal import thermometer_step

if TYPE_CHECKING:
    from ins_eval.recording import Recording

# by reasoning; coverage of what is told was measured for steps of 0.01 to 0.125 degC and noise of 0.003 to 0.03 degC
BIN_S = 10.0  # within which a temperature is told as one; a longer one where readings come more seldom
READING_S, ROUNDING_S = 1.0, 1e-6  # readings closer together are often one that is held
FEWEST_BINS = 4
ROUGH, SMOOTHEST = 1e-8, 1e-16  # S in degC^2/s^3 with which the search begins, some degrees a minute; the smallest
ROUGHER, NOISIER, FINER = 10.0, 2.0, (1.0, 0.25)  # factors between S, and between sigma; the powers tried
SHARPEST = 0.02  # smallest sigma, in steps of the thermometer
NEWTON_STEPS, ENOUGH = 25, 1e-3  # nats that a step must gain
SWEEPS, DAMPING, CONVERGED = 40, 0.5, 1e-3  # of expectation propagation; in steps of the thermometer
QUADRATURE, TAIL = 48, 12.0  # points over the distribution of a bin, whose tails are this many scales long
FAR = 6.0  # sigmas from what the other bins say


@dataclass(frozen=True, eq=False)
class Told:
    """The mean temperature (count,) in degC at `at_s` (count,) that readings tell, and how well they do.

    `information` (3, count) are the upper bands of the inverse covariance in 1/degC^2; None: as read.
    """

    at_s: np.ndarray
    mean_c: np.ndarray
    information: np.ndarray | None = None

    def at(self, time_s: np.ndarray) -> np.ndarray:
        """Temperature in degC at `time_s`."""
        return np.interp(time_s, self.at_s, self.mean_c)


def told(time_s: np.ndarray, reading_c: np.ndarray) -> Told:
    """The temperature that readings (n,) in degC at `time_s` (n,) tell; as read where they are too few or equal."""
    step_c = thermometer_step(reading_c)
    bin_s = max(BIN_S, float(np.median(np.diff(time_s)))) if time_s.size > 1 else BIN_S
    taken = np.unique(np.searchsorted(time_s, np.arange(time_s[0], time_s[-1], READING_S) - ROUNDING_S))
    bins = ((time_s[taken] - time_s[0] + ROUNDING_S) // bin_s).astype(int)
    often = np.bincount(bins)
    count = often.size - int(often[-1] < np.median(often))  # of whole bins: the middle of a part is not the next one
    if step_c == 0.0:
        return Told(time_s[[0, -1]], reading_c[[0, -1]])
    if count < FEWEST_BINS:
        return Told(time_s.copy(), reading_c.copy())  # what is kept while the readings live must not hold them
    taken, bins = taken[bins < count], bins[bins < count]
    of_bin, weight = np.unique(np.column_stack([bins, reading_c[taken]]), axis=0, return_counts=True)
    readings = _Readings(of_bin[:, 0].astype(int), of_bin[:, 1], weight.astype(float), step_c, count, bin_s)
    full, times = np.unique(bins, return_counts=True)
    middle_s = np.interp(np.arange(count), full, np.bincount(bins, time_s[taken])[full] / times)
    mean, information = _mean(readings, _most_probable(readings, np.interp(middle_s, time_s, reading_c)))
    for end, beside in ((0, 1), (-1, -2)):  # straight on
        rate = (mean[end] - mean[beside]) / (middle_s[end] - middle_s[beside])
        mean[end] += rate * (time_s[end] - middle_s[end])
        middle_s[end] = time_s[end]
    return Told(middle_s, mean, information)


_KNOWN: dict[tuple[int, int], tuple[np.ndarray, list[Told]]] = {}  # while the readings live


def thermometers(recording: Recording) -> list[Told]:
    """What each thermometer of a recording tells, one common or three; told once for all beliefs in its sensors."""
    time_s, reading = recording.imu.time_s, recording.imu.temperature_c
    key = id(time_s), id(reading)
    if key not in _KNOWN:
        columns = reading.T if reading.ndim == 2 else reading[None, :]
        _KNOWN[key] = time_s, [told(time_s, np.ascontiguousarray(column)) for column in columns]
        weakref.finalize(reading, _KNOWN.pop, key, None)
    return _KNOWN[key][1]


@dataclass(frozen=True, eq=False)
class _Readings:
    """Distinct readings (m,) of each bin `at`, in order, and how often each; a bin lasts `bin_s`."""

    at: np.ndarray
    reading_c: np.ndarray
    weight: np.ndarray
    step_c: float
    count: int
    bin_s: float

    def in_bins(self, of_reading: np.ndarray) -> np.ndarray:
        return np.bincount(self.at, self.weight * of_reading, self.count)

    def smooth(self, rough: float) -> np.ndarray:
        """Information (3, count) of the second differences: D' D / (S h^3) as upper bands."""
        bands, weights = np.zeros((3, self.count)), (1.0, -2.0, 1.0)
        for i in range(3):
            for j in range(i, 3):
                bands[2 - (j - i), j : self.count - 2 + j] += weights[i] * weights[j]
        return bands / (rough * self.bin_s**3)


class _Course(NamedTuple):
    """The most probable course (count,) in degC, the curvature (count,) of its bins in 1/degC^2, and its evidence."""

    course_c: np.ndarray
    curvature: np.ndarray
    rough: float
    sigma_c: float
    evidence: float


def _most_probable(readings: _Readings, begin_c: np.ndarray) -> _Course:
    """The course at the S and the sigma of the highest evidence, found by steps in one after the other."""
    scatter = np.std(np.diff(readings.reading_c)) if readings.reading_c.size > 1 else 0.0
    best = _course(readings, begin_c, ROUGH, 0.5 * np.clip(scatter, readings.step_c, 4.0 * readings.step_c))
    for finer in FINER:
        moved = True
        while moved:
            moved = False
            for rougher, noisier in ((-finer, 0.0), (finer, 0.0), (0.0, -finer), (0.0, finer)):
                while (rough := best.rough * ROUGHER**rougher) >= SMOOTHEST:
                    if (sigma_c := best.sigma_c * NOISIER**noisier) < SHARPEST * readings.step_c:
                        break
                    try:
                        other = _course(readings, best.course_c, rough, sigma_c)
                    except np.linalg.LinAlgError:  # a line to the last digit: smoother than double precision tells
                        break
                    if other.evidence <= best.evidence + ENOUGH:
                        break
                    best, moved = other, True
    return best


def _course(readings: _Readings, course: np.ndarray, rough: float, sigma_c: float) -> _Course:
    """The most probable course from a first guess on, for one S and one sigma."""
    scale, stiff = sigma_c * np.sqrt(3.0) / np.pi, 1.0 / (rough * readings.bin_s**3)
    half = 0.5 * readings.step_c / scale
    wide = np.log(-np.expm1(-2.0 * half))
    smooth = readings.smooth(rough)

    def probability(of: np.ndarray) -> float:
        off = (readings.reading_c - of[readings.at]) / scale
        likely = wide - np.logaddexp(0.0, off - half) - np.logaddexp(0.0, -off - half)
        return float(readings.weight @ likely - 0.5 * stiff * np.sum(np.diff(of, 2) ** 2))

    found = probability(course)
    for _ in range(NEWTON_STEPS):
        off = (readings.reading_c - course[readings.at]) / scale
        low, high = expit(off - half), expit(off + half)
        curvature = readings.in_bins(low * (1.0 - low) + high * (1.0 - high)) / scale**2
        slope = readings.in_bins(low + high - 1.0) / scale - _times(smooth, course)
        step = solveh_banded(_beside(smooth, curvature), slope)
        part, better = 1.0, probability(course + step)
        while better < found and part > 1e-3:
            part /= 2.0
            better = probability(course + part * step)
        if better <= found:
            break
        course, gain, found = course + part * step, better - found, better
        if gain < ENOUGH:
            break
    # between the edges of a step the curvature is nought, yet the step bounds the temperature
    bound = np.where(readings.in_bins(np.ones(readings.at.size)) > 0.0, 1.0, 0.0)
    bound /= readings.step_c**2 / 12.0 + sigma_c**2
    volume = np.sum(np.log(cholesky_banded(_beside(smooth, np.maximum(curvature, bound)))[2]))
    return _Course(
        course, curvature, rough, sigma_c, found - float(volume) - 0.5 * (readings.count - 2) * np.log(rough)
    )


def _mean(readings: _Readings, begin: _Course) -> tuple[np.ndarray, np.ndarray]:
    """Mean (count,) and information (3, count) by expectation propagation, from the most probable course on.

    The most probable course leans on the edges of steps, and its curvature there knows nothing of the way inside. What
    the readings of a bin say becomes a normal distribution that leaves the mean and the variance of this bin right.
    """
    smooth = readings.smooth(begin.rough)
    scale = begin.sigma_c * np.sqrt(3.0) / np.pi
    half = 0.5 * readings.step_c / scale
    seen, first = np.unique(readings.at, return_index=True)
    low = np.minimum.reduceat(readings.reading_c, first) - (half + TAIL) * scale
    high = np.maximum.reduceat(readings.reading_c, first) + (half + TAIL) * scale
    row = np.searchsorted(seen, readings.at)
    parts = (np.arange(QUADRATURE) + 0.5) / QUADRATURE
    precision = begin.curvature.copy()
    pull = precision * begin.course_c + _times(smooth, begin.course_c)
    for _ in range(SWEEPS):
        information = _beside(smooth, precision)
        mean, variance = solveh_banded(information, pull)[seen], _variances(cholesky_banded(information))[seen]
        of_others = np.maximum(1.0 / variance - precision[seen], 1e-3 / variance)
        others_c, far = (mean / variance - pull[seen]) / of_others, FAR / np.sqrt(of_others)
        begin_c, end_c = np.maximum(low, others_c - far), np.minimum(high, others_c + far)
        beyond = begin_c >= end_c  # what the others say lies outside of the step
        begin_c = np.where(beyond, np.minimum(low, others_c), begin_c)
        end_c = np.where(beyond, np.maximum(high, others_c), end_c)
        point = begin_c[:, None] + (end_c - begin_c)[:, None] * parts
        off = (readings.reading_c[:, None] - point[row]) / scale
        likely = -readings.weight[:, None] * (np.logaddexp(0.0, off - half) + np.logaddexp(0.0, -off - half))
        likely = np.add.reduceat(likely, first) - 0.5 * of_others[:, None] * (point - others_c[:, None]) ** 2
        share = np.exp(likely - likely.max(axis=1, keepdims=True))
        share /= share.sum(axis=1, keepdims=True)
        centre = (share * point).sum(axis=1)
        spread = np.maximum((share * (point - centre[:, None]) ** 2).sum(axis=1), 1e-12)
        own = np.maximum(1.0 / spread - of_others, 1e-6 * of_others)
        precision[seen] += DAMPING * (own - precision[seen])
        pull[seen] += DAMPING * (centre * (own + of_others) - others_c * of_others - pull[seen])
        if np.abs(centre - mean).max() < CONVERGED * readings.step_c:
            break
    information = _beside(smooth, precision)
    return solveh_banded(information, pull), information


def _beside(smooth: np.ndarray, precision: np.ndarray) -> np.ndarray:
    """Upper bands of the information of the second differences and of the bins, definite where no bin says much."""
    out = smooth.copy()
    out[2] += precision + 1e-9
    return out


def _times(bands: np.ndarray, x: np.ndarray) -> np.ndarray:
    """The product (count,) of the symmetric matrix with the upper bands (3, count) and x (count,)."""
    out = bands[2] * x
    for k in (1, 2):
        out[:-k] += bands[2 - k, k:] * x[k:]
        out[k:] += bands[2 - k, k:] * x[:-k]
    return out


@numba.njit(cache=True)
def _variances(factor: np.ndarray) -> np.ndarray:
    """Diagonal (n,) of the inverse of U' U with the upper bands `factor` (3, n) of U, by Takahashi's recursion."""
    n = factor.shape[1]
    inverse = np.zeros((3, n))  # entries (i, i), (i, i + 1), (i, i + 2)
    for i in range(n - 1, -1, -1):
        last = min(i + 2, n - 1)
        for j in range(last, i - 1, -1):
            total = 1.0 / factor[2, i] if i == j else 0.0
            for k in range(i + 1, last + 1):
                total -= factor[2 - (k - i), k] * inverse[abs(k - j), min(k, j)]
            inverse[j - i, i] = total / factor[2, i]
    return inverse[0]
