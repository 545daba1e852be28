"""Pure-inertial mechanization: increments in, position, velocity and attitude out.

Four samples make one step. Their increments define cubic body rate w(t) and specific force f(t); attitude and
velocity together obey one linear equation on SE(3),

    X' = X A,   X = [C v; 0 1],   A = [w x, f; 0, 0],

whose sixth-order Magnus solution holds coning and sculling, and all that couples them, to the order of the fit.
The navigation frame (north-east-down, WGS-84) turns slowly and is taken at mid-step. The vertical channel is
damped by a height of third order, since an undamped one grows as exp(t sqrt(2 g / R)), 10^6 in two hours.

Sources: Magnus integrator: Blanes, Casas, Ros, BIT 40 (2000) 434; navigation equations: Titterton and Weston,
Strapdown Inertial Navigation Technology, 2nd ed., chapter 3; vertical channel: ibid., section 12.4.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numba
import numpy as np

from ins_eval.earth import EARTH_RATE, gravity, radii
from ins_eval.recording import Start
from ins_eval.recording.belief import EarthBelief

SAMPLES_PER_STEP = 4
VERTICAL_TIME_CONSTANT_S = 60.0
Vertical = Literal["damped", "free", "frozen"]


def _magnus_weights() -> np.ndarray:
    """(3, 4) weights that take four increments to the Magnus moments alpha_1, alpha_2, alpha_3.

    The cubic through the increments is evaluated at the three Gauss nodes; the moments are its value, slope and
    curvature there (times powers of the step): a1 = A(c2), a2 = sqrt(15)/3 (A(c3) - A(c1)),
    a3 = 10/3 (A(c3) - 2 A(c2) + A(c1)).
    """
    edges = np.arange(SAMPLES_PER_STEP + 1) / SAMPLES_PER_STEP
    powers = np.arange(1, SAMPLES_PER_STEP + 1)
    integrals = (edges[1:, None] ** powers - edges[:-1, None] ** powers) / powers
    nodes = 0.5 + np.sqrt(15.0) / 10.0 * np.array([-1.0, 0.0, 1.0])
    at_nodes = nodes[:, None] ** (powers - 1) @ np.linalg.inv(integrals)
    first, middle, last = at_nodes
    return np.array([middle, np.sqrt(15.0) / 3.0 * (last - first), 10.0 / 3.0 * (last - 2.0 * middle + first)])


_WEIGHTS = _magnus_weights()


def _earth_terms(earth: EarthBelief) -> tuple[float, ...]:
    flags = (earth.rotation, earth.coriolis, earth.transport_rate, earth.gravity_height, earth.gravity_latitude)
    return tuple(float(flag) for flag in flags)


@dataclass(frozen=True)
class Solution:
    """The navigation solution at `time_s` (m,); the first row is the start itself."""

    time_s: np.ndarray
    latitude_rad: np.ndarray
    longitude_rad: np.ndarray
    height_m: np.ndarray
    velocity_n: np.ndarray  # (m, 3) m/s
    quaternion_nb: np.ndarray  # (m, 4), scalar first, body to navigation frame

    @cached_property
    def attitude_rad(self) -> np.ndarray:
        """Roll, pitch, heading (m, 3)."""
        return attitude_from_quaternion(self.quaternion_nb)


def attitude_from_quaternion(quaternion_nb: np.ndarray) -> np.ndarray:
    """Roll, pitch, heading (..., 3) of scalar-first quaternions (..., 4)."""
    from scipy.spatial.transform import Rotation  # here, as in the next: it takes longer to import than all else

    angles = Rotation.from_quat(quaternion_nb, scalar_first=True).as_euler("ZYX")
    return np.ascontiguousarray(angles[..., ::-1])


def quaternion_from_attitude(attitude_rad) -> np.ndarray:
    """Scalar-first quaternion, body to navigation frame, of roll, pitch, heading."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_euler("ZYX", np.asarray(attitude_rad, dtype=float)[::-1]).as_quat(scalar_first=True)


@numba.njit(cache=True, inline="always")
def _cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@numba.njit(cache=True, inline="always")
def _add(a, x, b):
    return a[0] + x * b[0], a[1] + x * b[1], a[2] + x * b[2]


@numba.njit(cache=True, inline="always")
def _scaled(x, a):
    return x * a[0], x * a[1], x * a[2]


@numba.njit(cache=True, inline="always")
def _bracket(w1, f1, w2, f2):
    """Commutator of two elements of se(3), in the sign that body-frame increments (X' = X A) need."""
    return _cross(w2, w1), _add(_cross(w2, f1), -1.0, _cross(w1, f2))


@numba.njit(cache=True, inline="always")
def _rotate(q, v):
    """C(q) v for a scalar-first unit quaternion."""
    u = (q[1], q[2], q[3])
    t = _scaled(2.0, _cross(u, v))
    return _add(_add(v, q[0], t), 1.0, _cross(u, t))


@numba.njit(cache=True, inline="always")
def _multiply(p, q):
    return (
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
        p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
        p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0],
    )


@numba.njit(cache=True, inline="always")
def _quaternion(v):
    """Quaternion of a rotation vector well below 1 rad; series to the eighth power of the angle."""
    x = 0.25 * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2])  # square of half the angle
    cosine = 1.0 - x / 2.0 * (1.0 - x / 12.0 * (1.0 - x / 30.0 * (1.0 - x / 56.0)))
    sine = 0.5 * (1.0 - x / 6.0 * (1.0 - x / 20.0 * (1.0 - x / 42.0 * (1.0 - x / 72.0))))
    return cosine, sine * v[0], sine * v[1], sine * v[2]


@numba.njit(cache=True, inline="always")
def _step_in_body(dtheta_b, dv_b, row, weights):
    """Rotation vector, velocity, first moment of specific force over four samples, in the axes of their start."""
    a = np.zeros(18)
    for i in range(4):
        for j in range(3):
            w, f = dtheta_b[row + i, j], dv_b[row + i, j]
            for m in range(3):
                a[3 * m + j] += weights[m, i] * w
                a[9 + 3 * m + j] += weights[m, i] * f
    w1, w2, w3 = (a[0], a[1], a[2]), (a[3], a[4], a[5]), (a[6], a[7], a[8])
    f1, f2, f3 = (a[9], a[10], a[11]), (a[12], a[13], a[14]), (a[15], a[16], a[17])
    c1w, c1f = _bracket(w1, f1, w2, f2)
    c2w, c2f = _bracket(w1, f1, _add(c1w, 2.0, w3), _add(c1f, 2.0, f3))
    ow, of = _bracket(
        _add(_add(c1w, -20.0, w1), -1.0, w3),
        _add(_add(c1f, -20.0, f1), -1.0, f3),
        _add(w2, -1.0 / 60.0, c2w),
        _add(f2, -1.0 / 60.0, c2f),
    )
    rotation = _add(_add(w1, 1.0 / 12.0, w3), 1.0 / 240.0, ow)
    nu = _add(_add(f1, 1.0 / 12.0, f3), 1.0 / 240.0, of)
    # velocity = J(rotation) nu, the left Jacobian of SO(3) as a series in the squared angle
    x = rotation[0] ** 2 + rotation[1] ** 2 + rotation[2] ** 2
    first = 0.5 * (1.0 - x / 12.0 * (1.0 - x / 30.0 * (1.0 - x / 56.0)))
    second = 1.0 / 6.0 * (1.0 - x / 20.0 * (1.0 - x / 42.0 * (1.0 - x / 72.0)))
    across = _cross(rotation, nu)
    gained = _add(_add(nu, first, across), second, _cross(rotation, across))
    # integral of (t - T/2) C f over the step, divided by T
    moment = _rotate(_quaternion(_scaled(0.5, rotation)), _scaled(1.0 / 12.0, _add(f2, 1.0, _cross(w1, f1))))
    return rotation, gained, moment


@numba.njit(cache=True, inline="always")
def _mean_velocity(v, gained, moment, frame, acceleration, dt):
    """Velocity averaged over a step, in the navigation frame that turns with it."""
    mean = _add(_add(_add(v, 0.5, gained), -1.0, moment), 0.5 * dt, acceleration)
    return _add(mean, -dt / 6.0, _cross(frame, gained))


@numba.njit(cache=True, nogil=True)
def _navigate(time_s, dtheta_b, dv_b, aid_m, start, quaternion, weights, vertical, gains, earth_terms, every):
    """The compiled loop. `vertical` is 0 damped, 1 free, 2 frozen. Returns one row every `every` steps: (m, 11).

    `earth_terms` holds a factor, 1 or 0, for each term of `EarthBelief`.
    """
    rotation_term, coriolis_term, transport_term, height_term, latitude_term = earth_terms
    earth_rate = rotation_term * EARTH_RATE
    fixed_latitude = (1.0 - latitude_term) * 0.25 * np.pi
    steps = dtheta_b.shape[0] // 4
    out = np.empty((steps // every + 1, 11))
    t0, latitude, longitude, height = start[0], start[1], start[2], start[3]
    v = (start[4], start[5], 0.0 if vertical == 2 else start[6])
    q = (quaternion[0], quaternion[1], quaternion[2], quaternion[3])
    out[0] = t0, latitude, longitude, height, v[0], v[1], v[2], q[0], q[1], q[2], q[3]
    k1, k2, k3 = gains
    integral = 0.0
    offset = 0.0  # height minus aid at the start of the step
    # of the step before: radii, rate of the navigation frame, gravity less Coriolis
    meridian, transverse = radii(latitude)
    frame = (earth_rate * np.cos(latitude), 0.0, -earth_rate * np.sin(latitude))
    acceleration = (0.0, 0.0, gravity(latitude_term * latitude + fixed_latitude, height_term * height))
    for step in range(steps):
        row = 4 * step
        t1 = time_s[row + 3]
        dt = t1 - t0
        rotation, gained, moment = _step_in_body(dtheta_b, dv_b, row, weights)
        gained = _rotate(q, gained)
        moment = _rotate(q, moment)
        mean = _mean_velocity(v, gained, moment, frame, acceleration, dt)
        # Earth at mid-step
        latitude_mid = latitude + 0.5 * dt * mean[0] / (meridian + height)
        height_mid = height - 0.5 * dt * mean[2]
        meridian, transverse = radii(latitude_mid)
        sine, cosine = np.sin(latitude_mid), np.cos(latitude_mid)
        east_rate = transport_term * mean[1] / (transverse + height_mid)
        transport = (east_rate, -transport_term * mean[0] / (meridian + height_mid), -east_rate * sine / cosine)
        earth = (earth_rate * cosine, 0.0, -earth_rate * sine)
        frame = _add(transport, 1.0, earth)
        coriolis = _cross(_add(transport, 2.0 * coriolis_term, earth), mean)
        weight = gravity(latitude_term * latitude_mid + fixed_latitude, height_term * height_mid)
        acceleration = (-coriolis[0], -coriolis[1], weight - coriolis[2])
        # final velocity; the navigation frame turns under the specific force
        mean = _mean_velocity(v, gained, moment, frame, acceleration, dt)
        turned = _cross(frame, _add(_scaled(0.5 * dt, gained), dt, moment))
        v = _add(_add(_add(v, 1.0, gained), -1.0, turned), dt, acceleration)
        if vertical == 2:
            mean = (mean[0], mean[1], 0.0)
            v = (v[0], v[1], 0.0)
        elif vertical == 0:
            if step > 0:
                offset = height - aid_m[row - 1]
            integral += offset * dt
            v = (v[0], v[1], v[2] + (k2 * offset + k3 * integral) * dt)
            height -= k1 * offset * dt
        latitude += dt * mean[0] / (meridian + height_mid)
        longitude += dt * mean[1] / ((transverse + height_mid) * cosine)
        height -= dt * mean[2]
        q = _multiply(_multiply(_quaternion(_scaled(-dt, frame)), q), _quaternion(rotation))
        n = 1.5 - 0.5 * (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
        q = (n * q[0], n * q[1], n * q[2], n * q[3])
        t0 = t1
        if (step + 1) % every == 0:
            out[(step + 1) // every] = t1, latitude, longitude, height, v[0], v[1], v[2], q[0], q[1], q[2], q[3]
    return out


def navigate(
    time_s: np.ndarray,
    dtheta_b: np.ndarray,
    dv_b: np.ndarray,
    start: Start,
    height_aid_m: np.ndarray | None = None,
    vertical: Vertical = "damped",
    every: int = 1,
    earth: EarthBelief | None = None,
) -> Solution:
    """Integrate increments from a known state.

    Parameters
    ----------
    time_s : (n,) end of each sample, s; the first sample begins at `start.time_s`
    dtheta_b, dv_b : (n, 3) increments over the samples, body axes, rad and m/s
    start : state with attitude
    height_aid_m : (n,) height that damps the vertical channel, m; None: the height of the start, held
    vertical : "damped" as above; "free" and "frozen" (height held, no vertical velocity) serve diagnostics only
    every : one row of the solution for so many steps of four samples
    earth : terms of the navigation equations to leave out; None: all are in

    Returns
    -------
    Solution; up to three samples after the last whole step are not used.

    Notes
    -----
    Damping, e = h - aid:  h' = -v_D - k1 e,  v_D' = ... + k2 e + k3 integral(e), with a triple pole at
    1 / 60 s: k1 = 3 / tau, k2 = 3 / tau^2 + 2 g / R, k3 = 1 / tau^3.
    """
    tau = VERTICAL_TIME_CONSTANT_S
    mean_radius = np.mean(radii(start.latitude_rad))
    gains = (3.0 / tau, 3.0 / tau**2 + 2.0 * gravity(start.latitude_rad, start.height_m) / mean_radius, 1.0 / tau**3)
    aid = np.full(len(time_s), start.height_m) if height_aid_m is None else height_aid_m
    rows = _navigate(
        np.ascontiguousarray(time_s, dtype=float),
        np.ascontiguousarray(dtheta_b, dtype=float),
        np.ascontiguousarray(dv_b, dtype=float),
        np.ascontiguousarray(aid, dtype=float),
        np.array([start.time_s, start.latitude_rad, start.longitude_rad, start.height_m, *start.velocity_n]),
        quaternion_from_attitude(start.attitude_rad),
        _WEIGHTS,
        ("damped", "free", "frozen").index(vertical),
        gains,
        _earth_terms(earth or EarthBelief()),
        every,
    )
    return Solution(rows[:, 0], rows[:, 1], rows[:, 2], rows[:, 3], rows[:, 4:7], rows[:, 7:11])
