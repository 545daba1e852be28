"""Self-alignment at rest: a coarse attitude from gravity and Earth rate, refined by a Kalman filter.

Fine alignment mechanizes the stretch from the coarse attitude and treats the velocity it reports, which should
be zero, as the measurement of a linear error model (psi angles; Titterton and Weston, 2nd ed., section 12.3).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy.spatial.transform import Rotation

from ins_eval.earth import EARTH_RATE, gravity, radii
from ins_eval.errors import DataRefused
from ins_eval.recording import Start
from ins_eval.strapdown import SAMPLES_PER_STEP, attitude_from_quaternion, navigate
from ins_eval.units import DEG, DEG_PER_H, DEG_PER_SQRT_H, UG

COARSE_S = 120.0
UPDATE_S = 10.0
MINIMUM_S = 60.0


@dataclass(frozen=True)
class AlignmentNoise:
    """One sigma of what the fine alignment allows for."""

    gyro_bias_deg_per_h: float = 0.014
    angle_random_walk_deg_per_sqrt_h: float = 0.001
    velocity_random_walk_ug_per_sqrt_hz: float = 10.0
    velocity_mps: float = 2e-3  # sway of a vehicle that stands


@dataclass(frozen=True)
class Alignment:
    """The state at the end of the stretch, ready for navigation; sigmas of roll-pitch (level) and heading in rad."""

    start: Start
    level_sigma_rad: float
    heading_sigma_rad: float
    coarse_attitude_rad: tuple[float, float, float]


def coarse_attitude(mean_rate_b: np.ndarray, mean_force_b: np.ndarray) -> np.ndarray:
    """Roll, pitch, heading from mean body rate (rad/s) and mean specific force (m/s^2) at rest.

    down = -f / |f|,  east = down x w / |down x w|,  north = east x down: the rows of the matrix from b to n.
    """
    down = -mean_force_b / np.linalg.norm(mean_force_b)
    east = _cross(down, mean_rate_b)
    horizontal_rate = np.linalg.norm(east)
    if horizontal_rate < 0.1 * EARTH_RATE:
        raise DataRefused(
            f"alignment: the gyros measure a horizontal rate of {horizontal_rate / DEG_PER_H:.2g} deg/h, expected "
            "about 15 deg/h times the cosine of the latitude; these gyros cannot find north, so give the attitude in "
            "[start]"
        )
    east /= horizontal_rate
    north = _cross(east, down)
    return np.array(
        [np.arctan2(down[1], down[2]), np.arctan2(-down[0], np.hypot(down[1], down[2])), np.arctan2(east[0], north[0])]
    )


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a x b; `np.cross` takes twenty times as long for two vectors."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def align(
    time_s: np.ndarray, dtheta_b: np.ndarray, dv_b: np.ndarray, at: Start, noise: AlignmentNoise | None = None
) -> Alignment:
    """Attitude at the end of a stretch at rest.

    Parameters
    ----------
    time_s, dtheta_b, dv_b : (n,), (n, 3) rad, (n, 3) m/s: increments of the stretch, body axes
    at : known position; `time_s` is where the first sample begins; its attitude is not used
    noise : what the filter allows for

    Returns
    -------
    Alignment, whose `start` is the state at the last sample that was used.

    Raises
    ------
    DataRefused
        The stretch is shorter than a minute, or the gyros do not feel the Earth turn.

    Notes
    -----
    dv' = f x psi,   psi' = -w_in x psi - C eps + dw_in(dv),   z = dv = 0 every 10 s, horizontal only.
    """
    noise = noise or AlignmentNoise()
    duration = time_s[-1] - at.time_s if time_s.size else 0.0
    if duration < MINIMUM_S:
        raise DataRefused(
            f"alignment: {duration:.1f} s at rest, expected at least {MINIMUM_S:g} s; give a longer standstill or the "
            "attitude in [start]"
        )
    first = np.searchsorted(time_s, at.time_s + min(COARSE_S, duration), side="right")
    span = time_s[first - 1] - at.time_s
    coarse = coarse_attitude(dtheta_b[:first].sum(axis=0) / span, dv_b[:first].sum(axis=0) / span)

    sample_s = duration / time_s.size
    every = max(1, round(UPDATE_S / (SAMPLES_PER_STEP * sample_s)))
    usable = time_s.size - time_s.size % (SAMPLES_PER_STEP * every)
    solution = navigate(
        time_s[:usable],
        dtheta_b[:usable],
        dv_b[:usable],
        replace(at, attitude_rad=tuple(coarse), velocity_n=(0.0, 0.0, 0.0)),
        every=every,
    )
    step_s, count = SAMPLES_PER_STEP * every * sample_s, solution.time_s.size - 1
    weights, covariance = filter_weights(at.latitude_rad, at.height_m, step_s, noise, count)
    psi = np.tensordot(weights, solution.velocity_n[1:, :2], 2)
    computed = Rotation.from_quat(solution.quaternion_nb[-1], scalar_first=True)
    roll, pitch, heading = attitude_from_quaternion((Rotation.from_rotvec(psi) * computed).as_quat(scalar_first=True))
    return Alignment(
        start=replace(
            at,
            time_s=float(solution.time_s[-1]),
            velocity_n=(0.0, 0.0, 0.0),
            attitude_rad=(float(roll), float(pitch), float(heading)),
        ),
        level_sigma_rad=float(np.sqrt(covariance[2:4, 2:4].trace() / 2.0)),
        heading_sigma_rad=float(np.sqrt(covariance[4, 4])),
        coarse_attitude_rad=(float(coarse[0]), float(coarse[1]), float(coarse[2])),
    )


@lru_cache(maxsize=4)
def filter_weights(
    latitude_rad: float, height_m: float, step_s: float, noise: AlignmentNoise, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """What the filter makes of `count` velocities north and east, one every step: psi = sum_k W_k v_k.

    Returns W (3, count, 2) and the covariance of [dv_N dv_E psi_N psi_E psi_D eps_N eps_E eps_D] after the last of
    them: no measurement enters either.
    """
    from filterpy.common import van_loan_discretization  # imported here, for both take long
    from filterpy.kalman import KalmanFilter

    g = gravity(latitude_rad, height_m)
    meridian, transverse = (r + height_m for r in radii(latitude_rad))
    north_rate, down_rate = EARTH_RATE * np.cos(latitude_rad), -EARTH_RATE * np.sin(latitude_rad)
    f = np.zeros((8, 8))
    f[0, 3], f[1, 2] = g, -g
    f[0, 1], f[1, 0] = 2.0 * down_rate, -2.0 * down_rate
    f[2:5, 2:5] = -np.array([[0.0, -down_rate, 0.0], [down_rate, 0.0, -north_rate], [0.0, north_rate, 0.0]])
    f[2, 1], f[3, 0], f[4, 1] = 1.0 / transverse, -1.0 / meridian, -np.tan(latitude_rad) / transverse
    f[2:5, 5:8] = -np.eye(3)
    drive = np.diag(
        [UG * noise.velocity_random_walk_ug_per_sqrt_hz] * 2
        + [DEG_PER_SQRT_H * noise.angle_random_walk_deg_per_sqrt_h] * 3
        + [0.0] * 3
    )

    kf = KalmanFilter(dim_x=8, dim_z=2)
    kf.F, kf.Q = van_loan_discretization(f, drive, step_s)
    kf.H = np.eye(2, 8)
    kf.R = np.eye(2) * noise.velocity_mps**2
    bias = DEG_PER_H * noise.gyro_bias_deg_per_h
    kf.P = np.diag([1e-4, 1e-4, 2e-3, 2e-3, 5.0 * DEG, bias, bias, bias]) ** 2
    estimate = np.zeros((8, count, 2))  # of each velocity what it has become in the estimate
    for k in range(count):
        kf.predict()
        kf.update(np.zeros(2))
        estimate = np.tensordot(kf.F - kf.K @ kf.H @ kf.F, estimate, 1)
        estimate[:, k] = kf.K
    return estimate[2:5], kf.P
