"""A first guess of a window's first state and its covariance: level from gravity, heading from the match of motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ins_eval.earth import EARTH_RATE, gravity, radii
from ins_eval.initialization.state import (
    ACCELEROMETER_BIAS,
    ACCELEROMETER_SCALE,
    ATTITUDE,
    GYRO_BIAS,
    GYRO_SCALE,
    HEADING_SIGMA_RAD,
    POSITION,
    STATES,
    VELOCITY,
    Initialization,
    Window,
    wrapped,
)
from ins_eval.recording import Fixes, Recording, Start
from ins_eval.recording.belief import EarthBelief
from ins_eval.recording.stillness import Stretch
from ins_eval.strapdown import navigate
from ins_eval.units import DEG, DEG_PER_H

GUESSED_VELOCITY_MPS = 5.0  # sigma of the first velocity where it was differentiated
STATED_HEADING_RAD = 5.0 * DEG
TILT_SIGMA_RAD = 10.0 * DEG  # of a first guess
CARRIED_RAD = 2.0 * DEG  # of an attitude that gyros carried back, by their scale factors and the way: by reasoning
# Scale factor error and turn-on bias of gyros on data sheets of ring lasers to MEMS (5e-6 with 0.005 deg/h, 1.5e-4 with
# 1 deg/h, 5e-4 with 250 deg/h, 1e-2 with 1800 deg/h, 3e-2 with 5 deg/s) lie about a line of logarithms
SCALE_SIGMA, SCALE_BIAS_RADPS, SCALE_EXPONENT = 5e-3, 1200.0 * DEG_PER_H, 0.6
STILL_EARTH = EarthBelief(
    rotation=False, coriolis=False, transport_rate=False, gravity_height=False, gravity_latitude=False
)


def first_variances(recording: Recording, window: Window, still: bool) -> np.ndarray:
    """Covariance (21,) of a first guess, squared sigmas."""
    gyro, force = window.bias_sigma
    scale = SCALE_SIGMA * (gyro / SCALE_BIAS_RADPS) ** SCALE_EXPONENT
    sigma = np.empty(STATES)
    sigma[POSITION] = 3.0 * window.fix_sigma[0].max(initial=1.0)
    velocity = window.fix_sigma[1]
    derived = velocity.size > 0 and not velocity.any()
    moving = GUESSED_VELOCITY_MPS if derived else max(1.0, 10.0 * velocity.max(initial=0.0))
    sigma[VELOCITY] = window.still_velocity_sigma if still else moving
    sigma[ATTITUDE] = TILT_SIGMA_RAD, TILT_SIGMA_RAD, stated_heading_sigma(recording)
    sigma[GYRO_BIAS], sigma[ACCELEROMETER_BIAS] = gyro, force
    sigma[GYRO_SCALE], sigma[ACCELEROMETER_SCALE] = scale, scale
    return sigma**2


def stated_heading_sigma(recording: Recording) -> float:
    """That of any heading where none is stated; a stated one without sigma is believed to 5 degrees."""
    if recording.start.attitude_rad is None:
        return HEADING_SIGMA_RAD
    stated = recording.start.attitude_sigma_rad
    return min(HEADING_SIGMA_RAD, STATED_HEADING_RAD if stated is None else stated[2])


def first_guess(recording: Recording, window: Window, begin_s: float, still: bool) -> Initialization:
    """Level from gravity at rest, else attitude from the match of specific force and the velocities of the fixes."""
    start, fixes = recording.start, window.fixes
    gyro_bias = np.zeros(3)
    rest = window.time_s <= begin_s
    if window.still_s.size:
        spans = [(window.time_s > a) & (window.time_s <= b) for a, b in window.still_s]
        rest = np.any(spans, axis=0)
        gyro_bias = window.dtheta_b[rest].sum(axis=0) / window.still_s.shape[0]
        if np.linalg.norm(gyro_bias) < 3.0 * EARTH_RATE:  # as good as the turn of the Earth: the filter separates them
            gyro_bias = np.zeros(3)
    start = _placed(start, fixes, begin_s)
    if still:
        start = replace(start, velocity_n=(0.0, 0.0, 0.0))
        first = window.dv_b[rest & (window.time_s <= window.still_s[0, 0] + 10.0)]
        down = -first.sum(axis=0) / np.linalg.norm(first.sum(axis=0))
        attitude = (float(np.arctan2(down[1], down[2])), float(np.arcsin(np.clip(-down[0], -1.0, 1.0))), 0.0)
    elif fixes is not None:
        attitude = _matched(window, start, gyro_bias)
    else:
        attitude = (0.0, 0.0, 0.0)
    if recording.start.attitude_rad is not None:
        attitude = (*attitude[:2], recording.start.attitude_rad[2])
    start = replace(start, attitude_rad=attitude)
    return Initialization(
        start, gyro_bias, np.zeros(3), np.zeros((STATES, STATES)), Stretch(begin_s, float(window.time_s[-1]))
    )


def _placed(start: Start, fixes: Fixes | None, begin_s: float) -> Start:
    """A start at `begin_s`, in place and velocity of the first fix, or at rest where `start` is."""
    place = {"time_s": begin_s, "velocity_n": (0.0, 0.0, 0.0)}
    if fixes is not None and fixes.time_s.size and np.isfinite(fixes.latitude_rad).any():
        k = int(np.argmax(np.isfinite(fixes.latitude_rad)))
        v = np.nan_to_num(fixes.velocity_n[k])
        meridian, transverse = radii(float(fixes.latitude_rad[k]))
        back_s = float(fixes.time_s[k] - begin_s)
        height_m = float(fixes.height_m[k] + v[2] * back_s)
        place |= {
            "latitude_rad": float(fixes.latitude_rad[k] - v[0] * back_s / meridian),
            "longitude_rad": float(
                fixes.longitude_rad[k] - v[1] * back_s / (transverse * np.cos(fixes.latitude_rad[k]))
            ),
            "height_m": height_m if np.isfinite(height_m) else start.height_m,
            "velocity_n": tuple(float(one) for one in v),
        }
    return replace(start, **place, attitude_sigma_rad=None, still_until_s=None)


def carried_back(
    recording: Recording, begin: Initialization, window: Window, dtheta_b: np.ndarray, dv_b: np.ndarray
) -> Initialization:
    """The state at the first of the samples (n, 3) before the window of `begin`, of which `window` is the first part.

    C(0) = exp(w_ie T x) C(T) B', where gyros turn by B in T; place and velocity are those of the first fix.
    """
    from scipy.spatial.transform import Rotation

    first_s, then = recording.start.time_s, begin.path
    time_s = recording.imu.time_s[: len(dtheta_b)]
    right = begin.without_errors(dtheta_b, dv_b, np.diff(time_s, prepend=first_s))
    level = replace(recording.start, velocity_n=(0.0, 0.0, 0.0), attitude_rad=(0.0, 0.0, 0.0))
    turned_b = navigate(time_s, *right, level, None, "free", earth=STILL_EARTH).quaternion_nb[-1]
    span_s, latitude = float(then.time_s[0] - first_s), float(then.latitude_rad[0])
    earth = Rotation.from_rotvec(EARTH_RATE * span_s * np.array([np.cos(latitude), 0.0, -np.sin(latitude)]))
    at, by = (Rotation.from_quat(one, scalar_first=True) for one in (then.quaternion_nb[0], turned_b))
    heading, pitch, roll = (earth * at * by.inv()).as_euler("ZYX", suppress_warnings=True)
    start = replace(_placed(recording.start, window.fixes, first_s), attitude_rad=(roll, pitch, heading))

    variances = first_variances(recording, window, still=False)
    drift = float(begin.sigmas[GYRO_BIAS].max()) * span_s
    variances[ATTITUDE] = np.minimum(begin.sigmas[ATTITUDE] + drift + CARRIED_RAD, HEADING_SIGMA_RAD) ** 2
    covariance = np.diag(variances)
    errors = slice(GYRO_BIAS.start, STATES)
    covariance[errors, errors] = begin.covariance[errors, errors]
    return replace(begin, start=start, covariance=covariance)


def _matched(window: Window, start: Start, gyro_bias: np.ndarray) -> tuple[float, float, float]:
    """Attitude at the start for which integrated specific force agrees best with the velocities (Wahba's problem).

    v_k - v_j - g (t_k - t_j) e_D = C s_jk,   s the specific force integrated in the axes of the start.
    """
    from scipy.spatial.transform import Rotation

    at = replace(start, velocity_n=(0.0, 0.0, 0.0), attitude_rad=(0.0, 0.0, 0.0))
    interval_s = np.diff(window.time_s, prepend=start.time_s)[:, None]
    turning = navigate(
        window.time_s, window.dtheta_b - gyro_bias * interval_s, window.dv_b, at, None, "free", earth=STILL_EARTH
    )
    g = gravity(0.25 * np.pi, 0.0)
    felt = turning.velocity_n - g * (turning.time_s - turning.time_s[0])[:, None] * [0.0, 0.0, 1.0]
    fixes = window.fixes
    use = np.isfinite(fixes.velocity_n).all(axis=1) & (fixes.time_s <= turning.time_s[-1])
    at_s, velocity = fixes.time_s[use], fixes.velocity_n[use]
    felt_at = np.column_stack([np.interp(at_s, turning.time_s, column) for column in felt.T])
    apart = max(1, round(1.0 / max(1e-3, float(np.median(np.diff(at_s)))))) if at_s.size > 1 else 1
    if at_s.size <= apart + 1:
        return (0.0, 0.0, 0.0)
    wanted = velocity[apart:] - velocity[:-apart]
    wanted[:, 2] -= g * (at_s[apart:] - at_s[:-apart])
    turn, _ = Rotation.align_vectors(wanted, felt_at[apart:] - felt_at[:-apart])
    heading, pitch, roll = turn.as_euler("ZYX", suppress_warnings=True)
    return float(roll), float(pitch), float(heading)


def turned(guess: Initialization, angle: float) -> Initialization:
    """The guess with another heading."""
    roll, pitch, heading = guess.start.attitude_rad
    return replace(guess, start=replace(guess.start, attitude_rad=(roll, pitch, wrapped(heading + angle))))
