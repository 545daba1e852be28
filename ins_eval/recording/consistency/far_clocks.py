"""Stamps of fixes that are seconds or minutes from those of the IMU, by what both feel of the motion.

Two numbers do not depend on axes, signs and attitude: how fast the course turns, which the gyros show about the
vertical of the accelerometers as w . f / |f|, and the size of the specific force |f|, which is |dv/dt - g|. Their means
over `SPAN_S` are correlated at every lag at once by Fourier transform. Summed over both,

    log odds of lag L = sum n / 2 log((1 - r(0)^2) / (1 - r(L)^2)) - log(lags) - prior,

r(0) the correlation at the best lag that a receiver may be late by, n the effective number of means. UTC and GPS time
are 18 s apart and are taken for each other; who stamps by hand may be off by anything.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from ins_eval.earth import gravity
from ins_eval.recording.consistency.alternatives import LIKELY, Finding, effective_share
from ins_eval.recording.consistency.clocks import MOVING_MPS, PRIOR, WIDEST_S, clock_offset
from ins_eval.recording.consistency.places import differenced
from ins_eval.recording.consistency.track import without_missing_down
from ins_eval.recording.consistency.windows import integrated

if TYPE_CHECKING:
    from ins_eval.recording import Fixes, Recording

GRID_S = 1.0  # of lags: clocks of the same log are off by whole seconds; the rest is found by `clocks`
# over which velocities are differenced, and positions, which tell a course no sooner: by reasoning
SPAN_S, SPAN_OF_POSITIONS_S = 1.0, 6.0
FARTHEST_S = 600.0  # farther, most of a log has nothing in common; by reasoning, as are the next
AGREES = 0.7  # correlation, of one at least: 0.9 and more in drives and flights that turn; by reasoning
SHARE = 0.5  # of the means, that must be left at a lag
FEWEST = 60  # means
HARDLY = 1e-9  # of the largest variance, below which nothing turns


class _Signal(NamedTuple):
    """What fixes show (n,) at instants of the grid from number `first` on, and the IMU (m,); NaN where they do not."""

    first: int
    fixes: np.ndarray
    imu: np.ndarray


def check_far_clock(recording: Recording, fixes: Fixes, table: str) -> Finding | None:
    """The lag at which fixes and IMU feel the same motion, where no receiver is late by as much."""
    believed_s = getattr(recording.belief, table).time_offset_s
    signals = list(_signals(recording, replace(fixes, time_s=fixes.time_s - believed_s)))
    reach = int(FARTHEST_S / GRID_S)
    lags = np.arange(-reach, reach + 1)
    squares = np.array([_squares(one, lags) for one in signals])
    if not len(squares):
        return None
    near = np.abs(lags) * GRID_S < WIDEST_S
    counts = np.array([np.isfinite(one.fixes).sum() for one in signals])
    k = int(np.argmax(np.where(near, -np.inf, -counts @ np.log1p(-squares))))
    if squares[:, k].max() < AGREES**2:
        return None
    counted = np.array([_counted(one, int(lags[k])) for one in signals])
    nats = -0.5 * counted @ np.log1p(-squares)
    log_odds = float(nats[k] - nats[near].max() - np.log(lags.size) - PRIOR)
    if log_odds < LIKELY:
        return None
    late_s, sigma_s = _finely(recording, fixes, believed_s + GRID_S * float(lags[k]))
    there, here = np.sqrt([squares[:, k].max(), squares[:, near].max()])
    seen = (
        f"{table}: it feels the motion of the IMU where its stamps are taken to be {late_s - believed_s:.4g} s late "
        f"(correlation {there:.2f}; within {WIDEST_S:g} s {here:.2f}), expected one clock"
    )
    mend = f"bring both to one clock, or state time_offset_s = {late_s:.3f} in [{table}]"
    return Finding(f"{table}.time_offset_s", seen, mend, log_odds, f"{late_s:.3f}", late=(late_s - believed_s, sigma_s))


def _signals(recording: Recording, fixes: Fixes) -> Iterator[_Signal]:
    """The turn of the course and the size of the specific force, as far as there is enough of them."""
    integrals, fixes = integrated(recording), fixes.rows(fixes.valid)
    if integrals is None or len(fixes.time_s) < FEWEST:
        return
    fixes, _ = without_missing_down(fixes)
    velocity_n, span_s = fixes.velocity_n, SPAN_S
    if np.isfinite(velocity_n).all(axis=1).sum() < FEWEST:
        velocity_n, span_s = differenced(fixes, SPAN_OF_POSITIONS_S), SPAN_OF_POSITIONS_S
    start_s = recording.start.time_s
    middle_s = start_s + GRID_S * np.arange(int((integrals.time_s[-1] - start_s) / GRID_S) + 1)
    around = middle_s - 0.5 * span_s, middle_s + 0.5 * span_s
    turn, force = (integrals.rates(name, *around) for name in ("angle", "velocity"))
    size = np.linalg.norm(force, axis=1)
    moves = np.hypot(velocity_n[:, 0], velocity_n[:, 1]) > MOVING_MPS  # NaN compares false
    if moves.sum() >= FEWEST:
        course = np.unwrap(np.arctan2(velocity_n[moves, 1], velocity_n[moves, 0]))
        first, rates = _rates(fixes.time_s[moves], course[:, None], start_s, span_s)
        yield _Signal(first, rates[:, 0], (turn * force).sum(axis=1) / np.maximum(size, HARDLY))
    known = np.isfinite(velocity_n).all(axis=1)
    if known.sum() >= FEWEST:
        first, rates = _rates(fixes.time_s[known], velocity_n[known], start_s, span_s)
        down = float(gravity(recording.start.latitude_rad, recording.start.height_m))
        yield _Signal(first, np.linalg.norm(rates - [0.0, 0.0, down], axis=1), size)


def _rates(time_s: np.ndarray, values: np.ndarray, start_s: float, span_s: float) -> tuple[int, np.ndarray]:
    """Number of the first instant of the grid from the start, and rates (n, k) of values (m, k), NaN across a gap."""
    first = int(np.floor((time_s[0] - start_s) / GRID_S))
    middle_s = start_s + GRID_S * np.arange(first, int(np.ceil((time_s[-1] - start_s) / GRID_S)) + 1)
    gaps_s = np.diff(time_s, prepend=-np.inf, append=np.inf)
    longest_s = max(2.0 * GRID_S, 1.5 * float(np.median(np.diff(time_s))))
    ends, whole = [], np.ones(middle_s.size, dtype=bool)
    for instants in (middle_s - 0.5 * span_s, middle_s + 0.5 * span_s):
        ends.append(np.column_stack([np.interp(instants, time_s, line) for line in values.T]))
        whole &= gaps_s[np.searchsorted(time_s, instants)] <= longest_s
    return first, np.where(whole[:, None], (ends[1] - ends[0]) / span_s, np.nan)


def _squares(signal: _Signal, lags: np.ndarray) -> np.ndarray:
    """Squares of the correlation at each of the `lags`, 0 where too few pairs are left."""
    x, y = signal.fixes, signal.imu
    if min(np.isfinite(x).sum(), np.isfinite(y).sum()) < FEWEST:
        return np.zeros(lags.size)
    of, r, pairs = _correlations(x, y)
    square = np.where(pairs >= max(FEWEST, SHARE * np.isfinite(x).sum()), r**2, 0.0)
    return np.interp(lags, of + signal.first, square, left=0.0, right=0.0)


def _counted(signal: _Signal, lag: int) -> float:
    """The effective number of means by what is left of a line through them at this lag."""
    there = np.arange(signal.fixes.size) + signal.first - lag
    inside = (there >= 0) & (there < signal.imu.size)
    wanted, seen = signal.fixes[inside], signal.imu[there[inside]]
    both = np.isfinite(wanted) & np.isfinite(seen)
    if both.sum() < FEWEST:
        return 0.0
    wanted, seen = wanted[both], seen[both]
    left = wanted - np.polyval(np.polyfit(seen, wanted, 1), seen)
    return float(left.size * effective_share(left))


def _correlations(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lags, the correlation of x (n,) with y (m,) at each, where both are known, and of how many pairs it is."""
    lags = np.arange(1 - y.size, x.size)
    length = next_fast_len(lags.size, real=True)

    def transformed(values: np.ndarray) -> list[np.ndarray]:
        known = np.isfinite(values)
        values = np.where(known, values - np.nanmean(values), 0.0)
        return [rfft(one, length) for one in (known.astype(float), values, values**2)]

    def summed(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return irfft(a * b.conj(), length)[lags]

    (one_x, x1, x2), (one_y, y1, y2) = transformed(x), transformed(y)
    n = np.maximum(summed(one_x, one_y), 0.5)
    sx, sy = summed(x1, one_y), summed(one_x, y1)
    xx, yy = summed(x2, one_y) - sx**2 / n, summed(one_x, y2) - sy**2 / n
    moved = (xx > HARDLY * x2[0].real) & (yy > HARDLY * y2[0].real)
    r = (summed(x1, y1) - sx * sy / n) / np.sqrt(np.where(moved, xx * yy, np.inf))
    return lags, np.clip(r, -1.0 + HARDLY, 1.0 - HARDLY), n


def _finely(recording: Recording, fixes: Fixes, late_s: float) -> tuple[float, float]:
    """By how much stamps are late that are so by about `late_s`, and one sigma."""
    if recording.imu.accelerometer_form == "increment":
        found = clock_offset(recording.imu, recording.start.time_s, replace(fixes, time_s=fixes.time_s - late_s))
        if found is not None:
            return late_s + found.offset_s, found.sigma_s
    return late_s, GRID_S
