"""The same regression on blocks of a few measurements: a fifth of the work where nothing changes within seconds.

Transitions and drives are composed exactly; residual and responses are averaged over a block of nodes and stand at its
middle node. White noise of n measurements becomes white noise of sigma / sqrt(n). What is lost is what a navigation
error does within a block beyond a straight line. A block takes the mean of what is there of a channel, where that is
more than half of it, and where a part is lost each node that is there sees what the state at the middle becomes until
then; a node at which nothing was measured, the begin of an arc, does not count.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numba
import numpy as np

from ins_eval.error_model.columns import TO_ATTITUDE, TO_POSITION, TO_VELOCITY, Assembled
from ins_eval.error_model.propagation import walks
from ins_eval.estimation.kalman import FASTMATH, propagate, show
from ins_eval.estimation.whitening import motion, shown

if TYPE_CHECKING:
    from ins_eval.estimation.blocks import Blocks
    from ins_eval.estimation.noise import NoiseModel


def coarse(fine: Assembled, of: Blocks, known: Assembled | None = None) -> Assembled:
    """The columns of `fine` on blocks; the first node, the start, stands alone.

    `known` are the first of them on these blocks, where they were made before.
    """
    if of.nodes == 1:
        return fine
    block = of.nodes
    blocks = (fine.residual.shape[0] - 1) // block
    m = fine.count
    rows, share = _shares(fine.residual, of)
    weights = np.concatenate([np.ones((1, 9)), share.reshape(-1, 9)])
    made = 0 if known is None else known.count
    sources = np.zeros((blocks, 3 * m, 3))
    observed = np.zeros((blocks + 1, m, 9))
    if known is None:
        transition, second_half, coupling = _composed(block, fine.transition, fine.half, fine.coupling)
        spread = fine.spread[: blocks * block].reshape(blocks, block, 2, 3, 3).mean(axis=1)
        added = walks(transition, second_half, spread)
    else:
        transition, coupling, added, spread = known.transition, known.coupling, known.walks, known.spread
        sources[:, : 3 * made], observed[:, :made] = known.sources, known.observed
    each = np.arange(m)
    first, last = fine.acting[:, 0], fine.acting[:, 1] - 1
    block_of_first, block_of_last = (np.where(node > 0, (node - 1) // block + 1, 0) for node in (first, last))
    # what acts after the middle of a block is felt at that of the next
    acting = np.column_stack([block_of_first, block_of_last + 2]).clip(max=blocks + 1)
    spans, span = np.unique(acting[made:], axis=0, return_inverse=True)
    for k, (begin, end) in enumerate(spans):
        which = made + np.flatnonzero(span == k)
        _average(block, begin, end, weights, motion(fine, which), shown(fine, which), which, sources, observed)
    mean = (share * np.nan_to_num(fine.residual[rows])).sum(axis=1)
    residual = np.concatenate([fine.residual[:1], np.where(share.any(axis=1), mean, np.nan)])
    design = _design(fine, rows, share) if known is None else known.design[1:]
    time_s = np.concatenate([[0.0], np.cumsum(fine.interval_s)])
    middle = rows[:, block // 2]
    drive_terms = [(c, target, 3 * c + k, 0) for c in each for k, target in enumerate(_TARGETS)]
    return replace(
        fine,
        acting=acting,
        transition=transition,
        half=np.tile(np.eye(9), (blocks, 1, 1)),
        walks=added,
        spread=spread,
        coupling=coupling,
        interval_s=np.diff(np.append(0.0, time_s[middle])),
        sources=sources,
        slow_epochs=np.ones((1, blocks)),
        drive_terms=np.array(drive_terms, dtype=np.int64),
        drive_weights=np.ones(3 * m),
        residual=residual,
        design=np.concatenate([fine.design[:1], design]),
        observed=observed,
        slow_nodes=np.ones((1, blocks + 1)),
        observation_terms=np.column_stack([each, each, np.zeros(m, dtype=np.int64)]),
        observation_weights=np.ones(m),
    )


def _design(fine: Assembled, rows: np.ndarray, share: np.ndarray) -> np.ndarray:
    """What the channels of each block see of the state at its middle node, (blocks, 9, 9).

    What is there of a block may lie on one side of the middle, a second of ten metres per second away: there each node
    sees what the state at the middle becomes until then, or has been.
    """
    design = (fine.design[rows] * share[..., None]).sum(axis=1)
    middle = rows.shape[1] // 2
    for b in np.flatnonzero((share != share[:, ::-1]).any(axis=(1, 2))):
        nodes, state = rows[b], [np.eye(9)] * rows.shape[1]
        for k in range(middle + 1, rows.shape[1]):
            state[k] = fine.transition[nodes[k] - 1] @ state[k - 1]
        for k in range(middle - 1, -1, -1):
            state[k] = np.linalg.solve(fine.transition[nodes[k]], state[k + 1])
        design[b] = np.einsum("kc,kcj->cj", share[b], fine.design[nodes] @ np.array(state))
    return design


def _shares(residual: np.ndarray, of: Blocks) -> tuple[np.ndarray, np.ndarray]:
    """Nodes of each block (blocks, block), and the share of each in what is taken of a channel (blocks, block, 9).

    All are 0 where fewer than half of the nodes that measure anything measure the channel.
    """
    block = of.nodes
    blocks = (residual.shape[0] - 1) // block
    rows = np.arange(1, blocks * block + 1).reshape(blocks, block)
    known = np.isfinite(residual[rows])
    count = known.sum(axis=1, keepdims=True)
    enough = count > 0.5 * known.any(axis=2).sum(axis=1)[:, None, None]
    return rows, np.where(known & enough, 1.0 / np.maximum(count, 1), 0.0)


def coarse_noise(noise: NoiseModel, of: Blocks, residual: np.ndarray) -> NoiseModel:
    """The same noise on blocks of what is measured in `residual` (nodes, 9)."""
    if of.nodes == 1:
        return noise
    rows, share = _shares(residual, of)
    block = of.nodes
    white, later = (np.sqrt(((share * one[rows]) ** 2).sum(axis=1)) for one in (noise.white, noise.later))
    first, last = np.append(0, rows[:-1, block // 2]), rows[:, block // 2]  # epochs between the middle nodes
    steps = np.concatenate([np.zeros((1, 3, 3)), np.cumsum(noise.steps, axis=0)])
    jumps = np.concatenate([np.zeros((1, 3)), np.cumsum(noise.jumps, axis=0)])
    agitation, filled = (
        np.concatenate([np.zeros((1, 2)), np.cumsum(one, axis=0)]) for one in (noise.agitation, noise.filled)
    )
    time_s = np.append(0.0, np.cumsum(noise.interval_s))
    return replace(
        noise,
        white=np.concatenate([noise.white[:1], white]),
        steps=steps[last] - steps[first],
        jumps=jumps[last] - jumps[first],
        agitation=agitation[last] - agitation[first],
        filled=filled[last] - filled[first],
        later=np.concatenate([noise.later[:1], later]),
        interval_s=time_s[last] - time_s[first],
    )


_TARGETS = (TO_POSITION, TO_VELOCITY, TO_ATTITUDE)


@numba.njit(cache=True, nogil=True, fastmath=FASTMATH)
def _composed(block, transition, half, coupling):
    """Transition, that over the second half, and coupling from the middle of each block to that of the next."""
    blocks = transition.shape[0] // block
    out_transition, out_half, out_coupling = (
        np.empty((blocks, 9, 9)),
        np.empty((blocks, 9, 9)),
        np.empty((blocks, 9, 6)),
    )
    begin = 0
    for b in range(blocks):
        end = b * block + block // 2 + 1
        middle = (begin + end) // 2
        phi, second, g = np.eye(9), np.eye(9), np.zeros((9, 6))
        for e in range(begin, end):
            phi = transition[e] @ phi
            g = transition[e] @ g + coupling[e]
            if e >= middle:
                second = transition[e] @ second if e > middle or (end - begin) % 2 == 0 else half[e] @ second
        out_transition[b], out_half[b], out_coupling[b] = phi, second, g
        begin = end
    return out_transition, out_half, out_coupling


@numba.njit(cache=True, nogil=True, fastmath=FASTMATH)
def _average(block, begin, end, weights, motion, shown, which, sources, observed):
    """Drives and responses of the columns `which` at the coarse nodes from `begin` to `end`, 0 before."""
    m = which.size
    state = np.zeros((9, m))
    work = np.zeros((9, m))
    pushed = np.zeros((9, m))
    seen = np.zeros((9, m))
    for b in range(begin, end):
        seen[:] = 0.0
        first = 1 + (b - 1) * block
        for k in range(max(first, 0), first + block):
            show(shown, k, weights[k], seen)
            if k == 0:
                continue
            propagate(motion, k - 1, state, pushed, work)
            state[:] = work
            if k == first + block // 2:
                for n in range(m):
                    for i in range(9):
                        sources[b - 1, 3 * which[n] + i // 3, i % 3] = state[i, n]
                state[:] = 0.0
        for n in range(m):
            for i in range(9):
                observed[b, which[n], i] = seen[i, n]
