"""Errors of pure inertial navigation along one true flight, to first order: transition matrices of steps of a second.

    x = [dL, dl, dh, dv_N, dv_E, dv_D, phi_N, phi_E, phi_D, i],   d = INS - truth,   C_INS = exp(phi x) C
    dr' = d(r'),   dv' = phi x f + C df + d(g - (2 w_ie + w_en) x v),   phi' = C dw - dw_in - w_in x phi
    damping by a height with the error w, e = dh - w:   dh' - k1 e,   dv_D' + k2 e + k3 i,   i' = e

The matrix of x' = F x + G u is taken about the truth, its rows for position, velocity and the turning of the navigation
frame by central differences of the navigation equations themselves. A step of length T ends with

    x <- P P x + P u,   P = exp(F T / 2),   u: what was fed in during the step, as if in its middle,

of which the error is of third order in T over the time in which force and attitude change. Drives u: velocity C df dt
and angle C dw dt in the navigation frame, and w.

Sources: Titterton and Weston, 2nd ed., section 12.3; Groves, 2nd ed., section 14.2 (phi angles, local frame).
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from ins_eval.earth import EARTH_RATE, gravity, radii
from ins_eval.strapdown import VERTICAL_TIME_CONSTANT_S
from ins_eval.trajectory import Increments, Trajectory

STATES, DRIVES = 10, 7
ATTITUDE = slice(6, 9)
# Steps of the central differences of latitude, height and velocity: the equations are smooth over many times as much.
_DIFFERENCES = ((0, 1e-5), (2, 100.0), (3, 0.1), (4, 0.1), (5, 0.1))


@dataclass(frozen=True, eq=False)
class Steps:
    """The true flight in n steps that end at `time_s` (n,), and how errors go through each of them.

    mat_nb          (n, 3, 3) mean matrix from body to navigation frame
    force_b, rate_b, turning_b   (n, 3) means of specific force in m/s^2, of body rate and of its size in rad/s
    transition      (n, 10, 10) of the states of the module
    drive           (n, 10, 7) of velocity, angle and error of the height aid that are fed in
    """

    step_s: float
    time_s: np.ndarray
    mat_nb: np.ndarray
    force_b: np.ndarray
    rate_b: np.ndarray
    turning_b: np.ndarray
    transition: np.ndarray
    drive: np.ndarray

    def __getitem__(self, rows: slice) -> Steps:
        """Some of the steps."""
        columns = (self.time_s, self.mat_nb, self.force_b, self.rate_b, self.turning_b, self.transition, self.drive)
        return Steps(self.step_s, *(column[rows] for column in columns))


def steps_of(trajectory: Trajectory, true: Increments, every: int) -> Steps:
    """The steps of a flight, `every` samples of its `true` increments each; samples after the last whole one are left.

    The vertical channel is damped as `strapdown.navigate` damps it from the place of the start.
    """
    count = true.time_s.size // every
    used = count * every
    sample_s = (true.time_s[-1] - trajectory.start_s) / true.time_s.size
    attitude = trajectory.truth(true.time_s[:used] - 0.5 * sample_s).attitude_rad
    mat_nb, fed_n = _turned(attitude, true.dv_b[:used], every)
    step_s = every * sample_s

    def mean(samples: np.ndarray) -> np.ndarray:
        return samples[:used].reshape(count, every, *samples.shape[1:]).mean(axis=1)

    end_s = true.time_s[every - 1 : used : every]
    middle = trajectory.truth(end_s - 0.5 * step_s)
    start = trajectory.truth(np.array([trajectory.start_s]))
    transition, drive = _matrices(
        np.column_stack((middle.latitude_rad, middle.longitude_rad, middle.height_m, middle.velocity_n)),
        fed_n / sample_s,
        _damping_gains(float(start.latitude_rad[0]), float(start.height_m[0])),
        step_s,
    )
    rate_b, force_b = mean(true.dtheta_b) / sample_s, mean(true.dv_b) / sample_s
    return Steps(step_s, end_s, mat_nb, force_b, rate_b, mean(np.abs(true.dtheta_b)) / sample_s, transition, drive)


@numba.njit(cache=True)
def _turned(attitude_rad, dv_b, every):
    """Means over `every` samples of the matrix from body to navigation frame, (n, 3, 3), and of C dv, (n, 3)."""
    count = attitude_rad.shape[0] // every
    mat_nb, fed_n = np.zeros((count, 3, 3)), np.zeros((count, 3))
    for k in range(count * every):
        sr, cr = np.sin(attitude_rad[k, 0]), np.cos(attitude_rad[k, 0])
        st, ct = np.sin(attitude_rad[k, 1]), np.cos(attitude_rad[k, 1])
        sp, cp = np.sin(attitude_rad[k, 2]), np.cos(attitude_rad[k, 2])
        rows = (
            (ct * cp, sr * st * cp - cr * sp, cr * st * cp + sr * sp),
            (ct * sp, sr * st * sp + cr * cp, cr * st * sp - sr * cp),
            (-st, sr * ct, cr * ct),
        )
        x, y, z = dv_b[k]
        for i in range(3):
            a, b, c = rows[i]
            mean = mat_nb[k // every, i]
            mean[0] += a / every
            mean[1] += b / every
            mean[2] += c / every
            fed_n[k // every, i] += (a * x + b * y + c * z) / every
    return mat_nb, fed_n


def _damping_gains(latitude_rad: float, height_m: float) -> np.ndarray:
    """k1, k2, k3 of the vertical channel of `strapdown.navigate` that begins at a place."""
    tau = VERTICAL_TIME_CONSTANT_S
    schuler = gravity(latitude_rad, height_m) / np.mean(radii(latitude_rad))
    return np.array([3.0 / tau, 3.0 / tau**2 + 2.0 * schuler, 1.0 / tau**3])


@numba.njit(cache=True)
def _rates(x, f, out):
    """Rates of position and velocity and the turning of the navigation frame, (9,), of x (6,) and force f (3,)."""
    latitude, height = x[0], x[2]
    meridian, transverse = radii(latitude)
    sine, cosine = np.sin(latitude), np.cos(latitude)
    east_rate = x[4] / (transverse + height)
    en_n, en_e, en_d = east_rate, -x[3] / (meridian + height), -east_rate * sine / cosine
    ie_n, ie_d = EARTH_RATE * cosine, -EARTH_RATE * sine
    w_n, w_e, w_d = 2.0 * ie_n + en_n, en_e, 2.0 * ie_d + en_d
    out[0], out[1], out[2] = x[3] / (meridian + height), east_rate / cosine, -x[5]
    out[3] = f[0] - (w_e * x[5] - w_d * x[4])
    out[4] = f[1] - (w_d * x[3] - w_n * x[5])
    out[5] = f[2] + gravity(latitude, height) - (w_n * x[4] - w_e * x[3])
    out[6], out[7], out[8] = ie_n + en_n, en_e, ie_d + en_d


@numba.njit(cache=True)
def _turning(a, out):
    """Write -(a x) into the 3 x 3 block `out`."""
    out[0, 1], out[0, 2], out[1, 2] = a[2], -a[1], a[0]
    out[1, 0], out[2, 0], out[2, 1] = -a[2], a[1], -a[0]


@numba.njit(cache=True)
def _product(a, b, out):
    """a b of square matrices; rows of `a` that begin with zeros, as most of these do, cost less."""
    out[:] = 0.0
    for i in range(a.shape[0]):
        for k in range(a.shape[1]):
            factor = a[i, k]
            if factor != 0.0:
                for j in range(b.shape[1]):
                    out[i, j] += factor * b[k, j]


@numba.njit(cache=True)
def _matrices(true, force_n, gains, step_s):
    """Transition (n, 10, 10) and drive (n, 10, 7) about position and velocity `true` (n, 6) and force (n, 3)."""
    count = true.shape[0]
    transition, drive = np.empty((count, STATES, STATES)), np.empty((count, STATES, DRIVES))
    above, below, x = np.empty(9), np.empty(9), np.empty(6)
    f, p = np.empty((STATES, STATES)), np.empty((STATES, STATES))
    term, following = np.empty_like(f), np.empty_like(f)
    damped = np.zeros(STATES)  # what the error of the height aid does
    damped[2], damped[5], damped[9] = gains[0], -gains[1], -1.0
    for k in range(count):
        f[:] = 0.0
        for column, step in _DIFFERENCES:
            x[:] = true[k]
            x[column] += step
            _rates(x, force_n[k], above)
            x[column] -= 2.0 * step
            _rates(x, force_n[k], below)
            f[:6, column] = (above[:6] - below[:6]) / (2.0 * step)
            f[6:9, column] = (below[6:] - above[6:]) / (2.0 * step)
        _rates(true[k], force_n[k], above)
        _turning(force_n[k], f[3:6, 6:9])
        _turning(above[6:], f[6:9, 6:9])
        f[:, 2] -= damped
        f[5, 9] = gains[2]
        f *= 0.5 * step_s
        p[:], term[:] = f, f
        for i in range(STATES):
            p[i, i] += 1.0
        for order in range(2, 5):
            _product(f, term, following)
            term[:] = following / order
            p += term
        _product(p, p, transition[k])
        drive[k, :, :6] = p[:, 3:9]
        drive[k, :, 6] = step_s * (p @ damped)
    return transition, drive


@numba.njit(cache=True, nogil=True, fastmath={"contract"})
def advance(x, u, transition, drive, scratch):
    """Take the errors x (10, m) through one step with the drives u (7, m), in place; `scratch` is like x."""
    for row in range(STATES):
        a, b = transition[row], drive[row]
        for j in range(x.shape[1]):  # one sum, so that the processor takes several errors at once
            scratch[row, j] = (
                a[0] * x[0, j] + a[2] * x[2, j] + a[3] * x[3, j] + a[4] * x[4, j] + a[5] * x[5, j]
                + a[6] * x[6, j] + a[7] * x[7, j] + a[8] * x[8, j] + a[9] * x[9, j]
                + b[0] * u[0, j] + b[1] * u[1, j] + b[2] * u[2, j]
                + b[3] * u[3, j] + b[4] * u[4, j] + b[5] * u[5, j] + b[6] * u[6, j]
            )  # fmt: skip
    for j in range(x.shape[1]):
        scratch[1, j] += x[1, j]  # a longitude acts on nothing but itself
    x[:] = scratch
