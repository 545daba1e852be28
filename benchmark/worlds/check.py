"""The benchmark's own check of its recordings: increments integrated again, in the inertial frame.

Independent of `world`: the increments are summed, the sums interpolated by a spline of degree 7, and rate and specific
force, its derivatives, integrated by Runge-Kutta of fourth order with several steps a sample. Gravity is taken at
the computed latitude and the true height, as a height aid would have it.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from scipy.interpolate import make_interp_spline

from benchmark.worlds.earth import E2, A, W, geodetic, gravity, to_ned


@numba.njit(cache=True)
def _slope(q, v, r, w, f, t, h):
    dq = np.empty(4)
    dq[0] = 0.5 * (-q[1] * w[0] - q[2] * w[1] - q[3] * w[2])
    dq[1] = 0.5 * (q[0] * w[0] + q[2] * w[2] - q[3] * w[1])
    dq[2] = 0.5 * (q[0] * w[1] - q[1] * w[2] + q[3] * w[0])
    dq[3] = 0.5 * (q[0] * w[2] + q[1] * w[1] - q[2] * w[0])
    c = _matrix(q)
    s, k = math.sin(W * t), math.cos(W * t)
    x, y = k * r[0] + s * r[1], -s * r[0] + k * r[1]
    lat, lon, _ = geodetic(x, y, r[2])
    g = gravity(lat, h)
    ge = -g * np.array((math.cos(lat) * math.cos(lon), math.cos(lat) * math.sin(lon), math.sin(lat)))
    gi = np.array((k * ge[0] - s * ge[1] - W * W * r[0], s * ge[0] + k * ge[1] - W * W * r[1], ge[2]))
    return dq, c @ f + gi, v


@numba.njit(cache=True)
def _matrix(q):
    a, b, c, d = q / math.sqrt(q[0] ** 2 + q[1] ** 2 + q[2] ** 2 + q[3] ** 2)
    return np.array(
        (
            (a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)),
            (2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)),
            (2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d),
        )
    )


@numba.njit(cache=True)
def _integrate(q, v, r, w, f, h, t0, dt):
    n = (len(w) - 1) // 2
    out = np.empty((n, 3))
    outv = np.empty((n, 3))
    outc = np.empty((n, 3, 3))
    for k in range(n):
        t = t0 + k * dt
        i = 2 * k
        a1, b1, c1 = _slope(q, v, r, w[i], f[i], t, h[i])
        s = 0.5 * dt
        a2, b2, c2 = _slope(q + s * a1, v + s * b1, r + s * c1, w[i + 1], f[i + 1], t + s, h[i + 1])
        a3, b3, c3 = _slope(q + s * a2, v + s * b2, r + s * c2, w[i + 1], f[i + 1], t + s, h[i + 1])
        a4, b4, c4 = _slope(q + dt * a3, v + dt * b3, r + dt * c3, w[i + 2], f[i + 2], t + dt, h[i + 2])
        q = q + dt / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
        q = q / math.sqrt(q[0] ** 2 + q[1] ** 2 + q[2] ** 2 + q[3] ** 2)
        v = v + dt / 6 * (b1 + 2 * b2 + 2 * b3 + b4)
        r = r + dt / 6 * (c1 + 2 * c2 + 2 * c3 + c4)
        out[k], outv[k], outc[k] = r, v, _matrix(q)
    return out, outv, outc


def _quaternion(c):
    """Of a rotation matrix, by its largest component."""
    k = np.array(
        [
            [c[0, 0] - c[1, 1] - c[2, 2], 0, 0, 0],
            [c[0, 1] + c[1, 0], c[1, 1] - c[0, 0] - c[2, 2], 0, 0],
            [c[0, 2] + c[2, 0], c[1, 2] + c[2, 1], c[2, 2] - c[0, 0] - c[1, 1], 0],
            [c[2, 1] - c[1, 2], c[0, 2] - c[2, 0], c[1, 0] - c[0, 1], np.trace(c)],
        ]
    )
    b, cc, d, a = np.linalg.eigh(k / 3.0)[1][:, -1]
    return np.array((a, b, cc, d))


def navigate(angle, velocity, rate_hz, start_lla, start_velocity_ned, start_c_nb, height_m, steps=4):
    """Inertial navigation of the increments (n, 3); `height_m` is a function of the time in s that aids gravity.

    Returns ECEF position (n, 3) m, Earth-relative velocity in ECEF (n, 3) m/s and body-to-ECEF rotations (n, 3, 3),
    after each sample.
    """
    dt = 1.0 / rate_hz
    n = len(angle)
    time_s = dt * np.arange(n + 1)
    fine = dt / steps / 2.0 * np.arange(2 * n * steps + 1)
    zero = np.zeros((1, 3))
    rates = make_interp_spline(time_s, np.vstack((zero, np.cumsum(angle, axis=0))), k=7).derivative()(fine)
    forces = make_interp_spline(time_s, np.vstack((zero, np.cumsum(velocity, axis=0))), k=7).derivative()(fine)
    lat, lon, h = start_lla
    c = to_ned(lat, lon).T
    normal = A / math.sqrt(1.0 - E2 * math.sin(lat) ** 2)
    r = np.array(
        (
            (normal + h) * math.cos(lat) * math.cos(lon),
            (normal + h) * math.cos(lat) * math.sin(lon),
            (normal * (1 - E2) + h) * math.sin(lat),
        )
    )
    v = c @ np.asarray(start_velocity_ned, dtype=float) + W * np.array((-r[1], r[0], 0.0))
    q = _quaternion(c @ start_c_nb)
    rr, vv, cc = _integrate(q, v, r, rates, forces, height_m(fine), 0.0, dt / steps)
    rr, vv, cc = rr[steps - 1 :: steps], vv[steps - 1 :: steps], cc[steps - 1 :: steps]
    turn = W * time_s[1:]
    k, s = np.cos(turn), np.sin(turn)
    spin = np.zeros((n, 3, 3))
    spin[:, 0, 0], spin[:, 0, 1], spin[:, 1, 0], spin[:, 1, 1], spin[:, 2, 2] = k, s, -s, k, 1.0
    position = np.einsum("nij,nj->ni", spin, rr)
    relative = np.einsum("nij,nj->ni", spin, vv) - W * np.column_stack((-position[:, 1], position[:, 0], 0 * k))
    return position, relative, np.einsum("nij,njk->nik", spin, cc)
