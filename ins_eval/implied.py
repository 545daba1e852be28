"""What an ideal IMU would have felt along a reference trajectory: simulation against recording at sensor level.

A better navigator delivers position, velocity and attitude at its epochs. Smooth curves through them have
derivatives, and those are what an IMU feels:

    w = w_nb + C_bn (w_ie + w_en),        f = C_bn (v' + (2 w_ie + w_en) x v - g),        integrated over each sample.

This runs the navigation equations backwards and shares no code with the mechanization. Source: Titterton and
Weston, Strapdown Inertial Navigation Technology, 2nd ed., section 3.7.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.interpolate import CubicHermiteSpline, CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline

from ins_eval.earth import EARTH_RATE, gravity, radii
from ins_eval.errors import DataRefused
from ins_eval.recording import Fixes
from ins_eval.recording.belief import EarthBelief
from ins_eval.reference import MISSING_ROW_FACTOR
from ins_eval.trajectory import Increments

FEWEST_EPOCHS = 4  # that a cubic needs; a shorter piece between two gaps is left out
_CLOCK_ROUNDING_S = 1e-6
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(2)  # error of order (w dt)^4 at frequency w
_CHUNK = 100_000  # samples at a time, to bound the memory


def implied_increments(
    fixes: Fixes,
    time_s: np.ndarray,
    start_s: float,
    time_offset_s: float = 0.0,
    lever_arm_m: tuple[float, float, float] = (0.0, 0.0, 0.0),
    earth: EarthBelief | None = None,
) -> Increments:
    """Increments that the trajectory of a reference implies over the samples of an IMU.

    Attitude is a C2 rotation spline through the epochs, velocity a C2 cubic spline, latitude and height cubic
    Hermite curves with the velocity as slope.

    Parameters
    ----------
    fixes : reference with velocity and attitude; a stamp t means the instant t - `time_offset_s` on the IMU's clock
    time_s, start_s : ends of the samples (n,), and where the first begins, on the IMU's clock
    lever_arm_m : IMU to the point whose velocity the reference gives, body axes
    earth : what the navigation equations contain; None: everything

    Returns
    -------
    Increments at `time_s`: dtheta_b (n, 3) rad, dv_b (n, 3) m/s. Rows are NaN where a sample is not wholly inside
    an unbroken piece of the reference: a gap (row missing, not valid or not a number) is never bridged.

    Raises
    ------
    DataRefused : no attitude, or no piece of the reference with 4 epochs.

    Notes
    -----
    The reference limits the bandwidth. Epochs a period P apart fix the motion below 1/(2 P); what is faster the
    IMU felt and the curves do not show. Near that limit the splines lose amplitude: the cubic's derivative is true to
    (w P)^4 / 180 at its epochs, 2e-4 at 0.7 Hz and 10 Hz epochs. Averages from epoch to epoch hold what the
    reference itself says and next to nothing of the curves between, so compare those.
    """
    usable = _usable(fixes)
    instants = np.asarray(fixes.time_s, dtype=float) - time_offset_s
    begin_s = np.concatenate([[start_s], time_s[:-1]])
    gyro, velocity = np.full((time_s.size, 3), np.nan), np.full((time_s.size, 3), np.nan)
    for piece in _pieces(instants, usable):
        motion = _Motion(fixes, instants, piece, np.asarray(lever_arm_m, dtype=float), earth or EarthBelief())
        first = np.searchsorted(begin_s, instants[piece.start] - _CLOCK_ROUNDING_S)
        last = np.searchsorted(time_s, instants[piece.stop - 1] + _CLOCK_ROUNDING_S)
        for k in range(first, last, _CHUNK):
            rows = slice(k, min(k + _CHUNK, last))
            gyro[rows], velocity[rows] = motion.integrate(begin_s[rows], time_s[rows])
    return Increments(time_s, gyro, velocity)


def epoch_spacing_s(fixes: Fixes) -> float:
    """The usual time between two epochs of a reference."""
    if fixes.time_s.size < 2:
        raise DataRefused(f"reference: {fixes.time_s.size} epoch, expected at least two; give the whole table")
    return float(np.median(np.diff(fixes.time_s)))


def _usable(fixes: Fixes) -> np.ndarray:
    """Epochs (m,) with everything that is needed."""
    if fixes.attitude_rad is None or not np.isfinite(fixes.attitude_rad).any():
        raise DataRefused(
            "reference: it has no attitude, expected roll_deg, pitch_deg and heading_deg; a position alone does not "
            "imply what an IMU measures"
        )
    needed = np.column_stack([fixes.latitude_rad, fixes.height_m, fixes.velocity_n, fixes.attitude_rad])
    return np.asarray(fixes.valid, dtype=bool) & np.isfinite(needed).all(axis=1)


def _pieces(instants: np.ndarray, usable: np.ndarray) -> Iterator[slice]:
    """Unbroken runs of usable epochs."""
    spacing = np.diff(instants)
    joined = usable[1:] & usable[:-1]
    if spacing.size:
        joined &= spacing <= MISSING_ROW_FACTOR * np.median(spacing)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], joined, [0]]).astype(int)))
    pieces = [slice(int(a), int(b) + 1) for a, b in edges.reshape(-1, 2) if b + 1 - a >= FEWEST_EPOCHS]
    if not pieces:
        raise DataRefused(
            f"reference: {np.count_nonzero(usable)} of {usable.size} epochs have position, velocity and attitude, and "
            f"no {FEWEST_EPOCHS} of them follow one another; expected an unbroken stretch"
        )
    yield from pieces


class _Motion:
    """Smooth curves through one piece of a reference, and what an IMU feels along them."""

    def __init__(self, fixes: Fixes, instants: np.ndarray, piece: slice, lever_arm_m: np.ndarray, earth: EarthBelief):
        t, latitude, height = instants[piece], fixes.latitude_rad[piece], fixes.height_m[piece]
        self._earth = earth
        body = Rotation.from_euler("ZYX", fixes.attitude_rad[piece][:, ::-1])
        self._attitude = RotationSpline(t, body)
        velocity = fixes.velocity_n[piece]
        if lever_arm_m.any():
            turning = self._attitude(t, 1) + body.apply(self._transport_rate(latitude, height, velocity), inverse=True)
            velocity = velocity - body.apply(np.cross(turning, lever_arm_m))
        self._velocity = CubicSpline(t, velocity)
        self._latitude = CubicHermiteSpline(t, latitude, velocity[:, 0] / (radii(latitude)[0] + height))
        self._height = CubicHermiteSpline(t, height, -velocity[:, 2])

    def integrate(self, begin_s: np.ndarray, end_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Angular increments (n, 3) in rad and velocity increments (n, 3) in m/s of samples, by quadrature."""
        half = 0.5 * (end_s - begin_s)
        gyro = velocity = np.zeros((half.size, 3))
        for node, weight in zip(_NODES, _WEIGHTS, strict=True):
            rate, force = self._felt(begin_s + (1.0 + node) * half)
            gyro, velocity = gyro + weight * rate, velocity + weight * force
        return half[:, None] * gyro, half[:, None] * velocity

    def _felt(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Body rate against inertial space (n, 3) in rad/s and specific force (n, 3) in m/s^2, body axes."""
        to_body = self._attitude(t).inv()
        velocity, latitude, height = self._velocity(t), self._latitude(t), self._height(t)
        earth_n = self._earth_rate(latitude)
        transport_n = self._transport_rate(latitude, height, velocity)
        turning_n = transport_n + (2.0 * earth_n if self._earth.coriolis else 0.0)
        force_n = self._velocity(t, 1) + np.cross(turning_n, velocity)
        force_n[:, 2] -= gravity(
            latitude if self._earth.gravity_latitude else np.pi / 4.0, height if self._earth.gravity_height else 0.0
        )
        return self._attitude(t, 1) + to_body.apply(earth_n + transport_n), to_body.apply(force_n)

    def _earth_rate(self, latitude: np.ndarray) -> np.ndarray:
        rate = EARTH_RATE if self._earth.rotation else 0.0
        return rate * np.column_stack([np.cos(latitude), np.zeros_like(latitude), -np.sin(latitude)])

    def _transport_rate(self, latitude: np.ndarray, height: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        if not self._earth.transport_rate:
            return np.zeros_like(velocity)
        meridian, transverse = radii(latitude)
        east = velocity[:, 1] / (transverse + height)
        return np.column_stack([east, -velocity[:, 0] / (meridian + height), -east * np.tan(latitude)])
