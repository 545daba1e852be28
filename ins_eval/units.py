"""The only place where a conversion factor is written: multiply to reach SI, divide to leave it.

Values are exact by definition, so ``3.0 * DEG_PER_H`` is three degrees an hour in rad/s.
"""

from math import pi, sqrt

import numpy as np

DEG = pi / 180.0  # rad
ARCSEC = DEG / 3600.0  # rad
MINUTE = 60.0  # s
HOUR = 3600.0  # s
DAY = 86400.0  # s
DEG_PER_H = DEG / HOUR  # rad/s
DEG_PER_SQRT_H = DEG / sqrt(HOUR)  # rad/sqrt(s), angle random walk
NMI = 1852.0  # m, international nautical mile
STANDARD_GRAVITY = 9.80665  # m/s^2, the g of accelerometer data sheets
UG = 1e-6 * STANDARD_GRAVITY  # m/s^2
PPM = 1e-6
SPEED_UNITS = {  # m/s
    "m/s": 1.0,
    "km/h": 1000.0 / HOUR,
    "knots": NMI / HOUR,
    "mph": 1609.344 / HOUR,
    "ft/s": 0.3048,
    "cm/s": 1e-2,
    "mm/s": 1e-3,
}

_READABLE_DIGITS = 12  # of a degree


def to_degrees_exactly(rad: np.ndarray | float) -> np.ndarray:
    """Degrees d whose product d * DEG is `rad` to the last bit, wherever a double has that property.

    The quotient is the nearest double to the true one, so if any double has that property it has. Where one of few
    decimals has it too, that one is given: 34.65 rather than 34.650000000000006. Every tenth value that did not
    come from degrees has none; it gets the d with the nearest product. NaN stays NaN.
    """
    rad = np.asarray(rad, dtype=float)
    quotient = rad / DEG
    readable = np.round(quotient, _READABLE_DIGITS)
    return np.where(readable * DEG == rad, readable, quotient)


def through_degrees(rad: np.ndarray | float) -> np.ndarray:
    """The nearest value to `rad` that a number of degrees can hold: at most one double away, 1e-9 m on the ground."""
    return np.asarray(rad, dtype=float) / DEG * DEG
