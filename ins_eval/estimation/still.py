"""The pass of the filter where nothing moves: a bench, whose readings show no navigation error.

Then the slow errors of what measures are the only states, one in each of the `channels` (n,) that measure, and none
tells of another. With the decay f = exp(-dt / tau) over an epoch,

    P- = f^2 P+ + sigma^2 (1 - f^2) + jumps,   S = P- + white^2,   K = P- / S,   P+ = (1 - K) P-
    xi- = f xi+,   z = xi- + o,   e = z / sqrt(S),   xi+ = xi- - K z

which `kalman` does as well, with 24 states that stay 0. The adjoint is that of `slope`.
"""

from __future__ import annotations

import numba
import numpy as np

from ins_eval.estimation.kalman import FASTMATH


@numba.njit(cache=True, nogil=True, fastmath=FASTMATH)
def filtered(channels, interval_s, measured, noise, tape):
    """Gains and variances onto the `tape`; returns log|S|."""
    residual = measured.residual
    taping = tape.covariance.size > 0
    p = noise.slow_sigma[channels] * noise.slow_sigma[channels]
    row = 0
    logs = 0.0
    for k in range(residual.shape[0]):
        for n in range(channels.size):
            i = channels[n]
            if k > 0:
                kept = np.exp(-2.0 * interval_s[k - 1] / noise.slow_time_s[i])
                p[n] = kept * p[n] + noise.slow_sigma[i] * noise.slow_sigma[i] * (1.0 - kept)
                if i < 3:
                    p[n] += noise.jumps[k - 1, i]
            if taping:
                tape.covariance[k, n, 0] = p[n]
            if not np.isfinite(residual[k, i]):
                continue
            s = p[n] + noise.white[k, i] * noise.white[k, i]
            tape.gain[row, 0] = p[n] / s
            tape.variance[row] = s
            p[n] -= tape.gain[row, 0] * p[n]
            logs += np.log(s)
            row += 1
    return logs


@numba.njit(cache=True, nogil=True, fastmath=FASTMATH)
def responded(first, last, channels, interval_s, shown, measured, noise, tape, xi, column, out):
    """The whitened rows of the columns whose states are `xi` (n, m), into `out` from `column` on."""
    residual = measured.residual
    taping = tape.slow.size > 0
    m = xi.shape[1]
    z = np.empty(m)
    row = 0
    for k in range(first, last):
        for n in range(channels.size):
            i = channels[n]
            if k > 0:
                decay = np.exp(-interval_s[k - 1] / noise.slow_time_s[i])
                for c in range(m):
                    if taping:
                        tape.slow[k, n, c] = xi[n, c]
                    xi[n, c] *= decay
            if not np.isfinite(residual[k, i]):
                continue
            for c in range(m):
                z[c] = xi[n, c]
            for t in range(shown.terms.shape[0]):
                c, s, slow = shown.terms[t, 0], shown.terms[t, 1], shown.terms[t, 2]
                z[c] += shown.weights[t] * shown.slow_nodes[slow, k] * shown.observed[k, s, i]
            root = 1.0 / np.sqrt(tape.variance[row])
            gain = tape.gain[row, 0]
            for c in range(m):
                out[row, column + c] = root * z[c]
                xi[n, c] -= gain * z[c]
            row += 1


@numba.njit(cache=True, nogil=True, fastmath=FASTMATH)
def back(channels, interval_s, measured, noise, tape, out, by_out, found):
    """From the last node to the first, the slopes into `found`; `measured` (nodes, 9) tells what was."""
    nodes, m = measured.shape[0], out.shape[1]
    row = out.shape[0]
    adjoint = np.zeros((channels.size, m))
    spread = np.zeros(channels.size)
    for k in range(nodes - 1, -1, -1):
        for n in range(channels.size - 1, -1, -1):
            i = channels[n]
            if not measured[k, i]:
                continue
            row -= 1
            gain, s = tape.gain[row, 0], tape.variance[row]
            root = np.sqrt(s)
            square = 0.0
            gain_adjoint = 0.0
            for c in range(m):
                square += by_out[row, c] * out[row, c]
                gain_adjoint -= adjoint[n, c] * out[row, c] * root
            by_s = -0.5 / s - 0.5 * square / s + gain * gain * spread[n] - gain_adjoint * gain / s
            found.white[k, i] = 2.0 * noise.white[k, i] * by_s
            spread[n] += gain_adjoint / s - 2.0 * gain * spread[n] + by_s
            for c in range(m):
                adjoint[n, c] += by_out[row, c] / root - gain * adjoint[n, c]
        if k == 0:
            break
        dt = interval_s[k - 1]
        for n in range(channels.size):
            i = channels[n]
            time, sigma = noise.slow_time_s[i], noise.slow_sigma[i]
            kept = np.exp(-dt / time)
            fresh = sigma * sigma + noise.jumps[k - 1, i] if i < 3 else sigma * sigma
            by_log_decay = 2.0 * spread[n] * (tape.covariance[k, n, 0] - fresh)
            for c in range(m):
                by_log_decay += kept * adjoint[n, c] * tape.slow[k, n, c]
                adjoint[n, c] *= kept
            found.slow_sigma[i] += 2.0 * sigma * (1.0 - kept * kept) * spread[n]
            found.slow_time_s[i] += by_log_decay * dt / (time * time) if kept > 0.0 else 0.0  # what is forgotten wholly
            spread[n] *= kept * kept
    for n in range(channels.size):
        found.slow_sigma[channels[n]] += 2.0 * noise.slow_sigma[channels[n]] * spread[n]
