"""The compiled pass of the filter that `whitening` asks for: what it makes of the noise, and of the columns.

The states are 9 of the navigation error, 9 slow errors of what measures and 6 wanders of sensors; channels are taken
one by one. The equations are those of `whitening`.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

ALL_STATES = 24
FASTMATH = {"contract", "reassoc", "nsz"}


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


class Tape(NamedTuple):
    """What the filter makes of the noise, for the columns, and what the adjoint of a pass needs besides (`slope`).

    `gain` (rows, 24) and `variance` (rows,) of each measurement. For the adjoint, else without nodes: `covariance`
    (nodes, 24, 24) before the measurements of a node, `slow` (nodes, 15, m) the states of the columns that decay,
    before they do. Where nothing moves (`still`) they are (rows, 1), (nodes, n, 1) and (nodes, n, m) of n channels.
    """

    gain: np.ndarray
    variance: np.ndarray
    covariance: np.ndarray
    slow: np.ndarray


class Measured(NamedTuple):
    """`residual` (nodes, 9), NaN where nothing was measured, and `design` (nodes, 9, 9) of the navigation error."""

    residual: np.ndarray
    design: np.ndarray


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


@numba.njit(cache=True, nogil=True, fastmath=FASTMATH)
def filtered(motion, measured, noise, tape):
    residual, design = measured.residual, measured.design
    p = np.zeros((24, 24))
    for i in range(9):
        p[9 + i, 9 + i] = noise.slow_sigma[i] * noise.slow_sigma[i]
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
                p[9 + i, 9 + i] += sigma * sigma * (1.0 - decay[i] * decay[i])
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
            s = noise.white[k, channel] * noise.white[k, channel]
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
def responded(first, last, motion, shown, measured, noise, tape, xi, column, out):
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
