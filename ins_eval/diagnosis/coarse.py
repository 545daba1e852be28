"""The same regression on means over a few measurements: a fifth of the work where nothing changes within seconds.

Transitions and drives are composed exactly; residual and responses are averaged over a block of nodes and stand at its
middle node. White noise of n measurements becomes white noise of sigma / sqrt(n). What is lost is what a navigation
error does within a block beyond a straight line. Blocks in which a channel is not complete are left out of it.
"""

from __future__ import annotations

from dataclasses import replace

import numba
import numpy as np

from ins_eval.diagnosis.columns import TO_ATTITUDE, TO_POSITION, TO_VELOCITY, Assembled
from ins_eval.diagnosis.whitening import NoiseLevels

BLOCK_S = 5.0
FEWEST_NODES = 1500  # of a recording that is worth it


def block_of(interval_s: np.ndarray) -> int:
    """Nodes in a block, an odd number; 1 where the recording is short."""
    if interval_s.size < FEWEST_NODES:
        return 1
    return max(1, int(BLOCK_S / float(np.median(interval_s))) // 2 * 2 + 1)


def coarse(fine: Assembled, block: int) -> Assembled:
    """The columns of `fine` on blocks of so many nodes; the first node, the start, stands alone."""
    if block == 1:
        return fine
    blocks = (fine.residual.shape[0] - 1) // block
    m = fine.count
    transition = np.empty((blocks, 9, 9))
    coupling = np.empty((blocks, 9, 6))
    sources = np.zeros((blocks, 3 * m, 3))
    observed = np.zeros((blocks + 1, m, 9))
    _compose(
        block, fine.transition, fine.half, fine.coupling, fine.sources, fine.slow_epochs, fine.drive_terms,
        fine.drive_weights, fine.observed, fine.slow_nodes, fine.observation_terms, fine.observation_weights,
        transition, coupling, sources, observed,
    )  # fmt: skip
    rows = np.arange(1, blocks * block + 1).reshape(blocks, block)
    residual = np.concatenate([fine.residual[:1], fine.residual[rows].mean(axis=1)])
    time_s = np.concatenate([[0.0], np.cumsum(fine.interval_s)])
    middle = rows[:, block // 2]
    each = np.arange(m)
    drive_terms = [(c, target, 3 * c + k, 0) for c in each for k, target in enumerate(_TARGETS)]
    return replace(
        fine,
        transition=transition,
        half=np.tile(np.eye(9), (blocks, 1, 1)),
        coupling=coupling,
        interval_s=np.diff(np.append(0.0, time_s[middle])),
        sources=sources,
        slow_epochs=np.ones((1, blocks)),
        drive_terms=np.array(drive_terms, dtype=np.int64),
        drive_weights=np.ones(3 * m),
        residual=residual,
        design=np.concatenate([fine.design[:1], fine.design[rows].mean(axis=1)]),
        observed=observed,
        slow_nodes=np.ones((1, blocks + 1)),
        observation_terms=np.column_stack([each, each, np.zeros(m, dtype=np.int64)]),
        observation_weights=np.ones(m),
    )


def coarse_noise(levels: NoiseLevels, block: int) -> NoiseLevels:
    """The same noise on blocks."""
    if block == 1:
        return levels
    blocks = (levels.white.shape[0] - 1) // block
    rows = np.arange(1, blocks * block + 1).reshape(blocks, block)
    first = np.append(0, rows[:-1, block // 2])  # epochs between the middle nodes
    total = np.concatenate([np.zeros((1, 3, 3)), np.cumsum(levels.force, axis=0)])
    turned = np.append(0.0, np.cumsum(levels.rate))
    last = rows[:, block // 2]
    return replace(
        levels,
        white=np.concatenate([levels.white[:1], np.sqrt((levels.white[rows] ** 2).sum(axis=1)) / block]),
        force=total[last] - total[first],
        rate=turned[last] - turned[first],
    )


_TARGETS = (TO_POSITION, TO_VELOCITY, TO_ATTITUDE)


@numba.njit(cache=True, nogil=True)
def _compose(
    block, transition, half, coupling, sources, slow_epochs, drives, drive_weights, observed, slow_nodes, shown,
    shown_weights, out_transition, out_coupling, out_sources, out_observed,
):  # fmt: skip
    m = out_observed.shape[1]
    state = np.zeros((9, m))
    work = np.zeros((9, m))
    pushed = np.zeros((9, m))
    phi, g = np.eye(9), np.zeros((9, 6))
    for n in range(shown.shape[0]):
        c, s, slow = shown[n, 0], shown[n, 1], shown[n, 2]
        for channel in range(9):
            out_observed[0, c, channel] += shown_weights[n] * slow_nodes[slow, 0] * observed[0, s, channel]
    for b in range(out_transition.shape[0]):
        first = 1 + b * block
        middle = first + block // 2
        for k in range(first, first + block):
            e = k - 1
            pushed[:] = 0.0
            for n in range(drives.shape[0]):
                c, target, s = drives[n, 0], drives[n, 1], drives[n, 2]
                x = drive_weights[n] * slow_epochs[drives[n, 3], e]
                if x != 0.0:
                    for j in range(3):
                        pushed[target + j, c] += x * sources[e, s, j]
            for i in range(9):
                for c in range(m):
                    work[i, c] = 0.0
                for j in range(9):
                    x, y = transition[e, i, j], half[e, i, j]
                    if x != 0.0:
                        for c in range(m):
                            work[i, c] += x * state[j, c]
                    if y != 0.0:
                        for c in range(m):
                            work[i, c] += y * pushed[j, c]
            for i in range(9):
                for c in range(m):
                    state[i, c] = work[i, c]
            phi = transition[e] @ phi
            g = transition[e] @ g + coupling[e]
            for n in range(shown.shape[0]):
                c, s, slow = shown[n, 0], shown[n, 1], shown[n, 2]
                x = shown_weights[n] * slow_nodes[slow, k] / block
                if x != 0.0:
                    for channel in range(9):
                        out_observed[b + 1, c, channel] += x * observed[k, s, channel]
            if k == middle:
                out_transition[b] = phi
                out_coupling[b] = g
                for c in range(m):
                    for i in range(9):
                        out_sources[b, 3 * c + i // 3, i % 3] = state[i, c]
                state[:] = 0.0
                phi, g = np.eye(9), np.zeros((9, 6))
