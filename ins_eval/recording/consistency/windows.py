"""The gyros against the accelerometers, by the velocity alone.

Whatever way the vehicle points, over a window of 8 s the specific force turned by the gyros alone, R f, is dv/dt - g
but for a rotation:

    min over C_w of  sum |dv - g dt - C_w sum R f dt|^2       (Wahba's problem; only singular values are needed)

That tells the order of one triad against the other and whether they are right-handed, of 96 in all. An offset of the
gyros turns R f as well: what they turn by on the mean is taken off, where that makes the best alternative better.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ins_eval.recording import Recording
from ins_eval.recording.consistency.alternatives import MATRICES, NU
from ins_eval.units import DEG, DEG_PER_H, STANDARD_GRAVITY

RATE_FACTORS = np.array([1.0, DEG, 1.0 / DEG, DEG_PER_H, 1.0 / DEG_PER_H, DEG_PER_H / DEG, DEG / DEG_PER_H])
RELATIVE_FACTORS = RATE_FACTORS[:4]
INTERVAL_S = 1.0  # over which velocities are differenced
OFFSETS_S = np.arange(-0.6, 0.61, 0.1)  # of the clocks, tried for every relation
WINDOW_S, STEP_S, MARGIN_S = 8.0, 0.05, 0.6
MOST_WINDOWS, FEWEST_WINDOWS = 16, 3
WINDOW_FLOOR_MPS = 0.05  # of a difference of two velocities


@dataclass(frozen=True)
class Integrals:
    """Angle (3, n) in rad and velocity (3, n) in m/s summed up to each time, thinned to about `STEP_S`."""

    time_s: np.ndarray
    angle: np.ndarray
    velocity: np.ndarray

    def rates(self, name: str, first_s: np.ndarray, last_s: np.ndarray) -> np.ndarray:
        """Mean rate between two times; NaN outside the recording."""
        values = getattr(self, name)
        at = [np.column_stack([np.interp(t, self.time_s, line) for line in values]) for t in (first_s, last_s)]
        mean = (at[1] - at[0]) / (last_s - first_s)[:, None]
        mean[(first_s < self.time_s[0]) | (last_s > self.time_s[-1])] = np.nan
        return mean


def integrated(recording: Recording) -> Integrals | None:
    """Pulses are turned to m/s by the believed scale; None where there is none."""
    imu = recording.imu
    per_unit = np.ones(3)
    if imu.accelerometer_form == "pulse":
        believed = recording.belief.accelerometer
        scales = [axis.scale.gamma if axis and axis.scale else None for axis in (believed.x, believed.y, believed.z)]
        if None in scales:
            return None
        per_unit = STANDARD_GRAVITY / np.array(scales)
    time_s = np.append(recording.start.time_s, imu.time_s)
    kept = slice(None, None, max(1, int(STEP_S / max(float(np.median(np.diff(time_s))), 1e-9) + 1e-6)))

    def summed(increments: np.ndarray) -> np.ndarray:
        return np.ascontiguousarray(np.vstack([np.zeros((1, 3)), np.cumsum(increments, axis=0)])[kept].T)

    return Integrals(time_s[kept], summed(imu.gyro), summed(imu.accelerometer * per_unit))


def relative_scores(integrals: Integrals, at_s, velocity_n, down: float) -> np.ndarray | None:
    """log L (2, 48, 4): handedness of the accelerometers, gyros against them, unit of the gyros; None if untold."""
    windows = _windows(integrals, at_s, velocity_n)
    if windows is None:
        return None
    begin_s, rows = windows
    grid_s = begin_s[:, None] - MARGIN_S + STEP_S * np.arange(round((WINDOW_S + 2 * MARGIN_S) / STEP_S) + 1)
    angle, speed = (
        np.stack([np.interp(grid_s, integrals.time_s, line) for line in values], axis=-1)
        for values in (integrals.angle, integrals.velocity)
    )
    angle, speed = np.diff(angle, axis=1), np.diff(speed, axis=1)
    size = np.median(np.linalg.norm(speed, axis=2)) / STEP_S
    if size == 0.0:
        return None
    speed = speed * (down / size) if not 0.8 < size / down < 1.25 else speed
    first, last = rows[:, :-1], rows[:, 1:]
    wanted = velocity_n[last] - velocity_n[first]
    wanted[:, :, 2] -= down * (at_s[last] - at_s[first])
    lasted_s = float(integrals.time_s[-1] - integrals.time_s[0])
    mean = (integrals.angle[:, -1] - integrals.angle[:, 0]) * (STEP_S / lasted_s)  # a few turns, and any offset
    tried = []
    for offset in (np.zeros(3), mean):
        turned = np.stack(
            [
                _turned_force((angle - offset) @ MATRICES.transpose(0, 2, 1)[:, None] * factor, speed)
                for factor in RELATIVE_FACTORS
            ]
        )  # (4, 48, windows, steps + 1, 3)
        tried.append(_window_scores(turned, grid_s, at_s, rows, wanted))
    return min(tried, key=lambda one: one[1])[0]


def _windows(integrals: Integrals, at_s, velocity_n):
    """Beginnings (w,) of the liveliest windows and the rows (w, m) of the fixes in each."""
    step_s = float(np.median(np.diff(at_s)))
    stride = max(1, round(INTERVAL_S / step_s))
    count = int(WINDOW_S / (stride * step_s)) + 1
    first = np.arange(0, len(at_s) - (count - 1) * stride, max(1, (count - 1) * stride))
    rows = first[:, None] + stride * np.arange(count)
    begin_s, end_s = at_s[rows[:, 0]], at_s[rows[:, -1]]
    whole = (end_s - begin_s <= WINDOW_S + 0.5 * step_s) & (begin_s - MARGIN_S >= integrals.time_s[0])
    whole &= end_s + MARGIN_S <= integrals.time_s[-1]
    rows, begin_s = rows[whole], begin_s[whole]
    if count < 4 or len(rows) < FEWEST_WINDOWS:
        return None
    lively = np.linalg.norm(np.std(np.diff(velocity_n[rows], axis=1), axis=1), axis=1)
    keep = np.sort(np.argsort(lively)[-MOST_WINDOWS:])
    return begin_s[keep], rows[keep]


def _turned_force(angle: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """Integral of R f, R from the gyros alone: angle (48, w, k, 3), speed (w, k, 3) to (48, w, k + 1, 3)."""
    half = 0.5 * angle
    size = np.linalg.norm(half, axis=-1, keepdims=True)
    vector = half * np.sinc(size / np.pi)
    scalar = np.cos(size)[..., 0]
    q0, qv = np.ones(angle.shape[:2]), np.zeros((*angle.shape[:2], 3))
    total = np.zeros((*angle.shape[:2], angle.shape[2] + 1, 3))
    for k in range(angle.shape[2]):
        felt = speed[:, k] + 0.5 * np.cross(angle[:, :, k], speed[:, k])
        twice = 2.0 * np.cross(qv, felt)
        total[:, :, k + 1] = total[:, :, k] + felt + q0[..., None] * twice + np.cross(qv, twice)
        p0, pv = scalar[:, :, k], vector[:, :, k]
        q0, qv = (
            q0 * p0 - (qv * pv).sum(axis=-1),
            q0[..., None] * pv + p0[..., None] * qv + np.cross(qv, pv),
        )
    return total


def _window_scores(turned, grid_s, at_s, rows, wanted) -> tuple[np.ndarray, float]:
    """log L (2, 48, 4) by the residual of the best rotation of each window, at the best offset of the clocks.

    And the variance of a residual under the best of these alternatives.
    """
    w, m = rows.shape
    squares = []
    for offset_s in OFFSETS_S[np.abs(OFFSETS_S) < MARGIN_S]:
        index = np.rint((at_s[rows] - offset_s - grid_s[:, :1]) / STEP_S).astype(int).clip(0, turned.shape[3] - 1)
        there = turned[:, :, np.arange(w)[:, None], index]
        felt = np.diff(there, axis=3)  # (4, 48, w, m - 1, 3)
        product = np.einsum("wki,fcwkj->fcwij", wanted, felt)
        values = np.linalg.svd(product, compute_uv=False)
        proper = np.sign(np.linalg.det(product))
        both = (wanted**2).sum(axis=(1, 2)) + (felt**2).sum(axis=(3, 4))
        plain = values[..., 0] + values[..., 1]
        squares.append(np.stack([both - 2.0 * (plain + sign * proper * values[..., 2]) for sign in (1.0, -1.0)]))
    squares = np.maximum(np.array(squares), 0.0)  # (offsets, 2, 4, 48, w)
    freedom = 3.0 * (m - 1) - 3.0
    k = int(np.argmin(np.median(squares, axis=-1).min(axis=(1, 2, 3))))
    least = squares[k]
    smallest = float(np.median(least, axis=-1).min()) / freedom
    sigma2 = max(smallest, WINDOW_FLOOR_MPS**2)
    counted = 0.5 * freedom  # velocities are smoothed, and the increments of one fix have opposite errors
    log = -0.5 * (NU + counted) * np.log1p(least * (counted / freedom) / (NU * sigma2)).sum(axis=-1)
    return log.transpose(0, 2, 1), smallest


def _class_of() -> tuple[np.ndarray, np.ndarray]:
    """For accelerometers read with order p and gyros with g: handedness (48,) and the relative order (48, 48)."""
    handed = np.linalg.det(MATRICES)
    proper = MATRICES * handed[:, None, None]
    relative = np.einsum("pji,gjk->pgik", proper, MATRICES)
    index = {matrix.astype(int).tobytes(): k for k, matrix in enumerate(MATRICES)}
    found = [[index[np.rint(one).astype(int).tobytes()] for one in row] for row in relative]
    return (handed < 0.0).astype(int), np.array(found)


HANDED, RELATIVE = _class_of()
