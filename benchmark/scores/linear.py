"""The linear error dynamics of an inertial navigator in ECEF, and the Kalman filter that whitens with the true noise.

States: attitude psi, velocity and position error (3 each, ECEF), slow gyro and accelerometer errors (body), slow
errors of position, velocity and attitude of the receiver (ECEF). With C' = (I - psi x) C:

    psi' = -W x psi - C dw,    v' = f x psi - 2 W x v + G r + C df,    r' = v

Deterministic inputs (columns) carry xi, the response less what the filter makes of it, so that the unstable vertical
does no harm.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from benchmark.worlds.earth import W, ecef, from_euler, to_ned

STATES = 24


@numba.njit(cache=True)
def attitudes(lla, euler):
    """Rotations from body to ECEF (n, 3, 3) and from NED to ECEF (n, 3, 3)."""
    n = len(lla)
    body, ned = np.empty((n, 3, 3)), np.empty((n, 3, 3))
    for k in range(n):
        ned[k] = to_ned(lla[k, 0], lla[k, 1]).T
        body[k] = ned[k] @ from_euler(euler[k, 0], euler[k, 1], euler[k, 2])
    return body, ned


@numba.njit(cache=True)
def by_second(c, second, values, seconds, out, sign):
    """Add sign C values, (n, 3), to `out` (seconds, 3)."""
    for k in range(len(values)):
        s = second[k]
        if s < seconds:
            for i in range(3):
                out[s, i] += sign * (c[k, i, 0] * values[k, 0] + c[k, i, 1] * values[k, 1] + c[k, i, 2] * values[k, 2])


@numba.njit(cache=True)
def _cross(v):
    return np.array(((0.0, -v[2], v[1]), (v[2], 0.0, -v[0]), (-v[1], v[0], 0.0)))


@numba.njit(cache=True)
def transition(force, up, g_over_r):
    """Of psi, v and r over a second: the transition matrix (9, 9), and what inputs add (9, 6)."""
    f, spin = np.zeros((9, 9)), _cross(np.array((0.0, 0.0, W)))
    f[:3, :3] = -spin
    f[3:6, :3] = _cross(force)
    f[3:6, 3:6] = -2.0 * spin
    for i in range(3):
        for j in range(3):
            f[3 + i, 6 + j] = 3.0 * g_over_r * up[i] * up[j]
        f[3 + i, 6 + i] -= g_over_r
        f[6 + i, 3 + i] = 1.0
    eye, ff = np.eye(9), f @ f
    return eye + f + 0.5 * ff + ff @ f / 6.0, np.ascontiguousarray((eye + 0.5 * f + ff / 6.0)[:, :6])


@numba.njit(cache=True)
def whiten(c, force, up, g_over_r, u, x0, row_of, y, r, q_gyro, q_accel, tau, sigma):
    """Whitened observations of every column.

    c (s, 3, 3) body to ECEF and force (s, 3) m/s^2, ECEF, in each second; up (s, 3) unit vectors; u (s, 6, m) inputs
    of a second to psi and velocity; x0 (9, m) at the start; row_of (s + 1,) the row of y (rows, d, m) at each whole
    second or -1, d = 6 (position, velocity) or 9 (attitude too), r (d,) its white variances; q_gyro (3,), q_accel
    (3,) white variances a second, body; tau and sigma (5,) of slow gyro, accelerometer, and receiver's position,
    velocity and attitude. Returns (rows d, m).
    """
    seconds, m, d = len(c), u.shape[2], y.shape[1]
    out = np.zeros((len(y) * d, m))
    xi = np.zeros((STATES, m))
    xi[:9] = x0
    p = np.zeros((STATES, STATES))
    keep = np.empty(5)
    for j in range(5):
        keep[j] = math.exp(-1.0 / tau[j])
        for i in range(3):
            p[9 + 3 * j + i, 9 + 3 * j + i] = sigma[j] ** 2
    h = np.zeros((d, STATES))
    for i in range(3):
        h[i, 6 + i] = h[i, 15 + i] = h[3 + i, 3 + i] = h[3 + i, 18 + i] = 1.0
        if d == 9:
            h[6 + i, i] = h[6 + i, 21 + i] = 1.0
    for k in range(seconds + 1):
        row = row_of[k]
        if row >= 0:
            ph = p @ h.T
            s = h @ ph + np.diag(r)
            lower = np.linalg.cholesky(s)
            innovation = h @ xi + y[row]
            w = np.linalg.solve(lower, innovation)
            out[row * d : (row + 1) * d] = w
            half = np.linalg.solve(lower, ph.T)
            xi -= half.T @ w
            p -= half.T @ half
            p = 0.5 * (p + p.T)
        if k == seconds:
            break
        phi9, gamma = transition(force[k], up[k], g_over_r)
        phi = np.zeros((STATES, STATES))
        phi[:9, :9] = phi9
        b = np.zeros((6, 6))
        b[:3, :3] = -c[k]
        b[3:, 3:] = c[k]
        phi[:9, 9:15] = gamma @ b
        for j in range(5):
            for i in range(3):
                phi[9 + 3 * j + i, 9 + 3 * j + i] = keep[j]
        xi = phi @ xi
        xi[:9] += gamma @ u[k]
        qb = np.zeros((6, 6))
        qb[:3, :3] = c[k] @ np.diag(q_gyro) @ c[k].T
        qb[3:, 3:] = c[k] @ np.diag(q_accel) @ c[k].T
        p = phi @ p @ phi.T
        p[:9, :9] += gamma @ qb @ gamma.T
        for j in range(5):
            for i in range(3):
                p[9 + 3 * j + i, 9 + 3 * j + i] += sigma[j] ** 2 * (1.0 - keep[j] ** 2)
    return out


@numba.njit(cache=True)
def inertial(c, force, up, g_over_r, u):
    """Velocity errors (s, 3, m), ECEF, of inertial navigation whose height is held from outside; `whiten` has the rest.

    Nothing but the inputs u (s, 6, m) acts: the start is right and the vertical without error.
    """
    seconds, m = len(c), u.shape[2]
    out, x = np.empty((seconds, 3, m)), np.zeros((9, m))
    for k in range(seconds):
        phi, gamma = transition(force[k], up[k], g_over_r)
        x = phi @ x + gamma @ u[k]
        level = np.eye(3) - np.outer(up[k], up[k])
        x[3:6], x[6:9] = level @ np.ascontiguousarray(x[3:6]), level @ np.ascontiguousarray(x[6:9])
        out[k] = x[3:6]
    return out


def seconds_of(truth, seconds):
    """Middle of each second: body and NED to ECEF, up, and the state there."""
    at = np.arange(seconds) + 0.5
    lla, velocity, euler, _ = truth.state(at)
    body, ned = attitudes(lla, euler)
    return lla, velocity, body, ned, np.ascontiguousarray(-ned[:, :, 2])


def mean_radius(lla):
    return float(np.linalg.norm(ecef(*lla[0])))
