"""Where the position of a receiver jumps, as it does by metres when the set of its satellites changes.

Position and velocity of one receiver tell its own errors apart from those of the INS: of

    y = r_p - integral of (r_v + F r_p) dt - what the height loop did,

with r the INS less the receiver in metres and m/s north, east, down, and F what a position that is off makes of a
velocity over the Earth, nothing is left that moves the INS or the antenna, so that a jump s of the receiver stands in
it between two fixes. With
means m_1..m_4 of y over four stretches of n fixes, two before an instant and two after it,

    D_1 = m_3 - m_2 = n a + s,    D_2 = m_4 - m_1 = 3 n a + s,    s = (3 D_1 - D_2) / 2

whatever the slope a. Beside a jump the same means show half of it with the other sign, so the largest is taken off
before the next is looked for. A clock that is set anew moves positions as well, but along the way only: `jumps` are
taken where some jump across it, and then wherever one shows, along it or not, with the variance of those across.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.integrate import cumulative_trapezoid

from ins_eval.random_processes import NORMAL_MAD

if TYPE_CHECKING:
    from ins_eval.error_model.observations import Observations
    from ins_eval.error_model.propagation import ErrorModel

POSITION, VELOCITY = slice(0, 3), slice(3, 6)
STRETCH_S, FEWEST = 30.0, 10  # of each of the four means, and fixes in it: satellites change in minutes; by reasoning
HOLE = 5.0  # intervals without a fix, over which the integral knows too little: by reasoning
SHOWS = 5.0  # sigmas: across the way once in some hundred hours of white noise
MOVING_MPS = 1.0  # below which no clock moves a position: by reasoning


def jumps(seen: Observations, white: np.ndarray, model: ErrorModel) -> np.ndarray:
    """Variance (epochs, 3) that jumps of a receiver add to its slow position error in an epoch, m^2.

    At most that of the position that is stated: what is farther off is no noise of that receiver. How far s scatters is
    read off itself, and is at least what white noise makes of it, sqrt(5 / n) of one sigma: of `white` (nodes, 9) and
    of how y changes from fix to fix there.
    """
    out = np.zeros((model.nodes_s.size - 1, 3))
    here = np.flatnonzero(np.isfinite(seen.residual[:, :6]).all(axis=1))
    if set(seen.measured_by[:6]) != {"gps"} or seen.arc.any() or here.size < 4 * FEWEST:
        return out
    time_s = model.nodes_s[here]
    interval_s = float(np.median(np.diff(time_s)))
    n = max(FEWEST, round(STRETCH_S / interval_s))
    y = _of_receiver(seen, model, here)
    size, known = _sizes(y, n), _whole(time_s, n, interval_s)
    if not known.any():
        return out
    sigma = np.maximum(np.median(np.abs(size[known]), axis=0) / NORMAL_MAD, _of_white(y, white[here, POSITION], n))
    at, sizes = _one_by_one(y, n, known, sigma)
    z, way = sizes / sigma[at], seen.of_delay[here[at], POSITION]
    way = np.where(np.linalg.norm(way, axis=1, keepdims=True) > MOVING_MPS, way / sigma[at], 0.0)
    along = way / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-300)
    across = z - (z * along).sum(axis=1, keepdims=True) * along
    sure = (across**2).sum(axis=1) > SHOWS**2
    if sure.any():
        stated = np.median(seen.sigma[here, POSITION], axis=0)
        out[here[at] - 1] = np.minimum((sizes[sure] ** 2).mean(), stated**2)
    return out


def _of_receiver(seen: Observations, model: ErrorModel, here: np.ndarray) -> np.ndarray:
    """y (m, 3) at the nodes `here`."""
    done = np.vstack([np.zeros(3), np.cumsum(model.known[:, POSITION], axis=0)])[here]
    position, velocity, epoch = seen.residual[here, POSITION], seen.residual[here, VELOCITY], np.maximum(here - 1, 0)
    over_earth = (model.transition[epoch, POSITION, POSITION] - np.eye(3)) / model.interval_s[epoch, None, None]
    rate = velocity + np.einsum("kij,kj->ki", over_earth, position)
    return position - cumulative_trapezoid(rate, model.nodes_s[here], axis=0, initial=0.0) - done


def _means(values: np.ndarray, n: int) -> np.ndarray:
    """Means (m - n + 1, ...) of `n` rows from each of m on."""
    total = np.vstack([np.zeros(values.shape[1]), np.cumsum(values - values.mean(axis=0), axis=0)])
    return (total[n:] - total[:-n]) / n + values.mean(axis=0)


def _sizes(y: np.ndarray, n: int) -> np.ndarray:
    """s (m, 3) before each of m fixes from stretches of `n`, 0 within two of them from either end."""
    size, mean = np.zeros_like(y), _means(y, n)
    at = np.arange(2 * n, len(y) - 2 * n + 1)
    size[at] = 0.5 * (3.0 * (mean[at] - mean[at - n]) - (mean[at + n] - mean[at - 2 * n]))
    return size


def _whole(time_s: np.ndarray, n: int, interval_s: float) -> np.ndarray:
    """Whether all four stretches about each fix (m,) are there, without a hole."""
    holes = np.append(0, np.cumsum(np.diff(time_s) > HOLE * interval_s))
    out = np.zeros(time_s.size, dtype=bool)
    at = np.arange(2 * n, time_s.size - 2 * n + 1)
    out[at] = holes[at + 2 * n - 1] == holes[at - 2 * n]
    return out


def _of_white(y: np.ndarray, white: np.ndarray, n: int) -> np.ndarray:
    """One sigma (m, 3) of s by the white noise of the four stretches about each fix."""
    changes = np.vstack([np.zeros(3), np.diff(y, axis=0)])
    variance = np.maximum(_means(white**2, 4 * n), 0.5 * _means(changes**2, 4 * n))
    at = np.clip(np.arange(len(y)) - 2 * n, 0, len(variance) - 1)
    return np.sqrt(5.0 / n * variance[at])


def _one_by_one(y: np.ndarray, n: int, known: np.ndarray, sigma: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Fixes (k,) before which something jumps, and sizes (k, 3): the largest first, and taken off before the next."""
    y = y.copy()
    at: list[int] = []
    sizes: list[np.ndarray] = []
    for _ in range(len(y) // n):
        size = _sizes(y, n)
        square = np.where(known, ((size / sigma) ** 2).sum(axis=1), 0.0)
        k = int(np.argmax(square))
        if square[k] < SHOWS**2 or any(abs(k - j) < n for j in at):
            break
        y[k:] -= size[k]
        at.append(k)
        sizes.append(size[k])
    return np.array(at, dtype=int), np.reshape(sizes, (-1, 3))
