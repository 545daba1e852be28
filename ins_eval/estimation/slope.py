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
    # lengths that the compiler does not know: loops of known ones are unrolled to scalar code
    states, moving = tape.gain.shape[1], design.shape[2]
    whole = states + m
    row = out.shape[0]
    joint = np.zeros((states, whole))  # Lambda and, beside it, lambda; sums of rows take three at once
    ahead = np.zeros((states, whole))  # the same with Lambda Phi
    phi = np.zeros((moving, whole))
    decay = np.ones(whole)  # of the columns of Phi that have no other entry; lambda has no column of it
    decay[:moving] = 0.0
    before_s = -1.0
    h = np.zeros(states)
    z = np.empty(m)
    gained = np.empty(whole)
    by_gain = np.empty(states)
    push = np.empty(whole)
    for k in range(nodes - 1, -1, -1):
        for channel in range(8, -1, -1):
            if not measured[k, channel]:
                continue
            row -= 1
            gain, s = tape.gain[row], tape.variance[row]
            root, inverse = np.sqrt(s), 1.0 / s
            for i in range(moving):
                h[i] = design[k, channel, i]
            h[9 + channel] = 1.0
            square = 0.0
            for c in range(m):
                z[c] = out[row, c] * root
                square += by_out[row, c] * out[row, c]
            for c in range(whole):
                gained[c] = 0.0
            for i in range(0, states, 3):
                x, y, w = gain[i], gain[i + 1], gain[i + 2]
                for c in range(whole):
                    gained[c] += x * joint[i, c] + y * joint[i + 1, c] + w * joint[i + 2, c]
            for i in range(states):
                x = 0.0
                for c in range(m):
                    x -= joint[i, states + c] * z[c]
                by_gain[i] = x
            by_s = -0.5 * (1.0 + square) * inverse
            for i in range(states):
                by_s += gain[i] * (gained[i] - by_gain[i] * inverse)
            found.white[k, channel] = 2.0 * noise.white[k, channel] * by_s
            for i in range(states):  # p' / 2, and beside it z'
                push[i] = 0.5 * (by_gain[i] * inverse + by_s * h[i]) - gained[i]
            for c in range(m):
                push[states + c] = by_out[row, c] / root - gained[states + c]
            for i in range(states):  # few channels see more than two states
                x = h[i]
                if x != 0.0:
                    for c in range(whole):
                        joint[i, c] += x * push[c]
                    for j in range(states):
                        joint[j, i] += x * push[j]
            h[9 + channel] = 0.0
        if k == 0:
            break
        e = k - 1
        dt = motion.interval_s[e]
        if dt != before_s:
            before_s = dt
            for i in range(15):
                decay[9 + i] = np.exp(-dt / (noise.slow_time_s[i] if i < 9 else noise.wander_time_s[i - 9]))
        force = rate = 0.0
        for i in range(moving):
            for j in range(moving):
                force += joint[i, j] * motion.walks[e, 0, i, j]
                rate += joint[i, j] * motion.walks[e, 1, i, j]
                phi[i, j] = motion.transition[e, i, j]
            for j in range(6):
                phi[i, 18 + j] = motion.coupling[e, i, j]
        found.force[e], found.rate[e] = force, rate
        for i in range(15):
            time = noise.slow_time_s[i] if i < 9 else noise.wander_time_s[i - 9]
            sigma = noise.slow_sigma[i] if i < 9 else noise.wander_sigma[i - 9]
            kept = decay[9 + i]
            own = joint[9 + i, 9 + i]
            fresh = sigma * sigma + noise.jumps[e, i] if i < 3 else sigma * sigma
            covered = told = 0.0
            for j in range(states):
                covered += joint[9 + i, j] * tape.covariance[k, 9 + i, j]
            for c in range(m):
                told += joint[9 + i, states + c] * tape.slow[k, i, c]
            # the covariance on the tape has what is fresh already
            by_log_decay = 2.0 * (covered - fresh * own) + kept * told
            by_sigma = 2.0 * sigma * (1.0 - kept * kept) * own
            by_time = by_log_decay * dt / (time * time) if kept > 0.0 else 0.0  # what is forgotten wholly
            if i < 9:
                found.slow_sigma[i] += by_sigma
                found.slow_time_s[i] += by_time
            else:
                found.wander_sigma[i - 9] += by_sigma
                found.wander_time_s[i - 9] += by_time
        # over the epoch: Lambda Phi, then Phi' of it and of lambda; below, a slow error of what measures has no row
        for i in range(states):
            for c in range(whole):
                ahead[i, c] = joint[i, c] * decay[c]
            if moving <= i < 18:
                continue
            for q in range(0, moving, 3):
                x, y, w = joint[i, q], joint[i, q + 1], joint[i, q + 2]
                for c in range(whole):
                    ahead[i, c] += x * phi[q, c] + y * phi[q + 1, c] + w * phi[q + 2, c]
        for i in range(states):
            x = decay[i]
            for c in range(whole):
                joint[i, c] = x * ahead[i, c]
            if moving <= i < 18:
                continue
            for q in range(0, moving, 3):
                x, y, w = phi[q, i], phi[q + 1, i], phi[q + 2, i]
                for c in range(whole):
                    joint[i, c] += x * ahead[q, c] + y * ahead[q + 1, c] + w * ahead[q + 2, c]
        # one triangle is both: what rounding leaves uneven no measurement damps, and in hours it grew as heights do
        for i in range(9, 18):
            for j in range(18, states):
                joint[i, j] = joint[j, i]
        for i in range(states):
            for j in range(i + 1, states):
                joint[j, i] = joint[i, j]
    for i in range(9):
        found.slow_sigma[i] += 2.0 * noise.slow_sigma[i] * joint[9 + i, 9 + i]
