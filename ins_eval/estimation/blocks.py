"""Which measurements are taken together where nothing fast is asked about (`coarse`)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

BLOCK_S = 5.0  # within which a navigation error is a straight line, next to the 84 minutes in which it turns
MOST_BLOCKS = 4000  # of a vehicle in arcs: by the time that a fit of the noise takes
FEWEST_NODES = 1500  # of a recording that is worth it: likewise


class Blocks(NamedTuple):
    """How many `nodes` a block has, an odd number, and of which channels (9) it takes the mean, not the middle node."""

    nodes: int
    averaged: tuple[bool, ...] = (True,) * 9


EACH = Blocks(1)  # every node for itself


def short_blocks(interval_s: np.ndarray, position_m: float, walk: float) -> Blocks:
    """Blocks of `BLOCK_S`, or shorter; of single nodes where the recording is short.

    A block is so short that a velocity random `walk`, m/s/sqrt(s), moves less in it than one sigma of a position:
    q sqrt(t^3 / 3) < w.
    """
    if interval_s.size < FEWEST_NODES:
        return EACH
    return Blocks(_nodes(min(BLOCK_S, (np.sqrt(3.0) * position_m / walk) ** (2.0 / 3.0)), interval_s))


def standing_blocks(interval_s: np.ndarray, white: np.ndarray, walks: tuple[float, float]) -> Blocks:
    """Blocks of `BLOCK_S` of what stands, where nothing but random walks changes within seconds.

    A channel is averaged where velocity and angle random `walks` q, m/s/sqrt(s) and rad/sqrt(s), move it less in a
    block than its `white` noise w (nodes, 9), NaN where nothing was measured, leaves uncertain of a mean over n:
    q sqrt(t^3 / 3) < w / sqrt(n) of a position, q sqrt(t) < w / sqrt(n) of a velocity and of an attitude.
    """
    if interval_s.size < FEWEST_NODES:
        return EACH
    nodes = _nodes(BLOCK_S, interval_s)
    block_s = nodes * float(np.median(interval_s))
    moved = np.repeat([walks[0] * np.sqrt(block_s**3 / 3.0), *(walk * np.sqrt(block_s) for walk in walks)], 3)
    level = [float(np.median(one[np.isfinite(one)])) if np.isfinite(one).any() else np.inf for one in white.T]
    return Blocks(nodes, tuple((moved < np.array(level) / np.sqrt(nodes)).tolist()))


def _nodes(block_s: float, interval_s: np.ndarray) -> int:
    return max(1, int((block_s / float(np.median(interval_s)) + 1.0) / 2.0) * 2 - 1)


def few_blocks(nodes: int) -> Blocks:
    """Blocks of a vehicle in arcs, which turns within seconds: with as few nodes as `MOST_BLOCKS` allow."""
    return Blocks((nodes // MOST_BLOCKS + 1) // 2 * 2 + 1)
