"""Temperature sensitivity of a scale factor, as Paper A's Table 4 has it.

change = (X - Y) / A * 1e6 ppm,   sensitivity = (X - Y) / (A T) * 1e6 ppm/degC

X, Y: largest and smallest scale factor; A: their mean level; T: span of temperature. The paper does not say of what
single values X and Y are. Here they are means over a whole degree of one branch (falling, rising), all ramps
together: a mean of some twenty readings, so that noise does not decide the extremes. A degree that fewer than half as
many readings reach as are usual is left out. Of a compensated scale factor, measured K1 / model K1 is taken.
Source: Paper A (Sensors 2021, 21, 294), section 3.1, the text above Table 4.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

ENOUGH = 0.5  # of the median number of readings in a degree


class DegreeMeans(NamedTuple):
    """Means per whole degree of each branch, (m,) each."""

    temperature_c: np.ndarray
    falling: np.ndarray  # bool
    values: np.ndarray


def change_ppm(values: np.ndarray) -> float:
    """Largest less smallest of the values, in ppm of their mean."""
    return float(1e6 * np.ptp(values) / np.mean(values))


def degree_means(temperature_c: np.ndarray, rate_c_per_min: np.ndarray, values: np.ndarray) -> DegreeMeans:
    """Means over readings that round to the same degree on the same branch; parameters (n,) each."""
    degree = np.round(temperature_c).astype(np.int64)
    key, place, count = np.unique(2 * degree + (rate_c_per_min > 0.0), return_inverse=True, return_counts=True)
    kept = count >= ENOUGH * np.median(count)
    means = (np.bincount(place, weights=column)[kept] / count[kept] for column in (temperature_c, values))
    temperature, mean = means
    return DegreeMeans(temperature, key[kept] % 2 == 0, mean)


def sensitivity_ppm_per_c(temperature_c: np.ndarray, rate_c_per_min: np.ndarray, values: np.ndarray) -> float:
    """Change of the `degree_means` in ppm by the span of their temperatures in degC; parameters (n,) each."""
    means = degree_means(temperature_c, rate_c_per_min, values)
    span = np.ptp(means.temperature_c)
    return change_ppm(means.values) / float(span) if span > 0.0 else float("nan")
