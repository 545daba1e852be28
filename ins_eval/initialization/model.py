"""The linear error model of a window that was navigated, and the measurements of its errors."""

from __future__ import annotations

import numpy as np

from ins_eval.earth import EARTH_RATE, gravity, radii
from ins_eval.initialization.state import (
    ACCELEROMETER_BIAS,
    ACCELEROMETER_SCALE,
    ATTITUDE,
    GYRO_BIAS,
    GYRO_SCALE,
    HEADING_SIGMA_RAD,
    MOVING_MPS,
    POSITION,
    STATES,
    VELOCITY,
    Initialization,
    Window,
    wrapped,
)
from ins_eval.strapdown import SAMPLES_PER_STEP, Solution, navigate

# of its turn-on sigma that a bias wanders in a minute: 20 s means of a parked VN-100, whose offsets are 100 to 1400
# deg/h, differ by 5 to 8 deg/h (note of the recording mems_static_warmup), half of which is white
BIAS_WALK = 0.003
BLOCKS = {"position": POSITION, "velocity": VELOCITY, "attitude": ATTITUDE, "gyro_bias": GYRO_BIAS}
WIND_MPS = 12.0  # turns the nose of a craft in flight away from its course


def navigated(window: Window, begin: Initialization) -> tuple[Solution, np.ndarray, np.ndarray]:
    """The solution, a row each step of four samples, with mean specific force and rate of each step, body axes."""
    interval_s = np.diff(window.time_s, prepend=begin.start.time_s)
    dtheta_b, dv_b = begin.without_errors(window.dtheta_b, window.dv_b, interval_s)
    solution = navigate(window.time_s, dtheta_b, dv_b, begin.start, None, "free")
    steps = len(solution.time_s) - 1
    by_step = slice(0, steps * SAMPLES_PER_STEP)
    length = np.diff(solution.time_s)[:, None]
    force_b = dv_b[by_step].reshape(steps, SAMPLES_PER_STEP, 3).sum(axis=1) / length
    rate_b = dtheta_b[by_step].reshape(steps, SAMPLES_PER_STEP, 3).sum(axis=1) / length
    return solution, force_b, rate_b


def matrices(quaternion_nb: np.ndarray) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    return Rotation.from_quat(quaternion_nb, scalar_first=True).as_matrix()


def moved(solution: Solution, mat_nb: np.ndarray, errors: np.ndarray) -> Solution:
    """The solution, whose attitude is `mat_nb`, with errors (rows, 21), true less solution, taken in."""
    from scipy.spatial.transform import Rotation

    meridian, transverse = (r + solution.height_m for r in radii(solution.latitude_rad))
    turned = Rotation.from_rotvec(errors[:, ATTITUDE]) * Rotation.from_matrix(mat_nb)
    return Solution(
        solution.time_s,
        solution.latitude_rad + errors[:, 0] / meridian,
        solution.longitude_rad + errors[:, 1] / (transverse * np.cos(solution.latitude_rad)),
        solution.height_m - errors[:, 2],
        solution.velocity_n + errors[:, VELOCITY],
        turned.as_quat(scalar_first=True),
    )


def _cross(v: np.ndarray) -> np.ndarray:
    """The matrices (..., 3, 3) of v x."""
    out = np.zeros((*v.shape, 3))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    return out - np.swapaxes(out, -1, -2)


def _turning(solution: Solution) -> tuple[np.ndarray, np.ndarray]:
    """Rate of the Earth and transport rate (steps, 3) in the navigation frame."""
    latitude, v = solution.latitude_rad[:-1], solution.velocity_n[:-1]
    meridian, transverse = (r + solution.height_m[:-1] for r in radii(latitude))
    earth = EARTH_RATE * np.column_stack([np.cos(latitude), np.zeros_like(latitude), -np.sin(latitude)])
    return earth, np.column_stack([v[:, 1] / transverse, -v[:, 0] / meridian, -v[:, 1] * np.tan(latitude) / transverse])


def specific_force(solution: Solution, velocity_n: np.ndarray) -> np.ndarray:
    """Specific force (steps, 3) in the navigation frame that makes these velocities: v' + (2 w_ie + w_en) x v - g."""
    earth, transport = _turning(solution)
    middle = 0.5 * (velocity_n[:-1] + velocity_n[1:])
    force = np.diff(velocity_n, axis=0) / np.diff(solution.time_s)[:, None] + np.cross(2.0 * earth + transport, middle)
    force[:, 2] -= gravity(solution.latitude_rad[:-1], solution.height_m[:-1])
    return force


def dynamics(window: Window, solution: Solution, about, force_b, rate_b) -> tuple[np.ndarray, np.ndarray]:
    """Transitions (steps, 21, 21) and variances (steps, 21) that each step adds; linear `about` C and C f."""
    c, force_n = about
    rest = np.zeros(len(force_n), dtype=bool)
    for begin_s, end_s in window.still_s:
        rest |= (solution.time_s[:-1] >= begin_s) & (
            solution.time_s[1:] <= end_s + solution.time_s[1] - solution.time_s[0]
        )
    force_n = np.where(rest[:, None], force_n * [0.0, 0.0, 1.0], force_n)  # at rest it is gravity
    middle = 0.5 * (c[:-1] + c[1:])
    dt = np.diff(solution.time_s)
    latitude, height = solution.latitude_rad[:-1], solution.height_m[:-1]
    earth, transport = _turning(solution)
    f = np.zeros((len(dt), STATES, STATES))
    f[:, POSITION, VELOCITY] = np.eye(3)
    f[:, 5, 2] = 2.0 * gravity(float(latitude[0]), float(height[0])) / (radii(latitude)[0] + height)
    f[:, VELOCITY, VELOCITY] = -_cross(2.0 * earth + transport)
    f[:, VELOCITY, ATTITUDE] = -_cross(force_n)
    f[:, ATTITUDE, ATTITUDE] = -_cross(earth + transport)
    f[:, ATTITUDE, GYRO_BIAS] = -middle
    f[:, VELOCITY, ACCELEROMETER_BIAS] = -middle
    f[:, ATTITUDE, GYRO_SCALE] = -middle * rate_b[:, None, :]
    f[:, VELOCITY, ACCELEROMETER_SCALE] = -middle * force_b[:, None, :]
    f *= dt[:, None, None]
    f[:, :9] += 0.5 * f[:, :9, :9] @ f[:, :9]  # constants have no rows
    diagonal = np.arange(STATES)
    f[:, diagonal, diagonal] += 1.0
    q = np.zeros((len(dt), STATES))
    q[:, VELOCITY], q[:, ATTITUDE] = window.velocity_walk**2, window.angle_walk**2
    q[:, GYRO_BIAS], q[:, ACCELEROMETER_BIAS] = (BIAS_WALK**2 / 60.0 * sigma**2 for sigma in window.bias_sigma)
    return f, q * dt[:, None]


def measured(window: Window, begin: Initialization, solution: Solution, c, about, rate_b):
    """What was measured less the solution, whose attitude is `c`; designs are linear about the attitude `about`.

    Rows of the solution (k,), kinds (k,), values z (k, 3), designs (k, 3, 21) and variances (k, 3).

    Kinds are position 0, velocity 1, zero velocity 2, zero rate 3, course 4. What is not measured has a variance of 0.
    """
    parts = [*_of_fixes(window, solution, c, rate_b), *_of_rest(window, solution, c, about, rate_b)]
    if not any(len(row) for row, *_ in parts):
        return (np.empty(0, int), np.empty(0, int), np.empty((0, 3)), np.empty((0, 3, STATES)), np.empty((0, 3)))
    row, kind, z, h, variance = (np.concatenate(one) for one in zip(*parts, strict=True))
    order = np.argsort(row, kind="stable")
    variance = np.where(np.isfinite(z), variance, 0.0)
    return row[order], kind[order], np.nan_to_num(z[order]), h[order], variance[order]


def _part(kind: int, row: np.ndarray, z: np.ndarray, variance, **design: np.ndarray):
    """Rows of one kind; `design` gives blocks (k, 3, 3) or (3, 3) of the states that it names."""
    h = np.zeros((len(row), 3, STATES))
    for name, block in design.items():
        h[:, :, BLOCKS[name]] = block
    return row, np.full(len(row), kind), z, h, np.broadcast_to(variance, z.shape)


def _of_fixes(window: Window, solution: Solution, c, rate_b) -> list:
    """Positions, velocities and the course of the fixes within the solution."""
    fixes, arm, time_s = window.fixes, window.lever_arm_m, solution.time_s
    if fixes is None:
        return []
    k = np.flatnonzero(fixes.time_s <= time_s[-1])
    at = np.clip(np.searchsorted(time_s, fixes.time_s), 1, len(time_s) - 1)
    j = at[k]
    x = np.clip((fixes.time_s[k] - time_s[j - 1]) / (time_s[j] - time_s[j - 1]), 0.0, 1.0)[:, None]
    meridian, transverse = (r + solution.height_m[0] for r in radii(solution.latitude_rad[0]))
    metre = np.array([meridian, transverse * np.cos(solution.latitude_rad[0]), -1.0])
    place = np.column_stack([solution.latitude_rad, np.unwrap(solution.longitude_rad), solution.height_m])
    seen = np.column_stack([fixes.latitude_rad, fixes.longitude_rad, fixes.height_m])[k]
    arm_n = c[j] @ arm
    arm_v = np.einsum("nij,nj->ni", c[j], np.cross(rate_b[j - 1], arm))
    p = (1.0 - x) * place[j - 1] + x * place[j]
    v = (1.0 - x) * solution.velocity_n[j - 1] + x * solution.velocity_n[j]
    away = seen - p
    away[:, 1] = np.remainder(away[:, 1] + np.pi, 2.0 * np.pi) - np.pi  # across the date line
    sigma = [one[k, None] ** 2 for one in window.fix_sigma]
    return [
        _part(0, j, away * metre - arm_n, sigma[0], position=np.eye(3), attitude=-_cross(arm_n)),
        _part(1, j, fixes.velocity_n[k] - v - arm_v, sigma[1], velocity=np.eye(3), attitude=-_cross(arm_v)),
        *_of_course(window, solution, at),
    ]


def _of_rest(window: Window, solution: Solution, c, about, rate_b) -> list:
    """Zero velocity at the end, and the mean rate, of every second at rest."""
    time_s = solution.time_s
    last = np.searchsorted(time_s, window.still_s[:, 1])
    use = (last < len(time_s)) & (window.still_s[:, 1] > window.still_s[:, 0])
    begin_s = window.still_s[use, 0]
    last = last[use]
    first = np.searchsorted(time_s, begin_s)
    zero = _part(2, last, -solution.velocity_n[last], window.still_velocity_sigma**2, velocity=np.eye(3))
    some = last > first
    first, last = first[some], last[some]
    latitude = solution.latitude_rad[0]
    earth_n = EARTH_RATE * np.array([np.cos(latitude), 0.0, -np.sin(latitude)])
    summed = np.vstack([np.zeros((1, 3)), np.cumsum(rate_b, axis=0)])
    z = (summed[last] - summed[first]) / (last - first)[:, None] - np.swapaxes(c[last], 1, 2) @ earth_n
    turn = np.swapaxes(about[last], 1, 2) @ _cross(earth_n)
    return [zero, _part(3, last, z, window.still_rate_sigma**2, gyro_bias=np.eye(3), attitude=turn)]


def _of_course(window: Window, solution: Solution, at: np.ndarray) -> list:
    """The nose points along the course at the fastest fix, as far as such a vehicle does."""
    v = window.fixes.velocity_n
    speed = np.where(np.isfinite(v).all(axis=1), np.hypot(v[:, 0], v[:, 1]), 0.0)
    if not speed.size or speed.max() < MOVING_MPS:
        return []
    k = int(np.argmax(speed))
    if window.fixes.time_s[k] > solution.time_s[-1]:
        return []
    sigma = window.course_sigma or min(HEADING_SIGMA_RAD, np.arctan2(WIND_MPS, speed[k]))
    away = wrapped(np.arctan2(v[k, 1], v[k, 0]) - solution.attitude_rad[at[k], 2])
    return [_part(4, at[k : k + 1], np.array([[away, np.nan, np.nan]]), sigma**2, attitude=np.eye(3)[[2, 0, 1]])]
