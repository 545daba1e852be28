"""One Kalman pass that makes the residual white, and every column of the regression with it.

The filter carries what process noise makes of the navigation error (9 states, nothing at the start), a first-order
Gauss-Markov error of what measures in each channel (9 states), and the slow wander of each
accelerometer and gyro from its value at the start (6 states). What a column contributes is its response s less what
the filter makes of it, xi = s - x:

    xi- = F xi+ + drive,   z = H xi- + o,   e = z / sqrt(S),   xi+ = xi- - K z

so the open vertical channel, in which s grows as exp(t sqrt(2 g / R)), does no harm. The residual itself is one more
column: o is the residual, its drive the known height loop with opposite sign. Channels are taken one by one.

Source: de Jong, J. Am. Stat. Assoc. 86 (1991) 1073 and Biometrika 78 (1991) 653: the augmented Kalman filter.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numba
import numpy as np

if TYPE_CHECKING:
    from ins_eval.diagnosis.model.columns import Assembled

ALL_STATES = 24
FASTMATH = {"contract", "reassoc", "nsz"}
_CHUNK = 512  # nodes whose whitened rows are kept at a time
_THREADS = 2


class Motion(NamedTuple):
    """How m columns move from node to node: `transition`, `half` (epochs, 9, 9), `coupling` (epochs, 9, 6) of sensors.

    `terms` (n, 4) are column, first of three states, source and slow factor of each drive, `weights` (n,) its size.
    """

    transition: np.ndarray
    half: np.ndarray
    coupling: np.ndarray
    interval_s: np.ndarray
    sources: np.ndarray
    slow_epochs: np.ndarray
    terms: np.ndarray
    weights: np.ndarray


class Shown(NamedTuple):
    """What m columns put into the measurements: `terms` (n, 3) are column, response and slow factor, `weights` (n,)."""

    observed: np.ndarray
    slow_nodes: np.ndarray
    terms: np.ndarray
    weights: np.ndarray


class Tape(NamedTuple):
    """What the adjoint of a pass needs (`slope`); without rows nothing is recorded.

    `gain` (rows, 24) and `variance` (rows,) of each measurement, `covariance` (nodes, 24, 24) before the measurements
    of a node, `slow` (nodes, 15, m) the states of the columns that decay, before they do.
    """

    gain: np.ndarray
    variance: np.ndarray
    covariance: np.ndarray
    slow: np.ndarray


class Measured(NamedTuple):
    """`residual` (nodes, 9), NaN where nothing was measured, and `design` (nodes, 9, 9) of the navigation error."""

    residual: np.ndarray
    design: np.ndarray


def motion(columns: Assembled, first: int, last: int) -> Motion:
    """How the columns from `first` to `last` move."""
    chosen = (columns.drive_terms[:, 0] >= first) & (columns.drive_terms[:, 0] < last)
    return Motion(
        columns.transition,
        columns.half,
        columns.coupling,
        columns.interval_s,
        columns.sources,
        columns.slow_epochs,
        columns.drive_terms[chosen] - np.array([first, 0, 0, 0]),
        columns.drive_weights[chosen],
    )


def shown(columns: Assembled, first: int, last: int) -> Shown:
    """What the columns from `first` to `last` put into the measurements."""
    chosen = (columns.observation_terms[:, 0] >= first) & (columns.observation_terms[:, 0] < last)
    return Shown(
        columns.observed,
        columns.slow_nodes,
        columns.observation_terms[chosen] - np.array([first, 0, 0]),
        columns.observation_weights[chosen],
    )


@numba.njit(cache=True, nogil=True, fastmath=FASTMATH)
def propagate(motion, e, state, pushed, work):
    """`work` (9, m): the columns `state`, of which the first nine rows count, after epoch `e`; `pushed` is scratch."""
    m = work.shape[1]
    pushed[:] = 0.0
    for n in range(motion.terms.shape[0]):
        c, target, s, slow = motion.terms[n, 0], motion.terms[n, 1], motion.terms[n, 2], motion.terms[n, 3]
        x = motion.weights[n] * motion.slow_epochs[slow, e]
        if x != 0.0:
            for j in range(3):
                pushed[target + j, c] += x * motion.sources[e, s, j]
    for i in range(9):
        for c in range(m):
            work[i, c] = 0.0
        for j in range(9):
            a, b = motion.transition[e, i, j], motion.half[e, i, j]
            if a != 0.0:
                for c in range(m):
                    work[i, c] += a * state[j, c]
            if b != 0.0:
                for c in range(m):
                    work[i, c] += b * pushed[j, c]


@numba.njit(cache=True, nogil=True, fastmath=FASTMATH)
def show(shown, k, by, out):
    """Add to `out` (9, m) what the columns put into the channels at node `k`, times `by` (9,)."""
    for n in range(shown.terms.shape[0]):
        c, s, slow = shown.terms[n, 0], shown.terms[n, 1], shown.terms[n, 2]
        x = shown.weights[n] * shown.slow_nodes[slow, k]
        if x != 0.0:
            for channel in range(9):
                out[channel, c] += by[channel] * x * shown.observed[k, s, channel]


class NoiseLevels(NamedTuple):
    """What the filter allows for.

    `white` (nodes, 9) one sigma of each measurement; `force` (epochs, 3, 3) and `rate` (epochs,) covariance that an
    epoch adds to velocity, (m/s)^2, and to phi, rad^2; `slow_sigma` (9,) and `slow_time_s` (9,) of the
    Gauss-Markov errors of what measures; `wander_sigma` (6,) and `wander_time_s` (6,) those of accelerometers
    (m/s^2) and gyros (rad/s).
    """

    white: np.ndarray
    force: np.ndarray
    rate: np.ndarray
    slow_sigma: np.ndarray
    slow_time_s: np.ndarray
    wander_sigma: np.ndarray
    wander_time_s: np.ndarray


@dataclass(frozen=True, eq=False)
class Whitened:
    """Sums over the whitened rows: A = X'X (m, m), b = X'e (m,), e'e, log|S| and the number of rows.

    `kept` (nodes, 9, k) are the whitened rows of the residual and of the first k - 1 columns, NaN where nothing was
    measured.
    """

    normal: np.ndarray
    projection: np.ndarray
    square: float
    log_determinant: float
    rows: int
    kept: np.ndarray


def tape(nodes: int, rows: int, count: int) -> Tape:
    """An empty tape for `rows` measurements at `nodes` and `count` columns."""
    return Tape(
        np.empty((rows, ALL_STATES)),
        np.empty(rows),
        np.empty((nodes, ALL_STATES, ALL_STATES)),
        np.empty((nodes, ALL_STATES - 9, count)),
    )


NO_TAPE = tape(0, 0, 0)


def whiten(columns: Assembled, noise: NoiseLevels, keep: int = 1) -> Whitened:
    """Whiten the residual and all columns; the residual is the first of `columns`, and `keep` of them are kept."""
    count, nodes = columns.count, columns.residual.shape[0]
    threads = _THREADS if count > 64 else 1
    bounds = np.linspace(0, count, threads + 1).astype(int)
    parts = [State(columns, noise, lo, hi) for lo, hi in zip(bounds[:-1], bounds[1:], strict=True)]
    total = np.zeros((count, count))
    kept = np.full((nodes, 9, keep), np.nan)
    log_determinant = 0.0
    rows = 0
    with ThreadPoolExecutor(threads) as pool:
        for first in range(0, nodes, _CHUNK):
            last = min(nodes, first + _CHUNK)
            measured = np.isfinite(columns.residual[first:last])
            out = np.empty((int(measured.sum()), count))
            if threads == 1:
                logs = [parts[0].advance(first, last, out)]
            else:
                logs = list(pool.map(State.advance, parts, [first] * threads, [last] * threads, [out] * threads))
            total += out.T @ out
            kept[first:last][measured] = out[:, :keep]
            log_determinant += logs[0]
            rows += out.shape[0]
    return Whitened(total[1:, 1:], total[1:, 0], float(total[0, 0]), log_determinant, rows, kept)


class State:
    """The filter on its way along the nodes, for the columns from `first` to `last`."""

    def __init__(self, columns: Assembled, noise: NoiseLevels, first: int, last: int):
        self.columns, self.noise, self.first, self.last = columns, noise, first, last
        self.xi = np.zeros((ALL_STATES, last - first))
        self.xi[:9] = columns.start[first:last].T
        self.covariance = np.zeros((ALL_STATES, ALL_STATES))
        self.covariance[range(9, 18), range(9, 18)] = noise.slow_sigma**2
        self.motion, self.shown = motion(columns, first, last), shown(columns, first, last)

    def advance(self, first: int, last: int, out: np.ndarray, tape: Tape = NO_TAPE) -> float:
        """Whiten the nodes from `first` to `last` into the rows of `out`; returns log|S| of them."""
        measured = Measured(self.columns.residual, self.columns.design)
        columns = (self.first, out)  # a slice of `out` has another layout, which compiles the kernel a second time
        state = (self.covariance, self.xi)
        return _advance(first, last, self.motion, self.shown, measured, self.noise, *state, *columns, tape)


@numba.njit(cache=True, nogil=True, fastmath=FASTMATH)
def _advance(first, last, motion, shown, measured, noise, p, xi, column, out, tape):
    residual, design = measured.residual, measured.design
    taping = tape.variance.size > 0
    m = xi.shape[1]
    work = np.empty((9, m))
    pushed = np.zeros((9, m))
    z = np.empty(m)
    z_base = np.zeros((9, m))
    whole = np.ones(9)
    t = np.empty((9, 24))
    line = np.empty(9)
    f_turned, g_turned = np.empty((9, 9)), np.empty((6, 9))
    h = np.zeros(24)
    ph = np.empty(24)
    gain = np.empty(24)
    decay = np.empty(15)
    row = 0
    logs = 0.0
    for k in range(first, last):
        if k > 0:
            e = k - 1
            f, g, dt = motion.transition[e], motion.coupling[e], motion.interval_s[e]
            # columns
            propagate(motion, e, xi, pushed, work)
            for i in range(9):
                for j in range(6):
                    x = g[i, j]
                    for c in range(m):
                        work[i, c] += x * xi[18 + j, c]
            for i in range(9):
                for c in range(m):
                    xi[i, c] = work[i, c]
            for i in range(15):
                decay[i] = np.exp(-dt / (noise.slow_time_s[i] if i < 9 else noise.wander_time_s[i - 9]))
                for c in range(m):
                    if taping:
                        tape.slow[k, i, c] = xi[9 + i, c]
                    xi[9 + i, c] *= decay[i]
            # covariance: inner loops run along rows, so that they are vector code
            for i in range(9):
                for j in range(9):
                    f_turned[j, i] = f[i, j]
                for j in range(6):
                    g_turned[j, i] = g[i, j]
            for i in range(9):
                for j in range(24):
                    t[i, j] = 0.0
                for q in range(9):
                    x = f[i, q]
                    for j in range(24):
                        t[i, j] += x * p[q, j]
                for q in range(6):
                    x = g[i, q]
                    for j in range(24):
                        t[i, j] += x * p[18 + q, j]
            for i in range(9):
                for j in range(9):
                    line[j] = 0.0
                for q in range(9):
                    x = t[i, q]
                    for j in range(9):
                        line[j] += x * f_turned[q, j]
                for q in range(6):
                    x = t[i, 18 + q]
                    for j in range(9):
                        line[j] += x * g_turned[q, j]
                for j in range(i, 9):
                    p[i, j] = line[j]
                    p[j, i] = line[j]
                for j in range(15):
                    x = t[i, 9 + j] * decay[j]
                    p[i, 9 + j] = x
                    p[9 + j, i] = x
            for i in range(15):
                for j in range(15):
                    p[9 + i, 9 + j] *= decay[i] * decay[j]
                sigma = noise.slow_sigma[i] if i < 9 else noise.wander_sigma[i - 9]
                p[9 + i, 9 + i] += sigma**2 * (1.0 - decay[i] ** 2)
            for i in range(3):
                for j in range(3):
                    p[3 + i, 3 + j] += noise.force[e, i, j]
                p[6 + i, 6 + i] += noise.rate[e]
        if taping:
            tape.covariance[k] = p
        # what columns put into the measurements
        z_base[:] = 0.0
        show(shown, k, whole, z_base)
        for channel in range(9):
            if not np.isfinite(residual[k, channel]):
                continue
            h[:] = 0.0
            for i in range(9):
                h[i] = design[k, channel, i]
            h[9 + channel] = 1.0
            s = noise.white[k, channel] ** 2
            ph[:] = 0.0
            for j in range(24):
                if h[j] != 0.0:
                    for i in range(24):
                        ph[i] += p[j, i] * h[j]
            for i in range(24):
                s += h[i] * ph[i]
            for i in range(24):
                gain[i] = ph[i] / s
            for i in range(24):
                for j in range(24):
                    p[i, j] -= gain[i] * ph[j]
            for c in range(m):
                z[c] = z_base[channel, c]
            for i in range(24):
                x = h[i]
                if x != 0.0:
                    for c in range(m):
                        z[c] += x * xi[i, c]
            root = 1.0 / np.sqrt(s)
            for c in range(m):
                out[row, column + c] = root * z[c]
            for i in range(24):
                x = gain[i]
                if x != 0.0:
                    for c in range(m):
                        xi[i, c] -= x * z[c]
            if taping:
                tape.gain[row] = gain
                tape.variance[row] = s
            logs += np.log(s)
            row += 1
    return logs
