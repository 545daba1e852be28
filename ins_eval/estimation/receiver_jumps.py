"""Where the position of a receiver jumps, as it does by metres when the set of its satellites changes.

Position and velocity of one receiver tell its own errors apart from those of the INS: of

    y = r_p - integral of r_v dt,    r INS less receiver, metres and m/s north, east, down,

nothing is left that moves the INS or the antenna, so that a jump s of the receiver stands in it between two fixes. With
means m_1..m_4 of y over four stretches of n fixes, two before an instant and two after it,

    D_1 = m_3 - m_2 = n a + s,    D_2 = m_4 - m_1 = 3 n a + s,    s = (3 D_1 - D_2) / 2

whatever the slope a. A clock that is set anew moves positions as well, but along the way only: `jumps` are taken where
some jump across it, and then wherever one shows, along it or not, with the variance of those across.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.integrate import cumulative_trapezoid

if TYPE_CHECKING:
    from ins_eval.error_model.observations import Observations

POSITION, VELOCITY = slice(0, 3), slice(3, 6)
STRETCH_S, FEWEST = 30.0, 10  # of each of the four means, and fixes in it: satellites change in minutes; by reasoning
HOLES = 1.1  # times its length that a window lasts at most: over a hole the integral knows too little
SHOWS = 5.0  # sigmas: across the way once in hundreds of hours by chance
NORMAL_MAD = 0.6745
MOVING_MPS = 1.0  # below which no clock moves a position


def jumps(seen: Observations, nodes_s: np.ndarray) -> np.ndarray:
    """Variance (epochs, 3) that jumps of a receiver add to its slow position error in an epoch, m^2.

    At most that of the position that is stated: what is farther off is no noise of that receiver.
    """
    out = np.zeros((nodes_s.size - 1, 3))
    if seen.measured_by[0] != "gps" or seen.measured_by[3] != "gps" or seen.arc.any():
        return out
    here = np.flatnonzero(np.isfinite(seen.residual[:, :6]).all(axis=1))
    size, known = _sizes(seen.residual[here], nodes_s[here])
    if not known.any():
        return out
    sigma = np.median(np.abs(size[known]), axis=0) / NORMAL_MAD
    of_delay = seen.of_delay[here, POSITION]
    speed = np.linalg.norm(of_delay, axis=1, keepdims=True)
    along = np.divide(of_delay, speed, out=np.zeros_like(of_delay), where=speed > MOVING_MPS)
    z = np.where(known[:, None], size / sigma, 0.0)
    across = z - (z * along).sum(axis=1, keepdims=True) * along
    at = _peaks((z**2).sum(axis=1), nodes_s[here])
    sure = at[(across[at] ** 2).sum(axis=1) > SHOWS**2]
    if not sure.size:
        return out
    stated = np.median(seen.sigma[here, POSITION], axis=0)
    down = stated / stated[0]
    variance = np.minimum(((size[sure] / down) ** 2).mean(), stated[0] ** 2)
    out[here[at] - 1] = variance * down**2
    return out


def _sizes(residual: np.ndarray, time_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """s (n, 3) before each fix, and whether it is known."""
    count = time_s.size
    size, known = np.zeros((count, 3)), np.zeros(count, dtype=bool)
    if count < 2:
        return size, known
    interval_s = float(np.median(np.diff(time_s)))
    n = max(FEWEST, round(STRETCH_S / interval_s))
    if count < 4 * n:
        return size, known
    y = residual[:, POSITION] - cumulative_trapezoid(residual[:, VELOCITY], time_s, axis=0, initial=0.0)
    total = np.vstack([np.zeros(3), np.cumsum(y - y.mean(axis=0), axis=0)])
    mean = (total[n:] - total[:-n]) / n  # of n fixes from each on
    at = np.arange(2 * n, count - 2 * n + 1)
    first, second = mean[at] - mean[at - n], mean[at + n] - mean[at - 2 * n]
    size[at] = 0.5 * (3.0 * first - second)
    lasts_s = time_s[at + 2 * n - 1] - time_s[at - 2 * n]
    known[at] = lasts_s < HOLES * 4 * n * interval_s
    return size, known


def _peaks(square: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """Fixes at which something shows, the largest within `STRETCH_S` of each."""
    shows = np.flatnonzero(square > SHOWS**2)
    found: list[int] = []
    for k in shows[np.argsort(-square[shows])]:
        if all(abs(time_s[k] - time_s[j]) > STRETCH_S for j in found):
            found.append(int(k))
    return np.array(sorted(found), dtype=int)
