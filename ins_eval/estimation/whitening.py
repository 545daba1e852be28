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

import numpy as np

from ins_eval.error_model.observations import CHANNELS
from ins_eval.estimation import kalman, still
from ins_eval.estimation.alike import Split
from ins_eval.estimation.kalman import ALL_STATES, Measured, Motion, NoiseLevels, Shown, Tape

if TYPE_CHECKING:
    from ins_eval.error_model.columns import Assembled

_CHUNK = 512  # nodes whose whitened rows are kept at a time
_TOGETHER = 256  # columns at most whose states move together: as many as a core keeps at hand
_THREADS = 2
_MOST_KNOWN = 8_000_000  # whitened rows times columns that are held at one noise: 64 MB, by reasoning


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
    measured = Measured(columns.residual, columns.design)
    if columns.still:
        sizes = (rows, 1), rows, (nodes, columns.channels.size, 1), (nodes, columns.channels.size, adjoint_of)
        recorded = Tape(*map(np.empty, sizes))
        return Gains(recorded, still.filtered(columns.channels, columns.interval_s, measured, noise, recorded))
    sizes = (rows, ALL_STATES), rows, (nodes, ALL_STATES, ALL_STATES), (nodes, ALL_STATES - 9, adjoint_of)
    recorded = Tape(*map(np.empty, sizes))
    return Gains(recorded, kalman.filtered(motion(columns, np.zeros(0, dtype=int)), measured, noise, recorded))


class Known(NamedTuple):
    """What is the same for all that is asked at one noise: gains, `rows` (rows, n) of the first n columns, their sums.

    `sums` (n, n) are rows' rows.
    """

    gains: Gains
    rows: np.ndarray
    sums: np.ndarray


def known_at(columns: Assembled, noise: NoiseLevels) -> Known:
    """The gains at this noise, and the whitened rows of the residual and all `columns`, or of none if they are many."""
    found = gains(columns, noise)
    return with_more(Known(found, np.empty((found.tape.variance.size, 0)), np.empty((0, 0))), columns, noise)


def with_more(known: Known, columns: Assembled, noise: NoiseLevels) -> Known:
    """The same with the rows of further `columns`, which begin with those that are known; as it is if they are many."""
    rows, given = known.gains.tape.variance.size, known.rows.shape[1]
    if rows * columns.count > _MOST_KNOWN:
        return known
    more = np.empty((rows, columns.count))
    more[:, :given] = known.rows
    which, nodes = np.arange(given, columns.count), (0, len(columns.residual))
    _together(columns, noise, which, initial(columns)[:, given:], nodes, known.gains.tape, more, given)
    sums = np.empty((columns.count, columns.count))
    sums[:given, :given] = known.sums
    sums[:, given:] = more.T @ more[:, given:]
    sums[given:, :given] = sums[:given, given:].T
    return Known(known.gains, more, sums)


def initial(columns: Assembled) -> np.ndarray:
    """The states (states, count) in which the columns begin; where nothing moves only what measures has a state."""
    if columns.still:
        return np.zeros((columns.channels.size, columns.count))
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
    xi = initial(columns)
    total = np.zeros((count, count))
    kept = np.full((nodes, 9, keep), np.nan)
    chunk = _CHUNK * CHANNELS // max(columns.channels.size, 1) if columns.still else _CHUNK
    space = np.empty(CHANNELS * min(nodes, _CHUNK) * (count + ALL_STATES))
    rows = 0
    for first in range(0, nodes, chunk):
        last = min(nodes, first + chunk)
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
        product = np.zeros((width, width))  # sums of what is known are known
        product[:, given:] = out.T @ out[:, given:]
        product[given:, :given] = product[:given, given:].T
        split.add(total, xi, product)
        split.move(xi, end)
        begun = split.own[split.own < keep]
        of_kept = np.zeros((out.shape[0], keep))
        of_kept[:, begun] = out[:, : begun.size]
        kept[first:last][measured] = of_kept
    if known is not None:
        total[:given, :given] = known.sums
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
    """Whiten what begins in the states `xi` (states, m) over some nodes, into the columns of `out` from `place` on.

    The first of them are driven as the columns `which` are, others by nothing. Returns the states at the end.
    """
    measured, seen = Measured(columns.residual, columns.design), shown(columns, which)
    xi = np.array(xi, order="C")  # and not a slice of `out`: another layout compiles the kernels again
    if columns.still:
        still.responded(*nodes, columns.channels, columns.interval_s, seen, measured, noise, recorded, xi, place, out)
    else:
        kalman.responded(*nodes, motion(columns, which), seen, measured, noise, recorded, xi, place, out)
    return xi
