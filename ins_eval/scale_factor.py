"""Eq. (11): the scale factor of a quartz flexible accelerometer as a polynomial in temperature and its rate.

Both sides need it, the sensor that is simulated and the calibration that is fitted, so it stands below both.
Source: Paper A (Sensors 2021, 21, 294), eqs (11) and (15)-(17).
"""

from __future__ import annotations

import numpy as np

TERMS = ("alpha", "beta", "eta", "epsilon", "mu", "gamma")


def scale_factor_terms(difference_c: np.ndarray, rate_c_per_min: np.ndarray) -> np.ndarray:
    """The six regressors of eq. (11), in the order of `TERMS`.

    K1 = alpha r^2 + beta dT^2 + eta r dT + epsilon r + mu dT + gamma

    Parameters: `difference_c` (n,) dT = T - T0 in degC, `rate_c_per_min` (n,) r in degC/min; either may be a
    scalar. Returns (n, 6): columns r^2, dT^2, r dT, r, dT, 1.
    """
    difference, rate = np.broadcast_arrays(np.atleast_1d(difference_c), np.atleast_1d(rate_c_per_min))
    difference, rate = difference.astype(float), rate.astype(float)
    return np.column_stack((rate**2, difference**2, rate * difference, rate, difference, np.ones_like(rate)))


def scale_factor(coefficients: np.ndarray, difference_c: np.ndarray, rate_c_per_min: np.ndarray) -> np.ndarray:
    """K1 of eq. (11), (n,), in the unit of the `coefficients` (6,), which stand in the order of `TERMS`."""
    return scale_factor_terms(difference_c, rate_c_per_min) @ np.asarray(coefficients, dtype=float)
