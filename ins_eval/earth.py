"""WGS-84: shape, rotation and normal gravity.

Every function takes scalars or arrays and is compiled, so that the mechanization and the truth read the same
numbers. Source: NGA.STND.0036, World Geodetic System 1984, chapters 3 and 4.
"""

from __future__ import annotations

import numba
import numpy as np

SEMI_MAJOR_AXIS_M = 6378137.0
FLATTENING = 1.0 / 298.257223563
ECCENTRICITY_SQUARED = FLATTENING * (2.0 - FLATTENING)
EARTH_RATE = 7.292115e-5  # rad/s
GM = 3.986004418e14  # m^3/s^2
EQUATOR_GRAVITY = 9.7803253359  # m/s^2
POLE_GRAVITY = 9.8321849378  # m/s^2

_SEMI_MINOR_AXIS_M = SEMI_MAJOR_AXIS_M * (1.0 - FLATTENING)
_SOMIGLIANA_K = _SEMI_MINOR_AXIS_M * POLE_GRAVITY / (SEMI_MAJOR_AXIS_M * EQUATOR_GRAVITY) - 1.0
_CENTRIFUGAL_RATIO = EARTH_RATE**2 * SEMI_MAJOR_AXIS_M**2 * _SEMI_MINOR_AXIS_M / GM


@numba.njit(cache=True, error_model="numpy")
def radii(latitude_rad):
    """Radii of curvature of the ellipsoid.

    M = a (1 - e^2) / (1 - e^2 sin^2 L)^(3/2),   N = a / (1 - e^2 sin^2 L)^(1/2)

    Returns the meridian radius M and the transverse radius N in m, of the shape of `latitude_rad`.
    """
    sine = np.sin(latitude_rad)
    return radii_of(sine * sine)


@numba.njit(cache=True, error_model="numpy")
def radii_of(sine_squared):
    """The same of sin^2 L."""
    w = 1.0 - ECCENTRICITY_SQUARED * sine_squared
    transverse = SEMI_MAJOR_AXIS_M / np.sqrt(w)
    return transverse * (1.0 - ECCENTRICITY_SQUARED) / w, transverse


@numba.njit(cache=True, error_model="numpy")
def gravity(latitude_rad, height_m):
    """Normal gravity, positive down, in m/s^2: Somigliana's closed form, second order in height.

    g0 = g_e (1 + k sin^2 L) / (1 - e^2 sin^2 L)^(1/2)
    g  = g0 (1 - 2 (1 + f + m - 2 f sin^2 L) h / a + 3 h^2 / a^2)

    with k = b g_p / (a g_e) - 1 and m = omega^2 a^2 b / GM. The deflection of normal gravity with height
    (5e-8 g at 10 km) is left out, as it is from the mechanization.
    """
    sine = np.sin(latitude_rad)
    return gravity_of(sine * sine, height_m)


@numba.njit(cache=True, error_model="numpy")
def gravity_of(sine_squared, height_m):
    """The same of sin^2 L."""
    s2 = sine_squared
    surface = EQUATOR_GRAVITY * (1.0 + _SOMIGLIANA_K * s2) / np.sqrt(1.0 - ECCENTRICITY_SQUARED * s2)
    slope = 2.0 * (1.0 + FLATTENING + _CENTRIFUGAL_RATIO - 2.0 * FLATTENING * s2) / SEMI_MAJOR_AXIS_M
    part = height_m / SEMI_MAJOR_AXIS_M
    return surface * (1.0 - slope * height_m + 3.0 * (part * part))
