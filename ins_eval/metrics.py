"""Velocity RMS, radial error rates of one flight, CEP rates of an ensemble, and how sure each of them is.

Pure functions on arrays of valid epochs; the caller leaves outage epochs out. A position error is north and east,
INS minus truth about the truth (so a constant error counts), in m; time runs from the start of navigation. Radii r
are in nmi, t in h, rates in nmi/h.

One flight has a *radial error rate*. A CEP, the radius that holds half of the flights, needs an ensemble;
`DEFINITIONS` holds every definition of a CEP rate in use here, because on the same data they differ by more than
the effect that is looked for: docs/metrics.md.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from math import log, sqrt
from typing import NamedTuple

import numpy as np

from ins_eval.errors import DataRefused
from ins_eval.units import HOUR, NMI

RATE_WINDOW_FROM_H = 0.5  # r/t says little while t is small
CONFIDENCE = 0.95
DRAWN_AT_ONCE = 20_000_000  # instruments of resamples: bounded memory for large ensembles

# ---------------------------------------------------------------------------------------------- one flight


class VelocityRms(NamedTuple):
    """Root mean square of a velocity error in m/s; `horizontal` is sqrt(north^2 + east^2)."""

    north: np.ndarray | float
    east: np.ndarray | float
    down: np.ndarray | float
    horizontal: np.ndarray | float


class RadialErrorRates(NamedTuple):
    """What a single flight has instead of a CEP rate, in nmi/h."""

    final: np.ndarray | float
    least_squares: np.ndarray | float
    rms: np.ndarray | float


def root_mean_square(values: np.ndarray) -> np.ndarray | float:
    """sqrt(mean x^2) along the last axis.

    Of the per-flight RMS of an ensemble (n,) this is the velocity RMS of the ensemble.
    """
    return np.sqrt(np.mean(np.square(values), axis=-1))


def velocity_rms(velocity_error: np.ndarray, valid: np.ndarray | None = None) -> VelocityRms:
    """Velocity RMS of a flight over its valid epochs.

    Parameters: `velocity_error` (..., m, 3) north, east, down in m/s; `valid` (m,) bool.

    Raises
    ------
    DataRefused
        No epoch is valid.
    """
    if valid is not None:
        velocity_error = velocity_error[..., valid, :]
    if velocity_error.shape[-2] == 0:
        raise DataRefused("velocity RMS: none of the epochs is valid; expected at least 1")
    north, east, down = root_mean_square(np.ascontiguousarray(np.moveaxis(velocity_error, -1, 0)))
    return VelocityRms(north, east, down, np.hypot(north, east))


def final_rate(radius_nmi: np.ndarray, time_h: np.ndarray) -> np.ndarray | float:
    """r(T) / T at the last epoch, in nmi/h. Parameters: (..., m) and (m,)."""
    return radius_nmi[..., -1] / time_h[-1]


def least_squares_rate(radius_nmi: np.ndarray, time_h: np.ndarray) -> np.ndarray | float:
    """Slope of the least-squares line through the origin, sum(r t) / sum(t^2), in nmi/h.

    Every epoch has the same weight. Parameters: (..., m) and (m,).
    """
    return np.sum(radius_nmi * time_h, axis=-1) / np.sum(time_h**2)


def radial_error_rate_rms(
    radius_nmi: np.ndarray, time_h: np.ndarray, from_h: float = RATE_WINDOW_FROM_H
) -> np.ndarray | float:
    """sqrt(mean (r/t)^2) over the epochs t >= `from_h` > 0, in nmi/h.

    A recording shorter than `from_h` has no such epoch: its final error over its duration stands instead.
    Parameters: (..., m) and (m,).
    """
    late = time_h >= from_h
    if not late.any():
        return final_rate(radius_nmi, time_h)
    return root_mean_square(radius_nmi[..., late] / time_h[late])


def radial_error_rates(position_error_m: np.ndarray, time_s: np.ndarray) -> RadialErrorRates:
    """The three radial error rates of a flight. Parameters: (..., m, 2) north, east in m; (m,) in s."""
    r, t = radius_nmi(position_error_m), time_s / HOUR
    return RadialErrorRates(final_rate(r, t), least_squares_rate(r, t), radial_error_rate_rms(r, t))


def radius_nmi(position_error_m: np.ndarray) -> np.ndarray:
    """r = sqrt(north^2 + east^2) in nmi of (..., 2) in m."""
    return np.hypot(position_error_m[..., 0], position_error_m[..., 1]) / NMI


# ---------------------------------------------------------------------------------------------- the ensemble


@dataclass(frozen=True)
class Definition:
    """One definition of the CEP rate of an ensemble.

    `per_flight` reduces position errors (..., m, 2) in m at `time_s` (m,) to what a flight contributes,
    (...) or (..., 2); `statistic` reduces the contributions of n flights, (..., n) or (..., n, 2), to a rate (...).
    """

    key: str
    words: str
    formula: str
    window: str
    source: str
    per_flight: Callable[[np.ndarray, np.ndarray], np.ndarray]
    statistic: Callable[[np.ndarray], np.ndarray]

    def rate(self, position_error_m: np.ndarray, time_s: np.ndarray) -> float:
        """CEP rate in nmi/h of n flights. Parameters: (n, m, 2) in m, (m,) in s."""
        return float(self.statistic(self.per_flight(position_error_m, time_s)))


def _final(position_error_m: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    return final_rate(radius_nmi(position_error_m[..., -1:, :]), time_s[-1:] / HOUR)


def _final_vector(position_error_m: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    return position_error_m[..., -1, :] / NMI / (time_s[-1] / HOUR)


def _least_squares(position_error_m: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    return least_squares_rate(radius_nmi(position_error_m), time_s / HOUR)


def _radial_error_rate(position_error_m: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    return radial_error_rate_rms(radius_nmi(position_error_m), time_s / HOUR)


def median(values: np.ndarray) -> np.ndarray:
    """Median along the last axis."""
    return np.median(values, axis=-1)


def rayleigh_median(values: np.ndarray) -> np.ndarray:
    """sqrt(ln 2) times the RMS: the median of a radius whose two components are equal, normal and centred."""
    return sqrt(log(2.0)) * root_mean_square(values)


def elliptical_median(vectors: np.ndarray) -> np.ndarray:
    """0.615 s_min + 0.562 s_max of (..., n, 2), s the RMS about zero along the principal axes.

    Within 1 % of the median radius of a centred normal distribution with s_min / s_max above 0.3.
    """
    north, east = vectors[..., 0], vectors[..., 1]
    nn, ee, ne = (np.mean(product, axis=-1) for product in (north**2, east**2, north * east))
    middle, half = (nn + ee) / 2.0, np.hypot((nn - ee) / 2.0, ne)
    return 0.615 * np.sqrt(np.maximum(middle - half, 0.0)) + 0.562 * np.sqrt(middle + half)


def circular_median(vectors: np.ndarray) -> np.ndarray:
    """0.5887 (s_north + s_east) of (..., n, 2), s the RMS about zero."""
    return 0.5887 * np.sum(np.sqrt(np.mean(vectors**2, axis=-2)), axis=-1)


_AT_END = "t = T, the last valid epoch"
_LATE = f"{RATE_WINDOW_FROM_H:g} h <= t <= T (a shorter flight: t = T), every valid epoch alike"

DEFINITIONS: dict[str, Definition] = {
    definition.key: definition
    for definition in (
        Definition(
            "final",
            "median over the flights of the final radial error over the flight time",
            "median_i r_i(T)/T",
            _AT_END,
            "radius of the circle that holds 50 % of the individual measurements (EU dual-use list, Annex I)",
            _final,
            median,
        ),
        Definition(
            "rms_08326",
            "0.8326 times the RMS over the flights of the final radial error over the flight time",
            "sqrt(ln 2) sqrt(mean_i (r_i(T)/T)^2)",
            _AT_END,
            "median of a Rayleigh distribution; needs equal, centred, normal north and east errors",
            _final,
            rayleigh_median,
        ),
        Definition(
            "elliptical",
            "elliptical approximation from the RMS about zero along the principal axes of the final errors",
            "(0.615 s_min + 0.562 s_max)/T",
            _AT_END,
            "linear approximation of the median radius of a centred normal ellipse",
            _final_vector,
            elliptical_median,
        ),
        Definition(
            "circular_05887",
            "0.5887 times the sum of the north and east RMS about zero of the final errors",
            "0.5887 (s_N + s_E)/T",
            _AT_END,
            "common engineering form; 1.1774 sigma where both are equal",
            _final_vector,
            circular_median,
        ),
        Definition(
            "least_squares",
            "median over the flights of the least-squares slope through the origin",
            "median_i sum_t(r_i t)/sum_t(t^2)",
            "0 < t <= T, every valid epoch alike",
            "after Grewal, Andrews and Bartone, who fit a line to CEP(t)",
            _least_squares,
            median,
        ),
        Definition(
            "radial_error_rate_rms",
            "median over the flights of the time RMS of radial error over time",
            "median_i sqrt(mean_t (r_i/t)^2)",
            _LATE,
            "radial-error-rate style of flight-test practice; conformity with no standard is claimed",
            _radial_error_rate,
            median,
        ),
        Definition(
            "trms",
            "RMS over flights and time of radial error over time: not a 50 % figure; where r/t is Rayleigh, "
            "50 % lie within 0.8326 and 95 % within 1.73 of it",
            "sqrt(mean_i mean_t (r_i/t)^2)",
            _LATE,
            "after Sun and Wang 2025, doi 10.3969/j.issn.1674-7135.2025.05.013 (95 % CEP = 1.73 TRMS)",
            _radial_error_rate,
            root_mean_square,
        ),
    )
}


# ---------------------------------------------------------------------------------------------- how sure


class Estimate(NamedTuple):
    """A value with the ends of its two-sided 95 % interval; floats, or arrays of one shape."""

    value: float | np.ndarray
    low: float | np.ndarray
    high: float | np.ndarray

    def as_tree(self) -> dict[str, float | list[float] | None]:
        """Of floats: ``{"value", "interval95"}``, as an estimate stands in every report; None: no interval."""
        return {"value": float(self.value), "interval95": [float(self.low), float(self.high)] if self.known else None}

    @property
    def known(self) -> bool:
        """Whether there is an interval."""
        return bool(np.isfinite([self.low, self.high]).all())


def central(values: np.ndarray) -> Estimate:
    """Median of single units (n,) and what holds the central 95 % of them; no interval of the median."""
    value, low, high = np.quantile(np.asarray(values, dtype=float), (0.5, 0.025, 0.975))
    return Estimate(value, low, high)


class Ratio(NamedTuple):
    """A ratio of two arms with its 95 % interval, and the standard deviation of its logarithm."""

    ratio: float
    low: float
    high: float
    log_sd: float

    def as_tree(self) -> dict[str, float | list[float]]:
        """``{"ratio", "interval95"}``, as a ratio stands in every report."""
        return {"ratio": self.ratio, "interval95": [self.low, self.high]}


class Comparison(NamedTuple):
    """`arms[arm][measure]` and `ratios["arm/other"][measure]`, all from the same resampled instruments."""

    arms: dict[str, dict[str, Estimate]]
    ratios: dict[str, dict[str, Ratio]]


def cep(position_error_m: np.ndarray, rng: np.random.Generator, n_resamples: int = 2000) -> Estimate:
    """CEP(t) = median_i r_i(t) in m, with its pointwise bootstrap band over the flights.

    Parameter: `position_error_m` (n, m, 2). Returns arrays (m,).
    """
    radius = np.sort(np.hypot(position_error_m[..., 0], position_error_m[..., 1]), axis=0)
    n, m = radius.shape
    # The median of resampled values is the value at the median of resampled ranks, so ranks are resampled, once.
    ranks = np.sort(rng.integers(0, n, (n_resamples, n)), axis=1)
    lower, upper = ranks[:, (n - 1) // 2], ranks[:, n // 2]
    band = np.empty((2, m))
    for start in range(0, m, 512):  # bounded memory for long flights
        block = radius[:, start : start + 512]
        band[:, start : start + 512] = _interval((block[lower] + block[upper]) / 2.0)
    return Estimate(np.median(radius, axis=0), band[0], band[1])


def paired_bootstrap(
    arms: Mapping[str, Mapping[str, np.ndarray]],
    statistics: Mapping[str, Callable[[np.ndarray], np.ndarray]],
    ratios: Iterable[tuple[str, str]],
    rng: np.random.Generator,
    n_resamples: int = 2000,
) -> Comparison:
    """Percentile bootstrap over instruments, with the same resampled instruments in every arm and measure.

    Parameters
    ----------
    arms
        ``arms[arm][measure]`` is (n,) or (n, k): what each of the n instruments contributes, in one order for all arms.
    statistics
        ``statistics[measure]`` reduces (..., n) or (..., n, k) to (...), such as `Definition.statistic`.
    ratios
        Pairs (arm, other): the ratio arm/other of each measure is formed inside every resample. Identical arms
        give exactly 1 with the interval [1, 1].

    Raises
    ------
    DataRefused
        A contribution is not finite, arms have different numbers of instruments, or a ratio has a zero in it.
    """
    n = _common_size(arms, statistics)
    values = {arm: {key: float(f(data[key])) for key, f in statistics.items()} for arm, data in arms.items()}
    resampled = {arm: {key: np.empty(n_resamples) for key in statistics} for arm in arms}
    at_once = max(1, DRAWN_AT_ONCE // n)
    for first in range(0, n_resamples, at_once):
        indices = rng.integers(0, n, (min(at_once, n_resamples - first), n))
        for arm, data in arms.items():
            for key, f in statistics.items():
                resampled[arm][key][first : first + at_once] = f(data[key][indices])
    return Comparison(
        {
            arm: {key: Estimate(values[arm][key], *map(float, _interval(resampled[arm][key]))) for key in statistics}
            for arm in arms
        },
        {
            f"{arm}/{other}": {
                key: _ratio(
                    f"{key} of {arm}/{other}",
                    (values[arm][key], resampled[arm][key]),
                    (values[other][key], resampled[other][key]),
                )
                for key in statistics
            }
            for arm, other in ratios
        },
    )


def _common_size(arms: Mapping[str, Mapping[str, np.ndarray]], statistics: Iterable[str]) -> int:
    sizes = {}
    for arm, data in arms.items():
        for key in statistics:
            lost = np.count_nonzero(~np.isfinite(data[key]).reshape(len(data[key]), -1).all(axis=1))
            if lost:
                raise DataRefused(
                    f"paired bootstrap: {key} of {arm} is not finite for {lost} of {len(data[key])} instruments; "
                    "expected a finite value of each"
                )
            sizes[f"{key} of {arm}"] = len(data[key])
    if len(set(sizes.values())) != 1 or min(sizes.values()) < 2:
        seen = ", ".join(f"{name}: {size}" for name, size in sizes.items())
        raise DataRefused(f"paired bootstrap: seen {seen or 'no arm'}; expected the same 2 or more instruments each")
    return next(iter(sizes.values()))


def _interval(resampled: np.ndarray) -> np.ndarray:
    """Percentile interval along the first axis: (2, ...)."""
    return np.quantile(resampled, [(1.0 - CONFIDENCE) / 2.0, (1.0 + CONFIDENCE) / 2.0], axis=0)


def _ratio(name: str, above: tuple[float, np.ndarray], below: tuple[float, np.ndarray]) -> Ratio:
    (value, resampled), (other, other_resampled) = above, below
    if np.array_equal(resampled, other_resampled) and value == other:
        return Ratio(1.0, 1.0, 1.0, 0.0)
    if min(value, other, resampled.min(), other_resampled.min()) <= 0.0:
        raise DataRefused(f"paired bootstrap: the ratio of {name} has a zero in it; expected errors above 0 in both")
    ratio = resampled / other_resampled
    low, high = map(float, _interval(ratio))
    return Ratio(value / other, low, high, float(np.std(np.log(ratio), ddof=1)))
