"""The only place where a conversion factor is written: multiply to reach SI, divide to leave it.

Values are exact by definition, so ``3.0 * DEG_PER_H`` is three degrees an hour in rad/s.
"""

from math import pi, sqrt

DEG = pi / 180.0  # rad
ARCSEC = DEG / 3600.0  # rad
MINUTE = 60.0  # s
HOUR = 3600.0  # s
DEG_PER_H = DEG / HOUR  # rad/s
DEG_PER_SQRT_H = DEG / sqrt(HOUR)  # rad/sqrt(s), angle random walk
NMI = 1852.0  # m, international nautical mile
NMI_PER_H = NMI / HOUR  # m/s
STANDARD_GRAVITY = 9.80665  # m/s^2, the g of accelerometer data sheets
UG = 1e-6 * STANDARD_GRAVITY  # m/s^2
PPM = 1e-6
