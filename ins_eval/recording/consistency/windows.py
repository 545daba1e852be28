"""The gyros against the accelerometers, by the velocity alone.

Whatever way the vehicle points, over a window of 8 s the specific force turned by the gyros alone, R f, is dv/dt - g
but for a rotation:

    min over C_w of  sum |dv - g dt - C_w sum R f dt|^2       (Wahba's problem; only singular values are needed)

What nobody stated is part of the relation, to first order and with a prior of its usual size (`SPREAD`): offsets and
scales of the gyros, offsets of the accelerometers, the arm to the antenna about the believed one, and the clock. That
tells the order of one triad against the other and whether they are right-handed, of 96 in all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numba
import numpy as np
from scipy.spatial.transform import Rotation

from ins_eval.recording import Recording
from ins_eval.recording.consistency.alternatives import MATRICES, NU
from ins_eval.units import DEG, DEG_PER_H

RATE_FACTORS = np.array([1.0, DEG, 1.0 / DEG, DEG_PER_H, 1.0 / DEG_PER_H, DEG_PER_H / DEG, DEG / DEG_PER_H])
RELATIVE_FACTORS = RATE_FACTORS[:4]
INTERVAL_S = 1.0  # over which velocities are differenced
WINDOW_S, STEP_S = 8.0, 0.05
# by which a window reaches beyond its fixes, and clocks may differ: three windows remain of 30 s; by reasoning
MARGIN_S = 1.5
OFFSETS_S = np.arange(-MARGIN_S, MARGIN_S + 0.01, 0.1)  # of the clocks, tried for every relation
MOST_WINDOWS, FEWEST_WINDOWS = 16, 3
WINDOW_FLOOR_MPS = 0.05  # of a difference of two velocities
ARM_HALF_S = 0.1  # half of the time over which a receiver's velocity is a mean, of 5 to 10 Hz receivers
ITERATIONS, ROUNDS = 3, 3  # of the fit, and of the clock and the offsets about which it is one
# Nats behind the best after one step of the fit, beyond which there is no second: the steps to come gain below 70 in
# flights, drives and the real one.
HOPELESS = 150.0
TINY = 1e-12  # (m/s)^2
RANK = 1e-12  # of what is felt: where it is all along one axis, the turn about that axis is free
# sigma of what nobody stated
GYRO_OFFSET = DEG  # rad/s, data sheets of MEMS gyros state 0.2 to 3 deg/s; of a window as of all, by reasoning
GYRO_SCALE = 0.02  # of one, the same sheets state 1 to 3 %
FORCE_OFFSET = 0.5  # m/s^2, data sheets of MEMS accelerometers state 5 to 60 mg
ARM_SIGMA_M = 2.0  # of the believed arm to the antenna: anywhere in a car or cabin
CLOCK_SIGMA_S = 0.1  # beside the offsets that are tried, their step
SPREAD = np.array([GYRO_OFFSET] * 3 + [GYRO_SCALE] * 3 + [FORCE_OFFSET] * 3 + [ARM_SIGMA_M] * 3 + [CLOCK_SIGMA_S])
GYRO, ARM = slice(0, 3), slice(9, 12)


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
    per_unit = recording.belief.accelerometer.mps_per_pulse if imu.accelerometer_form == "pulse" else np.ones(3)
    if per_unit is None:
        return None
    time_s = np.append(recording.start.time_s, imu.time_s)
    kept = slice(None, None, max(1, int(STEP_S / max(float(np.median(np.diff(time_s))), 1e-9) + 1e-6)))

    def summed(increments: np.ndarray) -> np.ndarray:
        return np.stack([np.append(0.0, np.cumsum(column))[kept] for column in increments.T])

    return Integrals(time_s[kept], summed(imu.gyro), summed(imu.accelerometer) * per_unit[:, None])


def relative_scores(integrals: Integrals, at_s, velocity_n, down: float, arm_m: np.ndarray) -> np.ndarray | None:
    """log L (2, 48, 4): handedness of the accelerometers, gyros against them, unit of the gyros; None if untold."""
    windows = _windows(integrals, at_s, velocity_n)
    if windows is None:
        return None
    begin_s, rows = windows
    grid_s, angle, speed = _increments(integrals, begin_s)
    size = np.median(np.linalg.norm(speed, axis=2)) / STEP_S
    if size == 0.0:
        return None
    speed = speed * (down / size) if not 0.8 < size / down < 1.25 else speed
    factors = np.repeat(RELATIVE_FACTORS, 48)[:, None, None, None]
    read = np.tile(MATRICES, (len(RELATIVE_FACTORS), 1, 1))
    angle = factors * (angle @ read.transpose(0, 2, 1)[:, None])
    attitude, turned = _turned(angle, speed)
    first, last = rows[:, :-1], rows[:, 1:]
    wanted = velocity_n[last] - velocity_n[first]
    wanted[:, :, 2] -= down * (at_s[last] - at_s[first])
    # the offset that rotations alone like best is a wrong one where the vehicle rocks
    starts = _best_clock(turned, at_s[rows], grid_s, wanted), _at_clock(0.0, at_s[rows], grid_s, 2 * len(turned))
    hands = (turned, speed), (-turned, -speed)  # of the set of accelerometers
    parts = [
        ((attitude, angle, felt, at), of_steps)
        for start in starts
        for (felt, of_steps), at in zip(hands, np.split(start, 2), strict=True)
    ]
    freedom = wanted[0].size - 3.0
    squares, log_prior = map(np.stack, zip(*(_refined(*part, wanted, arm_m, 1, 1) for part in parts), strict=True))
    log = _window_scores(squares, log_prior, freedom)
    hopeful = log > log.max() - HOPELESS
    hopeful[:: len(hands), 0] = True  # what was read
    for k, (part, of_steps) in enumerate(parts):
        near = np.flatnonzero(hopeful[k])
        if near.size:
            chosen = [each[near] for each in part]
            squares[k, near], log_prior[k, near] = _refined(chosen, of_steps, wanted, arm_m, ITERATIONS, ROUNDS)
    log = _window_scores(squares, log_prior, freedom)
    return log.reshape(len(starts), 2, len(RELATIVE_FACTORS), 48).max(axis=0).transpose(0, 2, 1)


def velocity_scores(integrals: Integrals, at_s, velocities_n: np.ndarray, down: float, arm_m: np.ndarray):
    """log L (a,) of velocities (a, n, 3), m/s, with Jacobians, usual sizes of changes and of what is left; or None."""
    windows = _windows(integrals, at_s, velocities_n[0])
    if windows is None:
        return None
    begin_s, rows = windows
    grid_s, angle, speed = _increments(integrals, begin_s)
    attitude, turned = _turned(angle[None], speed)
    first, last = rows[:, :-1], rows[:, 1:]
    freedom = 3.0 * first.shape[1] - 3.0
    found = []
    for velocity_n in velocities_n:
        wanted = velocity_n[last] - velocity_n[first]
        changed = (wanted**2).sum(axis=1)
        wanted[:, :, 2] -= down * (at_s[last] - at_s[first])
        starts = _best_clock(turned, at_s[rows], grid_s, wanted)[:1], _at_clock(0.0, at_s[rows], grid_s, 1)
        parts = ((attitude, angle[None], turned, at) for at in starts)
        tried = [_refined(part, speed, wanted, arm_m, ITERATIONS, ROUNDS)[:2] for part in parts]
        square, prior = min(tried, key=lambda one: float(np.median(one[0])))
        found.append((changed, square[0], prior[0]))
    changed, squares, log_prior = map(np.array, zip(*found, strict=True))
    sizes = np.log(np.sqrt(np.median(changed, axis=1)) + TINY)
    larger = np.exp((sizes - sizes[0]).mean(axis=1))
    changed_mps, left_mps = (np.sqrt(np.median(one, axis=1) / freedom) for one in (changed.sum(axis=2), squares))
    return _window_scores(squares / larger[:, None] ** 2, log_prior, freedom), changed_mps, left_mps


def _increments(integrals: Integrals, begin_s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The grid (w, k) of each window, s, and the increments of angle and velocity (w, k - 1, 3) on it."""
    grid_s = begin_s[:, None] - MARGIN_S + STEP_S * np.arange(round((WINDOW_S + 2 * MARGIN_S) / STEP_S) + 1)
    both = integrals.angle, integrals.velocity
    at = (np.stack([np.interp(grid_s, integrals.time_s, line) for line in values], axis=-1) for values in both)
    return grid_s, *(np.diff(one, axis=1) for one in at)


def _refined(
    part: Sequence[np.ndarray], speed: np.ndarray, wanted: np.ndarray, arm_m: np.ndarray, iterations: int, rounds: int
) -> tuple[np.ndarray, np.ndarray]:
    """Squares of residuals (a, w) and log prior (a,) of alternatives: attitudes, angles, sums of R f and begin.

    After each round but the last it begins again at the clock that was found, and without the offsets of the gyros that
    were: 2 deg/s over half a window turn by 8 degrees, which is no first order.
    """
    attitude, angle, turned, at = part  # the last: rows (a, w, m) of the grid
    centre = np.zeros((len(angle), len(SPREAD)))
    centre[:, ARM] = arm_m
    here = np.arange(at.shape[0])[:, None, None], np.arange(at.shape[1])[None, :, None]
    for left in reversed(range(rounds)):
        slope = _slopes(attitude, angle, turned, at)
        felt = np.diff(turned[*here, at], axis=2)
        squares, log_prior, state = _fitted(felt, slope, wanted, centre, iterations)
        if left:
            ahead = np.rint(state[:, -1] / STEP_S).astype(int)[:, None, None]
            at = (at + ahead).clip(0, turned.shape[2] - 1)
            angle = angle - STEP_S * state[:, None, None, GYRO]
            centre[:, GYRO] -= state[:, GYRO]
            attitude, turned = _turned(angle, speed)
    return squares, log_prior


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


def _turned(angle: np.ndarray, speed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Attitude R (g, w, k + 1, 3, 3) from the gyros alone and the sum of R f dt (g, w, k + 1, 3).

    angle (g, w, k, 3) in rad and speed (w, k, 3) in m/s are the increments of each step.
    """
    steps = Rotation.from_rotvec(angle.reshape(-1, 3)).as_matrix().reshape(*angle.shape, 3)
    return _chained(steps, speed + 0.5 * np.cross(angle, speed))


@numba.njit(cache=True)
def _chained(steps: np.ndarray, felt: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Products of the rotations of all steps (g, w, k, 3, 3) up to each, and the sums of R times what is felt.

    The frame is that of the middle, from where offsets of the gyros lean least.
    """
    g, w, k = steps.shape[:3]
    attitude, turned = np.zeros((g, w, k + 1, 3, 3)), np.zeros((g, w, k + 1, 3))
    for a in range(g):
        for b in range(w):
            r = attitude[a, b]
            half = (k + 1) // 2
            for i in range(3):
                r[half, i, i] = 1.0
            for t in range(half, k):  # onwards R S, back R S'
                for i in range(3):
                    for j in range(3):
                        for m in range(3):
                            r[t + 1, i, j] += r[t, i, m] * steps[a, b, t, m, j]
            for t in range(half - 1, -1, -1):
                for i in range(3):
                    for j in range(3):
                        for m in range(3):
                            r[t, i, j] += r[t + 1, i, m] * steps[a, b, t, j, m]
            for t in range(k):
                for i in range(3):
                    shown = 0.0
                    for m in range(3):
                        shown += r[t, i, m] * felt[a, b, t, m]
                    turned[a, b, t + 1, i] = turned[a, b, t, i] + shown
    return attitude, turned


def _cross(vector: np.ndarray) -> np.ndarray:
    """Matrices (..., 3, 3) of the cross product with `vector` (..., 3)."""
    x, y, z = np.moveaxis(vector, -1, 0)
    zero = np.zeros_like(x)
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(*vector.shape, 3)


def _at_clock(offset_s: float, row_s: np.ndarray, grid_s: np.ndarray, count: int) -> np.ndarray:
    """Rows of the grid (count, w, m) at one offset of the clocks; stamps that jump may end a window beyond it."""
    at = np.rint((row_s - offset_s - grid_s[:, :1]) / STEP_S).astype(int).clip(0, grid_s.shape[1] - 1)
    return np.broadcast_to(at, (count, *at.shape)).copy()


def _best_clock(turned: np.ndarray, row_s: np.ndarray, grid_s: np.ndarray, wanted: np.ndarray):
    """Rows of the grid (2 g, w, m) at the offset of the clocks that fits each alternative best by rotations alone."""
    w = len(row_s)
    best = index = None
    for offset_s in OFFSETS_S[np.abs(OFFSETS_S) < MARGIN_S]:
        at = _at_clock(offset_s, row_s, grid_s, 1)[0]
        felt = np.diff(turned[:, np.arange(w)[:, None], at], axis=2)
        product = np.swapaxes(wanted, 1, 2) @ felt
        values = np.linalg.svd(product, compute_uv=False)
        proper = np.sign(np.linalg.det(product))
        both = (wanted**2).sum(axis=(1, 2)) + (felt**2).sum(axis=(2, 3))
        plain = values[..., 0] + values[..., 1]
        square = np.concatenate([both - 2.0 * (plain + sign * proper * values[..., 2]) for sign in (1.0, -1.0)])
        square = np.median(square, axis=1)
        if best is None:
            best, index = square, np.broadcast_to(at, (len(square), *at.shape)).copy()
        else:
            better = square < best
            best[better], index[better] = square[better], at
    return index


@numba.njit(cache=True)
def _slopes(attitude, angle, turned, index):
    """How the differences of velocity shown (a, w, m - 1, 3, 13) lean on what nobody stated, in the order of `SPREAD`.

    attitude (a, w, t, 3, 3), angle (a, w, t - 1, 3) of each step, turned (a, w, t, 3), index (a, w, m) in rising order.
    """
    count, w, m = index.shape
    last = attitude.shape[2] - 1
    near = max(1, int(np.rint(ARM_HALF_S / STEP_S)))
    out = np.empty((count, w, m - 1, 3, 13))
    value = np.empty((3, 13))
    swept, leaned = np.empty((3, 6)), np.empty((3, 6))
    for a in range(count):
        for b in range(w):
            r, v = attitude[a, b], turned[a, b]
            # integrals of R dt (s) and of R times the rate of each gyro (rad), and of R f x these
            swept[:], leaned[:] = 0.0, 0.0
            at = 0
            for k in range(m):
                while at < index[a, b, k]:
                    f0, f1, f2 = v[at + 1, 0] - v[at, 0], v[at + 1, 1] - v[at, 1], v[at + 1, 2] - v[at, 2]
                    for j in range(6):
                        each = STEP_S if j < 3 else angle[a, b, at, j - 3]
                        grown0, grown1, grown2 = (r[at, 0, j % 3] * each, r[at, 1, j % 3] * each,
                                                  r[at, 2, j % 3] * each)  # fmt: skip
                        s0, s1, s2 = (swept[0, j] + 0.5 * grown0, swept[1, j] + 0.5 * grown1,
                                      swept[2, j] + 0.5 * grown2)  # fmt: skip
                        leaned[0, j] += f1 * s2 - f2 * s1
                        leaned[1, j] += f2 * s0 - f0 * s2
                        leaned[2, j] += f0 * s1 - f1 * s0
                        swept[0, j] += grown0
                        swept[1, j] += grown1
                        swept[2, j] += grown2
                    at += 1
                ahead, behind = min(at + near, last), max(at - near, 0)
                span_s = (ahead - behind) * STEP_S
                for i in range(3):
                    before = value[i].copy()
                    value[i, :6] = leaned[i]
                    for j in range(3):
                        value[i, 6 + j] = swept[i, j]
                        value[i, 9 + j] = (r[ahead, i, j] - r[behind, i, j]) / span_s
                    value[i, 12] = (v[ahead, i] - v[behind, i]) / span_s
                    if k > 0:
                        out[a, b, k - 1, i] = value[i] - before
    return out


def _fitted(felt, slope, wanted, centre: np.ndarray, iterations: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Squares of residuals (a, w), log prior (a,) and state (a, 13) at the best rotations, offsets, scales, arm, clock.

    felt (a, w, m - 1, 3) in m/s and its `slope`, wanted (w, m - 1, 3) in m/s, centre (a, 13) of the prior. The gyros of
    each window have an offset of their own beside that of all, since offsets jump and drift; what it costs by its prior
    is part of the squares.
    """
    a, w = felt.shape[:2]
    state = centre.copy()
    own = np.zeros((a, w, 3))
    for _ in range(iterations):
        shown = felt + _times(slope, state, own)
        u, _, vt = np.linalg.svd(np.swapaxes(wanted, 1, 2) @ shown)
        u[..., 2] *= np.sign(np.linalg.det(u @ vt))[..., None]
        turn = u @ vt
        back = wanted @ turn  # what should be shown, in the frame of each window
        residual = back - shown
        square = (residual**2).sum(axis=(2, 3))
        # windows that nothing explains, as where a fix fails, weigh little
        share = 1.0 / (1.0 + square / (NU * np.median(square, axis=1, keepdims=True) + TINY))
        lean = _cross(back).reshape(a, w, -1, 3)
        jacobian = slope.reshape(a, w, -1, len(SPREAD))
        square_lean = np.swapaxes(lean, 2, 3) @ lean
        size = np.trace(square_lean, axis1=2, axis2=3)[..., None, None]
        square_lean = np.linalg.inv(square_lean + RANK * size * np.eye(3))
        freed = jacobian - lean @ (square_lean @ (np.swapaxes(lean, 2, 3) @ jacobian))
        sigma2 = np.maximum(np.median(square, axis=1) / residual[0, 0].size, WINDOW_FLOOR_MPS**2)
        weighted = (freed * (share / sigma2[:, None])[..., None, None]).reshape(a, -1, len(SPREAD)).transpose(0, 2, 1)
        normal = weighted @ freed.reshape(a, -1, len(SPREAD))
        pull = (weighted @ residual.reshape(a, -1, 1))[..., 0]
        pull -= (state - centre) / SPREAD**2
        step = np.linalg.solve(normal + np.diag(SPREAD**-2.0), pull[..., None])
        state = state + step[..., 0]
        left = residual.reshape(a, w, -1, 1) - freed @ step[:, None]
        gyro = np.swapaxes(freed[..., GYRO], 2, 3) / sigma2[:, None, None, None]
        pull = gyro @ left - own[..., None] / GYRO_OFFSET**2
        own = own + np.linalg.solve(gyro @ freed[..., GYRO] + np.eye(3) / GYRO_OFFSET**2, pull)[..., 0]
    shown = felt + _times(slope, state, own)
    product = np.swapaxes(wanted, 1, 2) @ shown
    values = np.linalg.svd(product, compute_uv=False)
    best = values[..., 0] + values[..., 1] + np.sign(np.linalg.det(product)) * values[..., 2]
    square = (wanted**2).sum(axis=(1, 2)) + (shown**2).sum(axis=(2, 3)) - 2.0 * best
    square = np.maximum(square, 0.0) + sigma2[:, None] * ((own / GYRO_OFFSET) ** 2).sum(axis=2)
    log_prior = -0.5 * (((state - centre) / SPREAD)[:, :-1] ** 2).sum(axis=1)  # any clock is as likely as another
    return square, log_prior, state


def _times(slope: np.ndarray, state: np.ndarray, own: np.ndarray) -> np.ndarray:
    """slope (a, w, k, 3, p) times state (a, p), and the offsets of the gyros of each window `own` (a, w, 3)."""
    a, *shape, p = slope.shape
    return (slope.reshape(a, -1, p) @ state[..., None]).reshape(a, *shape) + np.einsum(
        "awkig,awg->awki", slope[..., GYRO], own
    )


def _window_scores(squares: np.ndarray, log_prior: np.ndarray, freedom: float) -> np.ndarray:
    """log L (p, a) of squares (p, a, w): Student's distribution of each window, of the size that the best leaves."""
    sigma2 = max(float(np.median(squares, axis=-1).min()) / freedom, WINDOW_FLOOR_MPS**2)
    counted = 0.5 * freedom  # velocities are smoothed, and the increments of one fix have opposite errors
    log = -0.5 * (NU + counted) * np.log1p(squares * (counted / freedom) / (NU * sigma2)).sum(axis=-1)
    return log + log_prior


def _class_of() -> tuple[np.ndarray, np.ndarray]:
    """For accelerometers read with order p and gyros with g: handedness (48,) and the relative order (48, 48)."""
    handed = np.linalg.det(MATRICES)
    proper = MATRICES * handed[:, None, None]
    relative = np.einsum("pji,gjk->pgik", proper, MATRICES)
    index = {matrix.astype(int).tobytes(): k for k, matrix in enumerate(MATRICES)}
    found = [[index[np.rint(one).astype(int).tobytes()] for one in row] for row in relative]
    return (handed < 0.0).astype(int), np.array(found)


HANDED, RELATIVE = _class_of()
