"""Rotation and velocity over a step of four samples, in the body axes of its start.

Attitude and velocity together obey one linear equation on SE(3),

    X' = X A,   X = [C v; 0 1],   A = [w x, f; 0, 0],

whose sixth-order Magnus solution over two samples holds coning and sculling, and all that couples them. Body rate w(t)
and specific force f(t) are the quintics through the increments of these two samples and of two on either side, so that
the motion is known to the order of the solution. Two such halves make a step.

A block of steps is worked on at once, one value of each in a row, as the vector units of a processor take them.

Source: Blanes, Casas, Ros, BIT 40 (2000) 434.
"""

from __future__ import annotations

import numba
import numpy as np

SAMPLES_PER_STEP = 4
STEPS_PER_BLOCK = 64
_ROW = STEPS_PER_BLOCK + 2  # one value for each step of a block, and for the steps before and after
_SAMPLES = 6 * SAMPLES_PER_STEP * _ROW  # increments of angle, then of velocity, of each sample of a step
BLOCK_SIZE = _SAMPLES + 10 * STEPS_PER_BLOCK
ROTATION, GAINED, MOMENT = _SAMPLES, _SAMPLES + 4 * STEPS_PER_BLOCK, _SAMPLES + 7 * STEPS_PER_BLOCK


def _magnus_weights() -> np.ndarray:
    """(3, 6) weights that take increments to the Magnus moments alpha_1, alpha_2, alpha_3 of the middle two samples.

    The quintic through the increments is evaluated at the three Gauss nodes; the moments are its value, slope and
    curvature there (times powers of the step): a1 = A(c2), a2 = sqrt(15)/3 (A(c3) - A(c1)),
    a3 = 10/3 (A(c3) - 2 A(c2) + A(c1)).
    """
    edges = np.arange(-1.0, 2.5, 0.5)
    powers = np.arange(1, 7)
    integrals = (edges[1:, None] ** powers - edges[:-1, None] ** powers) / powers
    nodes = 0.5 + np.sqrt(15.0) / 10.0 * np.array([-1.0, 0.0, 1.0])
    at_nodes = nodes[:, None] ** (powers - 1) @ np.linalg.inv(integrals)
    first, middle, last = at_nodes
    return np.array([middle, np.sqrt(15.0) / 3.0 * (last - first), 10.0 / 3.0 * (last - 2.0 * middle + first)])


# each is even or odd about the middle, so three numbers make a row: of the inner, the next, the outer pair
_VALUE, _SLOPE, _CURVATURE = (tuple(float(w) for w in row[3:]) for row in _magnus_weights())


@numba.njit(cache=True, inline="always")
def cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@numba.njit(cache=True, inline="always")
def add(a, x, b):
    """a + x b"""
    return a[0] + x * b[0], a[1] + x * b[1], a[2] + x * b[2]


@numba.njit(cache=True, inline="always")
def scaled(x, a):
    return x * a[0], x * a[1], x * a[2]


@numba.njit(cache=True, inline="always")
def rotate(q, v):
    """C(q) v for a scalar-first unit quaternion."""
    u = (q[1], q[2], q[3])
    t = scaled(2.0, cross(u, v))
    return add(add(v, q[0], t), 1.0, cross(u, t))


@numba.njit(cache=True, inline="always")
def multiply(p, q):
    return (
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
        p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
        p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0],
    )


@numba.njit(cache=True, inline="always")
def quaternion(v):
    """Quaternion of a rotation vector well below 1 rad; series to the eighth power of the angle."""
    x = 0.25 * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2])  # square of half the angle
    cosine = 1.0 - x * (1.0 / 2.0) * (1.0 - x * (1.0 / 12.0) * (1.0 - x * (1.0 / 30.0) * (1.0 - x * (1.0 / 56.0))))
    sine = 0.5 * (
        1.0 - x * (1.0 / 6.0) * (1.0 - x * (1.0 / 20.0) * (1.0 - x * (1.0 / 42.0) * (1.0 - x * (1.0 / 72.0))))
    )
    return cosine, sine * v[0], sine * v[1], sine * v[2]


@numba.njit(cache=True, inline="always")
def _bracket(w1, f1, w2, f2):
    """Commutator of two elements of se(3), in the sign that body-frame increments (X' = X A) need."""
    return cross(w2, w1), add(cross(w2, f1), -1.0, cross(w1, f2))


@numba.njit(cache=True, inline="always")
def _magnus(w1, w2, w3, f1, f2, f3):
    """Quaternion, velocity and first moment of specific force over the time that the moments are of."""
    c1w, c1f = _bracket(w1, f1, w2, f2)
    c2w, c2f = _bracket(w1, f1, add(c1w, 2.0, w3), add(c1f, 2.0, f3))
    ow, of = _bracket(
        add(add(c1w, -20.0, w1), -1.0, w3),
        add(add(c1f, -20.0, f1), -1.0, f3),
        add(w2, -1.0 / 60.0, c2w),
        add(f2, -1.0 / 60.0, c2f),
    )
    rotation = add(add(w1, 1.0 / 12.0, w3), 1.0 / 240.0, ow)
    nu = add(add(f1, 1.0 / 12.0, f3), 1.0 / 240.0, of)
    # velocity = J(rotation) nu, the left Jacobian of SO(3) as a series in the squared angle
    x = rotation[0] * rotation[0] + rotation[1] * rotation[1] + rotation[2] * rotation[2]
    first = 0.5 * (1.0 - x * (1.0 / 12.0) * (1.0 - x * (1.0 / 30.0) * (1.0 - x * (1.0 / 56.0))))
    second = 1.0 / 6.0 * (1.0 - x * (1.0 / 20.0) * (1.0 - x * (1.0 / 42.0) * (1.0 - x * (1.0 / 72.0))))
    across = cross(rotation, nu)
    gained = add(add(nu, first, across), second, cross(rotation, across))
    u = scaled(1.0 / 12.0, add(f2, 1.0, cross(w1, f1)))
    moment = add(u, 0.5, cross(w1, u))
    return quaternion(rotation), gained, moment


@numba.njit(cache=True, inline="always")
def _increment(block, k, sample, column):
    """Column 0 to 5 of a sample of step k; samples -2 and -1 belong to the step before, 4 and 5 to that after."""
    return block[k + ((sample % 4) * 6 + column) * _ROW + sample // 4 + 1]


@numba.njit(cache=True, inline="always")
def _moments(block, k, first, column):
    """alpha_1, alpha_2, alpha_3 of a column over samples `first` and `first` + 1 of step k."""
    x0, x5 = _increment(block, k, first - 2, column), _increment(block, k, first + 3, column)
    x1, x4 = _increment(block, k, first - 1, column), _increment(block, k, first + 2, column)
    x2, x3 = _increment(block, k, first, column), _increment(block, k, first + 1, column)
    inner, middle, outer = x2 + x3, x1 + x4, x0 + x5
    return (
        _VALUE[0] * inner + _VALUE[1] * middle + _VALUE[2] * outer,
        _SLOPE[0] * (x3 - x2) + _SLOPE[1] * (x4 - x1) + _SLOPE[2] * (x5 - x0),
        _CURVATURE[0] * inner + _CURVATURE[1] * middle + _CURVATURE[2] * outer,
    )


@numba.njit(cache=True, inline="always")
def _half(block, k, first):
    x, y, z = _moments(block, k, first, 0), _moments(block, k, first, 1), _moments(block, k, first, 2)
    u, v, w = _moments(block, k, first, 3), _moments(block, k, first, 4), _moments(block, k, first, 5)
    return _magnus(
        (x[0], y[0], z[0]), (x[1], y[1], z[1]), (x[2], y[2], z[2]),
        (u[0], v[0], w[0]), (u[1], v[1], w[1]), (u[2], v[2], w[2]),
    )  # fmt: skip


@numba.njit(cache=True)
def _beyond(increments, row, axis):
    """Before the first row and after the last the cubic through the nearest four goes on."""
    base = 0 if row < 0 else increments.shape[0] - 4
    t = float(row - base)
    return (
        -(t - 1.0) * (t - 2.0) * (t - 3.0) / 6.0 * increments[base, axis]
        + t * (t - 2.0) * (t - 3.0) / 2.0 * increments[base + 1, axis]
        - t * (t - 1.0) * (t - 3.0) / 2.0 * increments[base + 2, axis]
        + t * (t - 1.0) * (t - 2.0) / 6.0 * increments[base + 3, axis]
    )


@numba.njit(cache=True)
def fill(block, dtheta_b, dv_b, step):
    """Write rotation (quaternion), velocity and first moment of the steps from `step` on into `block`.

    The moment is the integral of (t - T/2) C f over a step, divided by its duration T. Value `i` of step `step + k`
    stands at ``ROTATION + i * STEPS_PER_BLOCK + k``, and so on. What stands there of steps after the last is void.
    """
    count = dtheta_b.shape[0]
    for k in range(_ROW):
        for sample in range(SAMPLES_PER_STEP):
            row = SAMPLES_PER_STEP * (step + k - 1) + sample
            at = 6 * sample * _ROW + k
            if 0 <= row < count:
                for axis in range(3):
                    block[at + axis * _ROW] = dtheta_b[row, axis]
                    block[at + (3 + axis) * _ROW] = dv_b[row, axis]
            else:
                for axis in range(3):
                    block[at + axis * _ROW] = _beyond(dtheta_b, row, axis)
                    block[at + (3 + axis) * _ROW] = _beyond(dv_b, row, axis)
    _integrate(block)


@numba.njit(cache=True, error_model="numpy", fastmath={"contract"})
def _integrate(block):
    """Of constant length and in one array, or no compiler would make vector code of it."""
    for k in range(STEPS_PER_BLOCK):
        q1, gained1, moment1 = _half(block, k, 0)
        q2, gained2, moment2 = _half(block, k, 2)
        gained2, moment2 = rotate(q1, gained2), rotate(q1, moment2)
        q = multiply(q1, q2)
        gained = add(gained1, 1.0, gained2)
        moment = add(scaled(0.5, add(moment1, 1.0, moment2)), 0.25, add(gained2, -1.0, gained1))
        for i in range(4):
            block[k + ROTATION + i * STEPS_PER_BLOCK] = q[i]
        for i in range(3):
            block[k + GAINED + i * STEPS_PER_BLOCK] = gained[i]
            block[k + MOMENT + i * STEPS_PER_BLOCK] = moment[i]
