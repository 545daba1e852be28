"""How the evidence changes with every level of the noise, in one pass forth and one back.

With L(out, log|S|) the log evidence as a function of the whitened rows, the adjoint of the filter (`whitening`) carries
lambda = dL/dxi (24, m) and Lambda = dL/dP (24, 24) from the last node to the first. At a measurement, with
K = P h / s, o = dL/de and l = dL/dlog s,

    z' = o / sqrt(s) - K' lambda,   k' = -lambda z,   s' = (l - o e / 2 - k' K) / s + K' Lambda K
    p' = k' / s - 2 Lambda K + s' h,   lambda += h z',   Lambda += (p' h' + h p') / 2

and over an epoch lambda = Phi' lambda, Lambda = Phi' Lambda Phi; the sums of Lambda where process noise enters, and of
both where a state decays, are the slopes. Differences would need one pass for each level.

Sources: Koopman and Shephard, Biometrika 79 (1992) 823 (the exact score of a state space model); Griewank and Walther,
Evaluating Derivatives, SIAM 2008 (adjoints).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numba
import numpy as np

from ins_eval.estimation import still
from ins_eval.estimation.kalman import FASTMATH
from ins_eval.estimation.whitening import Whitened, gains, initial, motion, respond

if TYPE_CHECKING:
    from collections.abc import Callable

    from ins_eval.error_model.columns import Assembled
    from ins_eval.estimation.kalman import NoiseLevels


class Slopes(NamedTuple):
    """dL by what the filter allows for, as in `NoiseLevels`."""

    white: np.ndarray
    force: np.ndarray
    rate: np.ndarray
    slow_sigma: np.ndarray
    slow_time_s: np.ndarray
    wander_sigma: np.ndarray
    wander_time_s: np.ndarray


def slopes(
    columns: Assembled, noise: NoiseLevels, sensitivity: Callable[[Whitened], tuple[float, np.ndarray]]
) -> tuple[float, Slopes]:
    """L and its slopes. `sensitivity` tells L of the sums and dL by those of residual and columns (1 + m, 1 + m).

    L falls by log|S| / 2.
    """
    measured = np.isfinite(columns.residual)
    nodes, rows = measured.shape[0], int(measured.sum())
    out = np.empty((rows, columns.count))
    recorded, log_determinant = gains(columns, noise, columns.count)
    every = np.arange(columns.count)
    respond(columns, noise, every, initial(columns), (0, nodes), recorded, out)
    total = out.T @ out
    kept = np.full((nodes, 9, 1), np.nan)
    kept[measured] = out[:, :1]
    whitened = Whitened(total[1:, 1:], total[1:, 0], float(total[0, 0]), log_determinant, rows, kept)
    height, by_sums = sensitivity(whitened)
    found = Slopes(*(np.zeros(n) for n in ((nodes, 9), nodes - 1, nodes - 1, 9, 9, 6, 6)))
    by_out = out @ (2.0 * by_sums)
    if columns.still:
        still.back(columns.channels, columns.interval_s, measured, noise, recorded, out, by_out, found)
    else:
        _back(motion(columns, every), measured, columns.design, noise, recorded, out, by_out, found)
    return height, found


@numba.njit(cache=True, nogil=True, fastmath=FASTMATH)
def _back(motion, measured, design, noise, tape, out, by_out, found):
    nodes, m = measured.shape[0], out.shape[1]
    row = out.shape[0]
    adjoint = np.zeros((24, m))
    before = np.zeros((24, m))
    spread = np.zeros((24, 24))
    left = np.zeros((24, 24))
    decay = np.empty(15)
    z = np.empty(m)
    z_adjoint = np.empty(m)
    h = np.zeros(24)
    spread_gain = np.empty(24)
    gain_adjoint = np.empty(24)
    push = np.empty(24)
    line = np.empty(24)
    for k in range(nodes - 1, -1, -1):
        for channel in range(8, -1, -1):
            if not measured[k, channel]:
                continue
            row -= 1
            gain, s = tape.gain[row], tape.variance[row]
            root = np.sqrt(s)
            h[:] = 0.0
            for i in range(9):
                h[i] = design[k, channel, i]
            h[9 + channel] = 1.0
            square = 0.0
            for c in range(m):
                z[c] = out[row, c] * root
                z_adjoint[c] = by_out[row, c] / root
                square += by_out[row, c] * out[row, c]
            for i in range(24):
                x = 0.0
                for c in range(m):
                    x -= adjoint[i, c] * z[c]
                gain_adjoint[i] = x
                g = gain[i]
                for c in range(m):
                    z_adjoint[c] -= g * adjoint[i, c]
            by_s = -0.5 / s - 0.5 * square / s
            for i in range(24):
                x = 0.0
                for j in range(24):
                    x += spread[i, j] * gain[j]
                spread_gain[i] = x
                by_s += gain[i] * x - gain_adjoint[i] * gain[i] / s
            found.white[k, channel] = 2.0 * noise.white[k, channel] * by_s
            for i in range(24):
                push[i] = gain_adjoint[i] / s - 2.0 * spread_gain[i] + by_s * h[i]
            for i in range(24):  # few channels see more than two states
                x = h[i]
                if x != 0.0:
                    for j in range(24):
                        spread[i, j] += 0.5 * x * push[j]
                    for j in range(24):
                        spread[j, i] += 0.5 * x * push[j]
                    for c in range(m):
                        adjoint[i, c] += x * z_adjoint[c]
        if k == 0:
            break
        e = k - 1
        f, g, dt = motion.transition[e], motion.coupling[e], motion.interval_s[e]
        for i in range(9):
            for j in range(9):
                found.force[e] += spread[i, j] * motion.walks[e, 0, i, j]
                found.rate[e] += spread[i, j] * motion.walks[e, 1, i, j]
        # over the epoch, by states: adjoint first, then both sides of the covariance, along rows
        for j in range(9):
            for c in range(m):
                before[j, c] = 0.0
            for c in range(24):
                left[j, c] = 0.0
            for i in range(9):
                x = f[i, j]
                if x != 0.0:
                    for c in range(m):
                        before[j, c] += x * adjoint[i, c]
                    for c in range(24):
                        left[j, c] += x * spread[i, c]
        for i in range(15):
            time = noise.slow_time_s[i] if i < 9 else noise.wander_time_s[i - 9]
            sigma = noise.slow_sigma[i] if i < 9 else noise.wander_sigma[i - 9]
            kept = np.exp(-dt / time)
            decay[i] = kept
            own = spread[9 + i, 9 + i]
            fresh = sigma * sigma + noise.jumps[e, i] if i < 3 else sigma * sigma
            by_log_decay = -2.0 * fresh * own  # the covariance on the tape has what is fresh already
            for j in range(24):
                by_log_decay += 2.0 * spread[9 + i, j] * tape.covariance[k, 9 + i, j]
                left[9 + i, j] = kept * spread[9 + i, j]
            for c in range(m):
                by_log_decay += kept * adjoint[9 + i, c] * tape.slow[k, i, c]
                before[9 + i, c] = kept * adjoint[9 + i, c]
            by_sigma = 2.0 * sigma * (1.0 - kept * kept) * own
            by_time = by_log_decay * dt / (time * time) if kept > 0.0 else 0.0  # what is forgotten wholly
            if i < 9:
                found.slow_sigma[i] += by_sigma
                found.slow_time_s[i] += by_time
            else:
                found.wander_sigma[i - 9] += by_sigma
                found.wander_time_s[i - 9] += by_time
                for q in range(9):
                    x = g[q, i - 9]
                    for c in range(m):
                        before[9 + i, c] += x * adjoint[q, c]
                    for j in range(24):
                        left[9 + i, j] += x * spread[q, j]
        # one triangle is both: what rounding leaves uneven no measurement damps, and in hours it grew as heights do
        for i in range(24):
            for j in range(24):
                line[j] = decay[j - 9] * left[i, j] if j >= 9 else 0.0
            for q in range(9):
                x = left[i, q]
                if i < 9:
                    for j in range(9):
                        line[j] += x * f[q, j]
                for j in range(6):
                    line[18 + j] += x * g[q, j]
            for j in range(i, 24):
                spread[i, j] = spread[j, i] = line[j]
        for i in range(24):
            for c in range(m):
                adjoint[i, c] = before[i, c]
    for i in range(9):
        found.slow_sigma[i] += 2.0 * noise.slow_sigma[i] * spread[9 + i, 9 + i]
