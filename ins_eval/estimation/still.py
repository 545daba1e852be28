"""The pass of the filter where nothing moves: a bench, whose readings show no navigation error.

Then the slow errors of what measures are the only states, one in each channel, and no channel tells of another. With
the decay f = exp(-dt / tau) of channel i over an epoch,

    P- = f^2 P+ + sigma^2 (1 - f^2) + jumps,   S = P- + white^2,   K = P- / S,   P+ = (1 - K) P-
    xi- = f xi+,   z = xi- + o,   e = z / sqrt(S),   xi+ = xi- - K z

which `kalman` does as well, with 24 states that stay 0. The adjoint is that of `slope`.
"""

from __future__ import annotations

import numba
import numpy as np

from ins_eval.estimation.kalman import FASTMATH


@numba.njit(cache=True, nogil=True, fastmath=FASTMATH)
def filtered(interval_s, measured, noise, tape):
    """Gains and variances onto the `tape`; returns log|S|."""
    residual = measured.residual
    taping = tape.covariance.size > 0
    p = noise.slow_sigma**2
    row = 0
    logs = 0.0
    for k in range(residual.shape[0]):
        if k > 0:
            for i in range(9):
                kept = np.exp(-2.0 * interval_s[k - 1] / noise.slow_time_s[i])
                p[i] = kept * p[i] + noise.slow_sigma[i] ** 2 * (1.0 - kept)
                if i < 3:
                    p[i] += noise.jumps[k - 1, i]
        for i in range(9):
            if taping:
                tape.covariance[k, i, 0] = p[i]
            if not np.isfinite(residual[k, i]):
                continue
            s = p[i] + noise.white[k, i] ** 2
            tape.gain[row, 0] = p[i] / s
            tape.variance[row] = s
            p[i] -= tape.gain[row, 0] * p[i]
            logs += np.log(s)
            row += 1
    return logs


@numba.njit(cache=True, nogil=True, fastmath=FASTMATH)
def responded(first, last, interval_s, shown, measured, noise, tape, xi, column, out):
    """The whitened rows of the columns whose states are `xi` (9, m), into `out` from `column` on."""
    residual = measured.residual
    taping = tape.slow.size > 0
    m = xi.shape[1]
    z = np.empty(m)
    row = 0
    for k in range(first, last):
        for i in range(9):
            if k > 0 and noise.slow_sigma[i] > 0.0:  # else its state stays 0
                decay = np.exp(-interval_s[k - 1] / noise.slow_time_s[i])
                for c in range(m):
                    if taping:
                        tape.slow[k, i, c] = xi[i, c]
                    xi[i, c] *= decay
            if not np.isfinite(residual[k, i]):
                continue
            for c in range(m):
                z[c] = xi[i, c]
            for n in range(shown.terms.shape[0]):
                c, s, slow = shown.terms[n, 0], shown.terms[n, 1], shown.terms[n, 2]
                z[c] += shown.weights[n] * shown.slow_nodes[slow, k] * shown.observed[k, s, i]
            root = 1.0 / np.sqrt(tape.variance[row])
            gain = tape.gain[row, 0]
            for c in range(m):
                out[row, column + c] = root * z[c]
                xi[i, c] -= gain * z[c]
            row += 1


@numba.njit(cache=True, nogil=True, fastmath=FASTMATH)
def back(interval_s, measured, noise, tape, out, by_out, found):
    """From the last node to the first, the slopes into `found`; `measured` (nodes, 9) tells what was."""
    nodes, m = measured.shape[0], out.shape[1]
    row = out.shape[0]
    adjoint = np.zeros((9, m))
    spread = np.zeros(9)
    for k in range(nodes - 1, -1, -1):
        for i in range(8, -1, -1):
            if not measured[k, i]:
                continue
            row -= 1
            gain, s = tape.gain[row, 0], tape.variance[row]
            root = np.sqrt(s)
            square = 0.0
            gain_adjoint = 0.0
            for c in range(m):
                square += by_out[row, c] * out[row, c]
                gain_adjoint -= adjoint[i, c] * out[row, c] * root
            by_s = -0.5 / s - 0.5 * square / s + gain * gain * spread[i] - gain_adjoint * gain / s
            found.white[k, i] = 2.0 * noise.white[k, i] * by_s
            spread[i] += gain_adjoint / s - 2.0 * gain * spread[i] + by_s
            for c in range(m):
                adjoint[i, c] += by_out[row, c] / root - gain * adjoint[i, c]
        if k == 0:
            break
        dt = interval_s[k - 1]
        for i in range(9):
            time, sigma = noise.slow_time_s[i], noise.slow_sigma[i]
            if sigma == 0.0:
                continue
            kept = np.exp(-dt / time)
            fresh = sigma**2 + noise.jumps[k - 1, i] if i < 3 else sigma**2
            by_log_decay = 2.0 * spread[i] * (tape.covariance[k, i, 0] - fresh)
            for c in range(m):
                by_log_decay += kept * adjoint[i, c] * tape.slow[k, i, c]
                adjoint[i, c] *= kept
            found.slow_sigma[i] += 2.0 * sigma * (1.0 - kept**2) * spread[i]
            found.slow_time_s[i] += by_log_decay * dt / time**2 if kept > 0.0 else 0.0  # what is forgotten wholly
            spread[i] *= kept**2
    for i in range(9):
        found.slow_sigma[i] += 2.0 * noise.slow_sigma[i] * spread[i]
