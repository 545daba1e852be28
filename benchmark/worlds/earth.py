"""WGS-84 and its normal gravity, written for the benchmark alone.

Source: NIMA TR8350.2, eqs 4-1 to 4-3; the gravity is Somigliana's on the ellipsoid, second order in height.
"""

from __future__ import annotations

import math

import numba
import numpy as np

A = 6378137.0  # m
F = 1.0 / 298.257223563
B = A * (1.0 - F)
E2 = F * (2.0 - F)
EP2 = E2 / (1.0 - E2)
W = 7.292115e-5  # rad/s
GM = 3.986004418e14  # m^3/s^2
G_EQUATOR = 9.7803253359  # m/s^2
G_POLE = 9.8321849378
K_SOMIGLIANA = B * G_POLE / (A * G_EQUATOR) - 1.0
M_RATIO = W * W * A * A * B / GM
G0 = 9.80665  # m/s^2, the g of pulses


@numba.njit(cache=True)
def gravity(latitude, height):
    """Normal gravity, m/s^2, positive down; rad, m."""
    s2 = math.sin(latitude) ** 2
    surface = G_EQUATOR * (1.0 + K_SOMIGLIANA * s2) / math.sqrt(1.0 - E2 * s2)
    return surface * (1.0 - 2.0 / A * (1.0 + F + M_RATIO - 2.0 * F * s2) * height + 3.0 * height * height / (A * A))


@numba.njit(cache=True)
def radii(latitude):
    """Meridian and prime-vertical radius of curvature, m."""
    d = 1.0 - E2 * math.sin(latitude) ** 2
    root = math.sqrt(d)
    return A * (1.0 - E2) / (d * root), A / root


@numba.njit(cache=True)
def geodetic(x, y, z):
    """Latitude and longitude in rad, height in m, of a point in ECEF; Bowring, twice."""
    p = math.sqrt(x * x + y * y)
    sb, cb = z * A, p * B  # tangent of the reduced latitude
    for _ in range(3):
        n = math.sqrt(sb * sb + cb * cb)
        s, c = sb / n, cb / n
        up, across = z + EP2 * B * s**3, p - E2 * A * c**3
        sb, cb = B * up, A * across
    n = math.sqrt(up * up + across * across)
    s, c = up / n, across / n
    height = p * c + z * s - A * math.sqrt(1.0 - E2 * s * s)
    return math.atan2(up, across), math.atan2(y, x), height


def ecef(latitude, longitude, height):
    """ECEF position, (..., 3) m, of geodetic coordinates in rad and m."""
    latitude, longitude, height = np.broadcast_arrays(latitude, longitude, height)
    n = A / np.sqrt(1.0 - E2 * np.sin(latitude) ** 2)
    across = (n + height) * np.cos(latitude)
    up = (n * (1.0 - E2) + height) * np.sin(latitude)
    return np.stack((across * np.cos(longitude), across * np.sin(longitude), up), axis=-1)


@numba.njit(cache=True)
def to_ned(latitude, longitude):
    """Rotation from ECEF to north, east, down, (3, 3)."""
    sl, cl = math.sin(latitude), math.cos(latitude)
    so, co = math.sin(longitude), math.cos(longitude)
    out = np.empty((3, 3))
    out[0, 0], out[0, 1], out[0, 2] = -sl * co, -sl * so, cl
    out[1, 0], out[1, 1], out[1, 2] = -so, co, 0.0
    out[2, 0], out[2, 1], out[2, 2] = -cl * co, -cl * so, -sl
    return out


@numba.njit(cache=True)
def from_euler(roll, pitch, heading):
    """Rotation from body to north, east, down, (3, 3)."""
    sr, cr = math.sin(roll), math.cos(roll)
    sp, cp = math.sin(pitch), math.cos(pitch)
    sh, ch = math.sin(heading), math.cos(heading)
    out = np.empty((3, 3))
    out[0, 0], out[0, 1], out[0, 2] = cp * ch, sr * sp * ch - cr * sh, cr * sp * ch + sr * sh
    out[1, 0], out[1, 1], out[1, 2] = cp * sh, sr * sp * sh + cr * ch, cr * sp * sh - sr * ch
    out[2, 0], out[2, 1], out[2, 2] = -sp, sr * cp, cr * cp
    return out


def to_euler(c):
    """Roll, pitch, heading in rad, each (...,), of rotations from body to NED (..., 3, 3)."""
    return (
        np.arctan2(c[..., 2, 1], c[..., 2, 2]),
        -np.arcsin(np.clip(c[..., 2, 0], -1.0, 1.0)),
        np.arctan2(c[..., 1, 0], c[..., 0, 0]),
    )
