"""Pure-inertial mechanization: increments in, position, velocity and attitude out.

Four samples make one step. What the body feels over it comes from `coning_sculling`, in axes that do not turn. The
navigation frame (north-east-down, WGS-84) turns meanwhile: at F, its rate at the mean velocity of the step, and by what
the change of velocity makes of F. Velocity and position keep that to the second order, and the change of gravity and
Coriolis acceleration to the first. The vertical channel is damped by a height of third order, since an undamped one
grows as exp(t sqrt(2 g / R)), 10^6 in two hours.

Sources: navigation equations: Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed., chapter 3;
vertical channel: ibid., section 12.4.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numba
import numpy as np

from ins_eval.coning_sculling import (
    BLOCK_SIZE,
    GAINED,
    MOMENT,
    ROTATION,
    SAMPLES_PER_STEP,
    STEPS_PER_BLOCK,
    add,
    cross,
    fill,
    multiply,
    rotate,
    scaled,
)
from ins_eval.earth import EARTH_RATE, gravity, gravity_of, radii, radii_of
from ins_eval.recording import Start
from ins_eval.recording.belief import EarthBelief

VERTICAL_TIME_CONSTANT_S = 60.0
Vertical = Literal["damped", "free", "frozen"]


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

    angles = Rotation.from_quat(quaternion_nb, scalar_first=True).as_euler("ZYX", suppress_warnings=True)
    return np.ascontiguousarray(angles[..., ::-1])


def quaternion_from_attitude(attitude_rad) -> np.ndarray:
    """Scalar-first quaternions (..., 4), body to navigation frame, of roll, pitch, heading (..., 3)."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_euler("ZYX", np.asarray(attitude_rad, dtype=float)[..., ::-1]).as_quat(scalar_first=True)


@numba.njit(cache=True, inline="always")
def _place(latitude, height, terms):
    """1 / (M + h), 1 / ((N + h) cos L), sine and cosine of L, gravity.

    `terms` holds a factor, 1 or 0, for each term of `EarthBelief`.
    """
    sine, cosine = np.sin(latitude), np.cos(latitude)
    square = sine * sine
    meridian, transverse = radii_of(square)
    weight = gravity_of(terms[4] * square + (1.0 - terms[4]) * 0.5, terms[3] * height)
    return 1.0 / (meridian + height), 1.0 / ((transverse + height) * cosine), sine, cosine, weight


@numba.njit(cache=True, inline="always")
def _transport(place, velocity, factor):
    """Rate at which the navigation frame is carried around the Earth, rad/s."""
    north, east, sine, cosine, _ = place
    rate = factor * east * velocity[1]
    return rate * cosine, -factor * north * velocity[0], -rate * sine


@numba.njit(cache=True, inline="always")
def _rates(place, velocity, terms):
    """Rate of the navigation frame, rad/s; gravity less Coriolis acceleration, m/s^2."""
    sine, cosine, weight = place[2], place[3], place[4]
    transport = _transport(place, velocity, terms[2])
    earth = (terms[0] * EARTH_RATE * cosine, 0.0, -terms[0] * EARTH_RATE * sine)
    turning = add(transport, 2.0 * terms[1], earth)
    fall = cross(velocity, turning)
    return add(transport, 1.0, earth), (fall[0], fall[1], weight + fall[2])


@numba.njit(cache=True, inline="always")
def _small_turn(v):
    """Quaternion of the turn -v of the navigation frame in a step; series to the fifth power of the angle."""
    x = 0.25 * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    sine = -0.5 + x * (1.0 / 12.0 - x * (1.0 / 240.0))
    return 1.0 - x * (0.5 - x * (1.0 / 24.0)), sine * v[0], sine * v[1], sine * v[2]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _navigate(time_s, dtheta_b, dv_b, aid_m, start, attitude, vertical, gains, terms, every):
    """The compiled loop. `vertical` is 0 damped, 1 free, 2 frozen. Returns one row every `every` steps: (m, 11)."""
    steps = dtheta_b.shape[0] // SAMPLES_PER_STEP
    out = np.empty((steps // every + 1, 11))
    block = np.empty(BLOCK_SIZE)
    n = STEPS_PER_BLOCK
    t0, latitude, longitude, height = start[0], start[1], start[2], start[3]
    v = (start[4], start[5], 0.0 if vertical == 2 else start[6])
    q = (attitude[0], attitude[1], attitude[2], attitude[3])
    out[0] = t0, latitude, longitude, height, v[0], v[1], v[2], q[0], q[1], q[2], q[3]
    k1, k2, k3 = gains
    integral = 0.0
    offset = 0.0  # height minus aid at the start of the step
    place = _place(latitude, height, terms)
    frame, acceleration = _rates(place, v, terms)
    change = growth = (0.0, 0.0, 0.0)
    row, left = 1, every
    for begin in range(0, steps, n):
        fill(block, dtheta_b, dv_b, begin)
        unit = 1.5 - 0.5 * (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
        q = (unit * q[0], unit * q[1], unit * q[2], unit * q[3])
        for k in range(min(n, steps - begin)):
            last = 4 * (begin + k) + 3
            t1 = time_s[last]
            dt = t1 - t0
            i, j, m = k + ROTATION, k + GAINED, k + MOMENT
            gained = rotate(q, (block[j], block[j + n], block[j + 2 * n]))
            moment = rotate(q, (block[m], block[m + n], block[m + 2 * n]))
            q = multiply(q, (block[i], block[i + n], block[i + 2 * n], block[i + 3 * n]))
            # the place at the mean of the position, were velocity to change as in the step before
            middle = add(scaled(0.5 * dt, v), dt / 6.0, change)
            place = _place(latitude + place[0] * middle[0], height - middle[2], terms)
            # mean velocity, from the acceleration of the step before and its growth
            lag = cross(frame, gained)
            change = add(add(gained, dt, acceleration), -0.5 * dt, lag)
            mean = add(add(add(v, 0.5, change), -1.0, moment), dt / 12.0, lag)
            mean = add(mean, 5.0 / 12.0 * dt, growth)
            before = acceleration
            frame, acceleration = _rates(place, mean, terms)
            growth = add(acceleration, -1.0, before)
            # final velocity; the navigation frame turns under the specific force, and ever faster
            turned = cross(frame, add(add(scaled(0.5 * dt, gained), dt, moment), -dt * dt * (1.0 / 6.0), lag))
            faster = cross(acceleration, _transport(place, change, terms[2]))
            v = add(add(add(v, 1.0, gained), dt, acceleration), -1.0, turned)
            v = add(v, dt * dt * (1.0 / 12.0), faster)
            if vertical == 2:
                mean = (mean[0], mean[1], 0.0)
                v = (v[0], v[1], 0.0)
            elif vertical == 0:
                if last > 3:
                    offset = height - aid_m[last - 4]
                integral += offset * dt
                v = (v[0], v[1], v[2] + (k2 * offset + k3 * integral) * dt)
                height -= k1 * offset * dt
            latitude += dt * place[0] * mean[0]
            longitude += dt * place[1] * mean[1]
            height -= dt * mean[2]
            q = multiply(_small_turn(scaled(dt, frame)), q)
            t0 = t1
            left -= 1
            if left == 0:
                out[row] = t1, latitude, longitude, height, v[0], v[1], v[2], q[0], q[1], q[2], q[3]
                row, left = row + 1, every
    return out


def damping_gains(latitude_rad: float, height_m: float) -> tuple[float, float, float]:
    """k1 = 3 / tau, k2 = 3 / tau^2 + 2 g / R, k3 = 1 / tau^3 of a vertical channel with a triple pole at 1 / tau."""
    tau = VERTICAL_TIME_CONSTANT_S
    schuler = gravity(latitude_rad, height_m) / (0.5 * sum(radii(latitude_rad)))
    return 3.0 / tau, 3.0 / tau**2 + 2.0 * schuler, 1.0 / tau**3


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
    Damping, e = h - aid:  h' = -v_D - k1 e,  v_D' = ... + k2 e + k3 integral(e), with the `damping_gains` of the start.
    """
    aid = np.full(len(time_s), start.height_m) if height_aid_m is None else height_aid_m
    (solution,) = navigate_arcs(
        np.asarray(time_s, dtype=float),
        lambda first, last: (dtheta_b[first:last], dv_b[first:last]),
        [start],
        [0, len(time_s)],
        np.asarray(aid, dtype=float),
        vertical,
        every,
        earth,
    )
    return solution


def navigate_arcs(
    time_s: np.ndarray,
    increments: Callable[[int, int], tuple[np.ndarray, np.ndarray]],
    starts: Sequence[Start],
    edges: Sequence[int],
    height_aid_m: np.ndarray,
    vertical: Vertical = "damped",
    every: int = 1,
    earth: EarthBelief | None = None,
) -> tuple[Solution, ...]:
    """As `navigate`, from each of m `starts` over the samples from its edge to the next of m + 1 `edges`.

    `increments` gives those of the samples from one row to another: they are made as they are needed.
    """
    quaternions = quaternion_from_attitude([start.attitude_rad for start in starts])
    of_vertical = ("damped", "free", "frozen").index(vertical)
    terms = _earth_terms(earth or EarthBelief())
    solutions = []
    for start, quaternion, first, last in zip(starts, quaternions, edges[:-1], edges[1:], strict=True):
        dtheta_b, dv_b = (np.ascontiguousarray(one, dtype=float) for one in increments(first, last))
        rows = _navigate(
            np.ascontiguousarray(time_s[first:last]),
            dtheta_b,
            dv_b,
            np.ascontiguousarray(height_aid_m[first:last]),
            np.array([start.time_s, start.latitude_rad, start.longitude_rad, start.height_m, *start.velocity_n]),
            quaternion,
            of_vertical,
            damping_gains(start.latitude_rad, start.height_m),
            terms,
            every,
        )
        solutions.append(Solution(rows[:, 0], rows[:, 1], rows[:, 2], rows[:, 3], rows[:, 4:7], rows[:, 7:11]))
    return tuple(solutions)
