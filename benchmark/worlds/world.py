"""Where the vehicle truly is, and what an ideal inertial unit feels of it.

Truth is a spline: the displacement in ECEF from the first position, and roll, pitch, heading, both of degree 7 on
knots `KNOT_S` apart. Velocity, rates and specific force are its exact derivatives; there is no integration error.
The increments of a sample are Gauss-Legendre quadratures within it, in which no knot lies.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numba
import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.ndimage import gaussian_filter1d

from benchmark.worlds.earth import W, ecef, from_euler, geodetic, gravity, radii, to_ned

KNOT_S = 0.4
DEGREE = 7
SWAY_S = 0.25  # smoothness of sway, whose velocity has forgotten itself after a second; the knots carry none faster
RISE_S = 0.8  # in which it rises as a vehicle comes to rest
STANDS_MPS = 1e-3
NODES, WEIGHTS = np.polynomial.legendre.leggauss(4)
NODES, WEIGHTS = (NODES + 1.0) / 2.0, WEIGHTS / 2.0


@dataclass(frozen=True)
class Path:
    """The truth of a recording from 0 to `duration_s`; coefficients (pieces, 8, 3), highest power first."""

    origin: np.ndarray  # (3,) m, ECEF
    displacement: np.ndarray
    euler: np.ndarray  # roll, pitch, heading in rad, continuous
    duration_s: float
    phases: tuple[tuple[str, float, float], ...] = ()

    def state(self, time_s):
        """Latitude, longitude, height (n, 3), velocity NED (n, 3), euler (n, 3), rate against Earth in body (n, 3)."""
        time_s = np.atleast_1d(np.asarray(time_s, dtype=float))
        return _states(self.origin, self.displacement, self.euler, time_s)

    def attitude(self, time_s):
        """Rotation from body to NED, (n, 3, 3)."""
        return np.stack([from_euler(*one) for one in self.state(time_s)[2]])


def pieces(values: np.ndarray) -> np.ndarray:
    """Spline through `values` (n, 3) at the knots, as polynomials (n - 1, 8, 3) on each knot interval."""
    time_s = KNOT_S * np.arange(len(values))
    spline = make_interp_spline(time_s, values, k=DEGREE)
    taylor = [spline(time_s[:-1], nu=k) / math.factorial(k) for k in range(DEGREE, -1, -1)]
    return np.ascontiguousarray(np.stack(taylor, axis=1))


def path(position_lla: np.ndarray, euler: np.ndarray, phases=()) -> Path:
    """Path through geodetic positions (n, 3) rad, rad, m and roll, pitch, heading (n, 3) rad at the knots."""
    points = ecef(position_lla[:, 0], position_lla[:, 1], position_lla[:, 2])
    return Path(points[0], pieces(points - points[0]), pieces(euler), KNOT_S * (len(points) - 1), tuple(phases))


def swaying(truth: Path, rng: np.random.Generator, velocity_mps: float) -> Path:
    """The same path, on which wind and engines move a vehicle that stands; `velocity_mps` is one sigma each axis."""
    time_s = KNOT_S * np.arange(len(truth.displacement) + 1)
    lla, velocity, _, _ = truth.state(time_s)
    stands = (np.linalg.norm(velocity, axis=1) < STANDS_MPS).astype(float)
    envelope = np.clip(2.0 * gaussian_filter1d(stands, RISE_S / KNOT_S, mode="nearest") - 1.0, 0.0, 1.0) ** 2
    sway = gaussian_filter1d(rng.standard_normal((len(time_s), 3)), SWAY_S / KNOT_S, axis=0)
    sway *= velocity_mps / np.std(pieces(sway)[:, DEGREE - 1])
    moved = np.stack([to_ned(one[0], one[1]).T @ away for one, away in zip(lla, envelope[:, None] * sway, strict=True)])
    return replace(truth, displacement=truth.displacement + pieces(moved))


@numba.njit(cache=True)
def _at(c, u):
    """Value, first and second derivative of the polynomials c (8, 3) at u."""
    p, d, s = np.zeros(3), np.zeros(3), np.zeros(3)
    for i in range(3):
        a0, a1, a2 = 0.0, 0.0, 0.0
        for k in range(c.shape[0]):
            a2 = a2 * u + a1
            a1 = a1 * u + a0
            a0 = a0 * u + c[k, i]
        p[i], d[i], s[i] = a0, a1, 2.0 * a2
    return p, d, s


@numba.njit(cache=True)
def _felt(origin, cr, ce, u):
    """Specific force and inertial rate in body axes, (3,) and (3,)."""
    p, v, a = _at(cr, u)
    e, de, _ = _at(ce, u)
    lat, lon, h = geodetic(origin[0] + p[0], origin[1] + p[1], origin[2] + p[2])
    cn = to_ned(lat, lon)
    # gravitation is gravity plus the centrifugal term that the inertial acceleration contains: both cancel
    fe = np.array((a[0] - 2.0 * W * v[1], a[1] + 2.0 * W * v[0], a[2]))
    fn = cn @ fe
    fn[2] -= gravity(lat, h)
    vn = cn @ v
    m, n = radii(lat)
    wn = np.array(
        (
            W * math.cos(lat) + vn[1] / (n + h),
            -vn[0] / (m + h),
            -W * math.sin(lat) - vn[1] / (n + h) * math.tan(lat),
        )
    )
    cb = from_euler(e[0], e[1], e[2]).T
    w = cb @ wn + _body_rate(e, de)
    return cb @ fn, w


@numba.njit(cache=True)
def _body_rate(e, de):
    sr, cr = math.sin(e[0]), math.cos(e[0])
    sp, cp = math.sin(e[1]), math.cos(e[1])
    return np.array((de[0] - sp * de[2], cr * de[1] + sr * cp * de[2], -sr * de[1] + cr * cp * de[2]))


@numba.njit(cache=True)
def _increments(origin, cr, ce, per_knot, n, nodes, weights):
    dt = KNOT_S / per_knot
    angle, velocity = np.zeros((n, 3)), np.zeros((n, 3))
    for k in range(n):
        piece = k // per_knot
        start = (k - piece * per_knot) * dt
        for j in range(nodes.size):
            f, w = _felt(origin, cr[piece], ce[piece], start + nodes[j] * dt)
            for i in range(3):
                angle[k, i] += weights[j] * dt * w[i]
                velocity[k, i] += weights[j] * dt * f[i]
    return angle, velocity


@numba.njit(cache=True)
def _states(origin, cr, ce, time_s):
    n = time_s.size
    lla, vel, eul, rate = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3))
    for k in range(n):
        piece = min(max(int(time_s[k] / KNOT_S), 0), cr.shape[0] - 1)
        u = time_s[k] - piece * KNOT_S
        p, v, _ = _at(cr[piece], u)
        e, de, _ = _at(ce[piece], u)
        lat, lon, h = geodetic(origin[0] + p[0], origin[1] + p[1], origin[2] + p[2])
        lla[k, 0], lla[k, 1], lla[k, 2] = lat, lon, h
        vn = to_ned(lat, lon) @ v
        vel[k], eul[k] = vn, e
        m, nn = radii(lat)
        wen = np.array((vn[1] / (nn + h), -vn[0] / (m + h), -vn[1] / (nn + h) * math.tan(lat)))
        # against the Earth: the body against NED, and NED against the Earth
        rate[k] = _body_rate(e, de) + from_euler(e[0], e[1], e[2]).T @ wen
    return lla, vel, eul, rate


def increments(truth: Path, rate_hz: float) -> tuple[np.ndarray, np.ndarray]:
    """Angle (n, 3) rad and velocity (n, 3) m/s over each sample, body axes, of an ideal unit at `rate_hz`."""
    per_knot = round(KNOT_S * rate_hz)
    if abs(per_knot - KNOT_S * rate_hz) > 1e-9:
        raise ValueError(f"rate {rate_hz:g} Hz: its samples do not end on the knots, which are {KNOT_S:g} s apart")
    n = round(truth.duration_s * rate_hz)
    return _increments(truth.origin, truth.displacement, truth.euler, per_knot, n, NODES, WEIGHTS)
