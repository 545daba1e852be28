"""The state that is found and its errors; a window of a recording, and what is known of one beforehand."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ins_eval.earth import radii
from ins_eval.recording import Fixes, Start
from ins_eval.recording.stillness import Stretch
from ins_eval.strapdown import SAMPLES_PER_STEP, Solution, quaternion_from_attitude
from ins_eval.units import DEG

STATES = 21
POSITION, VELOCITY, ATTITUDE = slice(0, 3), slice(3, 6), slice(6, 9)
GYRO_BIAS, ACCELEROMETER_BIAS, GYRO_SCALE, ACCELEROMETER_SCALE = (slice(k, k + 3) for k in (9, 12, 15, 18))
MOVING_MPS = 2.0
KNOWN_HEADING_RAD = 45.0 * DEG
HEADING_SIGMA_RAD = 103.0 * DEG  # that of any heading: pi / sqrt(3)
GATE = 5.0  # sigmas beyond which a fix is an outlier


@dataclass(frozen=True, eq=False)
class Initialization:
    """A state to begin at, found from `window`.

    `covariance` (21, 21) belongs to errors, true less found: position (north, east, down) in m, velocity in m/s,
    attitude phi in rad (C_true = exp(phi x) C_found), biases of gyros in rad/s and of accelerometers in m/s^2, which
    are in the outputs beyond what is believed and were found to be `gyro_bias_radps` and `accelerometer_bias_mps2`,
    and scale factor errors, found to be `gyro_scale` and `accelerometer_scale`. `taken` is by how much the state was
    corrected since the prior of the window's first state was about it, and `fix_scale` by how much the fixes scatter
    beyond their sigmas, position and velocity.
    `rival_headings_rad` are others that the window does not rule out.
    """

    start: Start
    gyro_bias_radps: np.ndarray
    accelerometer_bias_mps2: np.ndarray
    covariance: np.ndarray
    window: Stretch
    gyro_scale: np.ndarray = field(default_factory=lambda: np.zeros(3))
    accelerometer_scale: np.ndarray = field(default_factory=lambda: np.zeros(3))
    taken: np.ndarray = field(default_factory=lambda: np.zeros(STATES))
    fix_scale: tuple[float, float] = (1.0, 1.0)
    rival_headings_rad: tuple[float, ...] = ()
    walks: tuple[float, float] = (0.0, 0.0)  # white noise of the increments: rad/sqrt(s), m/s/sqrt(s)
    first_error: np.ndarray | None = None  # smoothed (21,), of the window's first state
    path: Solution | None = None  # smoothed over the window, a row each step
    about: tuple[np.ndarray, np.ndarray] | None = None  # smoothed C (rows, 3, 3), C f (steps, 3): the next pass is
    # linear about them, and not about the noise that the solution has integrated, which would show a heading at rest
    log_likelihood: float = 0.0

    @property
    def sigmas(self) -> np.ndarray:
        """One sigma of each error, (21,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def heading_sigma_rad(self) -> float:
        """That of any heading where this is larger."""
        return float(min(self.sigmas[8], HEADING_SIGMA_RAD))

    @property
    def heading_known(self) -> bool:
        """Whether the window says anything of the heading; where it does not, that of the solution is arbitrary."""
        return self.heading_sigma_rad < KNOWN_HEADING_RAD

    def without_errors(
        self, dtheta_b: np.ndarray, dv_b: np.ndarray, interval_s: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Increments (n, 3) of samples that last `interval_s` (n,), found biases b and scale factor errors s taken off.

        (dtheta - b dt) (1 - s), likewise dv.
        """
        dt = interval_s[:, None]
        return (
            (dtheta_b - self.gyro_bias_radps * dt) * (1.0 - self.gyro_scale),
            (dv_b - self.accelerometer_bias_mps2 * dt) * (1.0 - self.accelerometer_scale),
        )


@dataclass(frozen=True, eq=False)
class Window:
    """What one window holds: increments, what was measured against them, and how good either is."""

    time_s: np.ndarray
    dtheta_b: np.ndarray
    dv_b: np.ndarray
    fixes: Fixes | None
    still_s: np.ndarray  # seconds at rest, (k, 2) begin and end
    still_rate_sigma: np.ndarray  # (3,) of the mean rate over one of them, rad/s
    still_velocity_sigma: float  # of the velocity at the end of one, m/s
    lever_arm_m: np.ndarray
    fix_sigma: tuple[np.ndarray, np.ndarray]  # of position and velocity of each fix
    angle_walk: float  # rad/sqrt(s)
    velocity_walk: float  # m/s/sqrt(s)
    bias_sigma: tuple[float, float]  # turn-on biases of gyros, rad/s, and accelerometers, m/s^2
    course_sigma: float | None  # rad for a drive; None: of a flight, by the wind
    moves_s: float  # when it first moves fast; the begin where it does not


def until(window: Window, end_s: float) -> Window:
    """The part of a window that ends then."""
    n = max(SAMPLES_PER_STEP, int(np.searchsorted(window.time_s, end_s + 1e-6)))
    if n >= len(window.time_s):
        return window
    return replace(window, time_s=window.time_s[:n], dtheta_b=window.dtheta_b[:n], dv_b=window.dv_b[:n])


def wrapped(angle: float) -> float:
    return float((angle + np.pi) % (2.0 * np.pi) - np.pi)


def corrected(state: Initialization, error: np.ndarray) -> Initialization:
    """The state with an error (21,), true less found, taken in."""
    from scipy.spatial.transform import Rotation

    start = state.start
    meridian, transverse = (r + start.height_m for r in radii(start.latitude_rad))
    turned = Rotation.from_rotvec(error[ATTITUDE]) * Rotation.from_quat(
        quaternion_from_attitude(start.attitude_rad), scalar_first=True
    )
    heading, pitch, roll = turned.as_euler("ZYX", suppress_warnings=True)
    return replace(
        state,
        start=replace(
            start,
            latitude_rad=float(start.latitude_rad + error[0] / meridian),
            longitude_rad=float(start.longitude_rad + error[1] / (transverse * np.cos(start.latitude_rad))),
            height_m=float(start.height_m - error[2]),
            velocity_n=tuple(float(v) for v in np.asarray(start.velocity_n) + error[VELOCITY]),
            attitude_rad=(float(roll), float(pitch), float(heading)),
        ),
        gyro_bias_radps=state.gyro_bias_radps + error[GYRO_BIAS],
        accelerometer_bias_mps2=state.accelerometer_bias_mps2 + error[ACCELEROMETER_BIAS],
        gyro_scale=state.gyro_scale + error[GYRO_SCALE],
        accelerometer_scale=state.accelerometer_scale + error[ACCELEROMETER_SCALE],
    )
