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

from ins_eval.estimation.alike import Split

if TYPE_CHECKING:
    from ins_eval.error_model.columns import Assembled

ALL_STATES = 24
FASTMATH = {"contract", "reassoc", "nsz"}
_CHUNK = 512  # nodes whose whitened rows are kept at a time
_TOGETHER = 256  # columns at most whose states move together: as many as a core keeps at hand
_THREADS = 2
_MOST_KNOWN = 8_000_000  # whitened rows times columns that are held at one noise: 64 MB, by reasoning


class Motion(NamedTuple):
    """How m columns move from node to node: `transition`, `half` (epochs, 9, 9), `coupling` (epochs, 9, 6) of sensors.

    `walks` (epochs, 2, 9, 9) are as in `ins_eval.error_model.propagation`.
    `terms` (n, 4) are column, first of three states, source and slow factor of each drive, `weights` (n,) its size.
    """

    transition: np.ndarray
    half: np.ndarray
    walks: np.ndarray
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
    """What the filter makes of the noise, for the columns, and what the adjoint of a pass needs besides (`slope`).

    `gain` (rows, 24) and `variance` (rows,) of each measurement. For the adjoint, else without nodes: `covariance`
    (nodes, 24, 24) before the measurements of a node, `slow` (nodes, 15, m) the states of the columns that decay,
    before they do.
    """

    gain: np.ndarray
    variance: np.ndarray
    covariance: np.ndarray
    slow: np.ndarray


class Measured(NamedTuple):
    """`residual` (nodes, 9), NaN where nothing was measured, and `design` (nodes, 9, 9) of the navigation error."""

    residual: np.ndarray
    design: np.ndarray


def motion(columns: Assembled, which: np.ndarray) -> Motion:
    """How the columns `which` (m,) move."""
    return Motion(
        columns.transition,
        columns.half,
        columns.walks,
        columns.coupling,
        columns.interval_s,
        columns.sources,
        columns.slow_epochs,
        *_terms_of(columns.drive_terms, columns.drive_weights, which, columns.count),
    )


def shown(columns: Assembled, which: np.ndarray) -> Shown:
    """What the columns `which` (m,) put into the measurements."""
    return Shown(
        columns.observed,
        columns.slow_nodes,
        *_terms_of(columns.observation_terms, columns.observation_weights, which, columns.count),
    )


def _terms_of(terms: np.ndarray, weights: np.ndarray, which: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """The terms of the columns `which` of `count`, in whose order they are numbered, and their weights."""
    place = np.full(count, -1)
    place[which] = np.arange(which.size)
    chosen = place[terms[:, 0]] >= 0
    terms = terms[chosen]
    terms[:, 0] = place[terms[:, 0]]
    return terms, weights[chosen]


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

    `white` (nodes, 9) one sigma of each measurement; `force` and `rate` (epochs,) variance that random walks of
    an epoch add to each velocity, (m/s)^2, and phi, rad^2, and `steps` (epochs, 3, 3) what else adds to velocity;
    `slow_sigma` (9,) and `slow_time_s` (9,) of the Gauss-Markov errors of what measures, and `jumps` (epochs, 3) what
    else adds to that of position, m^2; `wander_sigma` (6,) and `wander_time_s` (6,) those of accelerometers (m/s^2) and
    gyros (rad/s).
    """

    white: np.ndarray
    force: np.ndarray
    rate: np.ndarray
    steps: np.ndarray
    slow_sigma: np.ndarray
    slow_time_s: np.ndarray
    jumps: np.ndarray
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


class Gains(NamedTuple):
    """What the filter makes of the noise, the same for all columns: its `tape`, and log|S|."""

    tape: Tape
    log_determinant: float


def gains(columns: Assembled, noise: NoiseLevels, adjoint_of: int = 0) -> Gains:
    """The gains of the filter, with what the adjoint of so many columns needs."""
    rows, nodes = int(np.isfinite(columns.residual).sum()), columns.residual.shape[0] if adjoint_of else 0
    recorded = Tape(
        np.empty((rows, ALL_STATES)),
        np.empty(rows),
        np.empty((nodes, ALL_STATES, ALL_STATES)),
        np.empty((nodes, ALL_STATES - 9, adjoint_of)),
    )
    still = motion(columns, np.zeros(0, dtype=int))
    return Gains(recorded, _filter(still, Measured(columns.residual, columns.design), noise, recorded))


class Known(NamedTuple):
    """What is the same for all that is asked at one noise: gains, and `rows` (rows, n) of the first n columns."""

    gains: Gains
    rows: np.ndarray


def known_at(columns: Assembled, noise: NoiseLevels) -> Known:
    """The gains at this noise, and the whitened rows of the residual and all `columns`, or of none if they are many."""
    found = gains(columns, noise)
    return with_more(Known(found, np.empty((found.tape.variance.size, 0))), columns, noise)


def with_more(known: Known, columns: Assembled, noise: NoiseLevels) -> Known:
    """The same with the rows of further `columns`, which begin with those that are known; as it is if they are many."""
    rows, given = known.gains.tape.variance.size, known.rows.shape[1]
    if rows * columns.count > _MOST_KNOWN:
        return known
    more = np.empty((rows, columns.count))
    more[:, :given] = known.rows
    which, nodes = np.arange(given, columns.count), (0, len(columns.residual))
    _together(columns, noise, which, _begin(columns)[:, given:], nodes, known.gains.tape, more, given)
    return Known(known.gains, more)


def _begin(columns: Assembled) -> np.ndarray:
    """The states (24, count) in which the columns begin."""
    xi = np.zeros((ALL_STATES, columns.count))
    xi[:9] = columns.start.T
    return xi


def whiten(columns: Assembled, noise: NoiseLevels, keep: int = 1, known: Known | None = None) -> Whitened:
    """Whiten the residual and all columns; the residual is the first of `columns`, and `keep` of them are kept.

    What is yet to begin costs nothing, and what is driven alike is whitened together (`Split`). `known` is what is
    known at this noise, if anything is.
    """
    count, nodes = columns.count, columns.residual.shape[0]
    recorded, log_determinant = gains(columns, noise) if known is None else known.gains
    given = 0 if known is None else known.rows.shape[1]
    xi = _begin(columns)
    total = np.zeros((count, count))
    kept = np.full((nodes, 9, keep), np.nan)
    space = np.empty(9 * min(nodes, _CHUNK) * (count + ALL_STATES))
    rows = 0
    for first in range(0, nodes, _CHUNK):
        last = min(nodes, first + _CHUNK)
        measured = np.isfinite(columns.residual[first:last])
        here = slice(rows, rows + int(measured.sum()))
        rows = here.stop
        part = recorded._replace(gain=recorded.gain[here], variance=recorded.variance[here])
        split = Split.of_nodes(columns, keep, first, last, given)
        begin = split.states(xi)
        width = given + begin.shape[1]
        out = space[: part.variance.size * width].reshape(-1, width)
        if known is not None:
            out[:, :given] = known.rows[here]
        end = _together(columns, noise, split.which, begin, (first, last), part, out, given)
        split.add(total, xi, out.T @ out)
        split.move(xi, end)
        begun = split.own[split.own < keep]
        of_kept = np.zeros((out.shape[0], keep))
        of_kept[:, begun] = out[:, : begun.size]
        kept[first:last][measured] = of_kept
    return Whitened(total[1:, 1:], total[1:, 0], float(total[0, 0]), log_determinant, rows, kept)


def _together(columns, noise, which, xi, nodes: tuple[int, int], recorded, out, place: int = 0) -> np.ndarray:
    """`respond`, of many columns in parts that a core keeps at hand."""
    count = xi.shape[1]
    if not count:
        return xi
    bounds = np.linspace(0, count, -(-count // _TOGETHER) + 1).astype(int)

    def part(lo: int, hi: int) -> np.ndarray:
        return respond(columns, noise, which[lo:hi], xi[:, lo:hi], nodes, recorded, out, place + lo)

    if bounds.size == 2:
        return part(0, count)
    with ThreadPoolExecutor(_THREADS) as pool:
        return np.hstack(list(pool.map(part, bounds[:-1], bounds[1:])))


def respond(
    columns: Assembled,
    noise: NoiseLevels,
    which: np.ndarray,
    xi: np.ndarray,
    nodes: tuple[int, int],
    recorded: Tape,
    out: np.ndarray,
    place: int = 0,
) -> np.ndarray:
    """Whiten what begins in the states `xi` (24, m) over some nodes, into the columns of `out` from `place` on.

    The first of them are driven as the columns `which` are, others by nothing. Returns the states at the end.
    """
    given = motion(columns, which), shown(columns, which), Measured(columns.residual, columns.design), noise, recorded
    xi = np.array(xi, order="C")
    _respond(*nodes, *given, xi, place, out)  # a slice of `out` has another layout, which compiles the kernel again
    return xi


@numba.njit(cache=True, nogil=True, fastmath=FASTMATH)
def _filter(motion, measured, noise, tape):
    residual, design = measured.residual, measured.design
    p = np.zeros((24, 24))
    for i in range(9):
        p[9 + i, 9 + i] = noise.slow_sigma[i] ** 2
    taping = tape.covariance.size > 0
    t = np.zeros((9, 24))
    turned = np.zeros((15, 12))  # transition and coupling, so that inner loops run along rows
    line = np.zeros(12)
    h = np.zeros(24)
    ph = np.zeros(24)
    decay = np.empty(15)
    # lengths that the compiler does not know: loops of known ones are unrolled to scalar code, half as fast
    states = tape.gain.shape[1]
    padded = states // 2
    row = 0
    logs = 0.0
    before_s = -1.0
    for k in range(residual.shape[0]):
        if k > 0:
            e = k - 1
            dt = motion.interval_s[e]
            if dt != before_s:
                before_s = dt
                for i in range(15):
                    decay[i] = np.exp(-dt / (noise.slow_time_s[i] if i < 9 else noise.wander_time_s[i - 9]))
            for i in range(9):
                for j in range(9):
                    turned[j, i] = motion.transition[e, i, j]
                for j in range(6):
                    turned[9 + j, i] = motion.coupling[e, i, j]
            for i in range(9):
                for j in range(states):
                    t[i, j] = 0.0
                for q in range(9):
                    x = turned[q, i]
                    if x != 0.0:
                        for j in range(states):
                            t[i, j] += x * p[q, j]
                for q in range(6):
                    x = turned[9 + q, i]
                    if x != 0.0:
                        for j in range(states):
                            t[i, j] += x * p[18 + q, j]
            for i in range(9):
                for j in range(padded):
                    line[j] = 0.0
                for q in range(9):
                    x = t[i, q]
                    for j in range(padded):
                        line[j] += x * turned[q, j]
                for q in range(6):
                    x = t[i, 18 + q]
                    for j in range(padded):
                        line[j] += x * turned[9 + q, j]
                for j in range(i, 9):
                    p[i, j] = line[j]
                    p[j, i] = line[j]
                for j in range(15):
                    x = t[i, 9 + j] * decay[j]
                    p[i, 9 + j] = x
                    p[9 + j, i] = x
            for i in range(15):
                x = decay[i]
                for j in range(15):
                    p[9 + i, 9 + j] *= x * decay[j]
                sigma = noise.slow_sigma[i] if i < 9 else noise.wander_sigma[i - 9]
                p[9 + i, 9 + i] += sigma**2 * (1.0 - decay[i] ** 2)
            for i in range(9):
                for j in range(9):
                    p[i, j] += noise.force[e] * motion.walks[e, 0, i, j] + noise.rate[e] * motion.walks[e, 1, i, j]
            for i in range(3):
                for j in range(3):
                    p[3 + i, 3 + j] += noise.steps[e, i, j]
                p[9 + i, 9 + i] += noise.jumps[e, i]
        if taping:
            tape.covariance[k] = p
        for channel in range(9):
            if not np.isfinite(residual[k, channel]):
                continue
            for i in range(9):
                h[i] = design[k, channel, i]
            s = noise.white[k, channel] ** 2
            for i in range(states):
                ph[i] = p[9 + channel, i]
            for j in range(9):
                x = h[j]
                if x != 0.0:
                    for i in range(states):
                        ph[i] += x * p[j, i]
            s += ph[9 + channel]
            for i in range(9):
                s += h[i] * ph[i]
            inverse = 1.0 / s
            for i in range(states):
                x = ph[i] * inverse
                tape.gain[row, i] = x
                for j in range(states):
                    p[i, j] -= x * ph[j]
            tape.variance[row] = s
            logs += np.log(s)
            row += 1
    return logs


@numba.njit(cache=True, nogil=True, fastmath=FASTMATH)
def _respond(first, last, motion, shown, measured, noise, tape, xi, column, out):
    residual, design = measured.residual, measured.design
    taping = tape.slow.size > 0
    m = xi.shape[1]
    work = np.empty((9, m))
    pushed = np.empty((9, m))
    z_base = np.empty((9, m))
    z = np.empty(m)
    whole = np.ones(9)
    row = 0
    for k in range(first, last):
        if k > 0:
            e = k - 1
            g, dt = motion.coupling[e], motion.interval_s[e]
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
                decay = np.exp(-dt / (noise.slow_time_s[i] if i < 9 else noise.wander_time_s[i - 9]))
                for c in range(m):
                    if taping:
                        tape.slow[k, i, c] = xi[9 + i, c]
                    xi[9 + i, c] *= decay
        # what columns put into the measurements
        z_base[:] = 0.0
        show(shown, k, whole, z_base)
        for channel in range(9):
            if not np.isfinite(residual[k, channel]):
                continue
            gain = tape.gain[row]
            for c in range(m):
                z[c] = z_base[channel, c] + xi[9 + channel, c]
            for i in range(9):
                x = design[k, channel, i]
                if x != 0.0:
                    for c in range(m):
                        z[c] += x * xi[i, c]
            root = 1.0 / np.sqrt(tape.variance[row])
            for c in range(m):
                out[row, column + c] = root * z[c]
            for i in range(24):
                x = gain[i]
                for c in range(m):
                    xi[i, c] -= x * z[c]
            row += 1
