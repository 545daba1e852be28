"""Which measurements are taken together where nothing fast is asked about (`coarse`)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

BLOCK_S = 5.0  # within which a navigation error is a straight line, next to the 84 minutes in which it turns
MOST_BLOCKS = 4000  # of a vehicle in arcs: by the time that a fit of the noise takes
FEWEST_NODES = 1500  # of a recording that is worth it: likewise


class Blocks(NamedTuple):
    """How many `nodes` a block has, an odd number."""

    nodes: int


EACH = Blocks(1)  # every node for itself


def short_blocks(interval_s: np.ndarray, position_m: float, walk: float) -> Blocks:
    """Blocks of `BLOCK_S`, or shorter; of single nodes where the recording is short.

    A block is so short that a velocity random `walk`, m/s/sqrt(s), moves less in it than one sigma of a position:
    q sqrt(t^3 / 3) < w.
    """
    if interval_s.size < FEWEST_NODES:
        return EACH
    return Blocks(_nodes(min(BLOCK_S, (np.sqrt(3.0) * position_m / walk) ** (2.0 / 3.0)), interval_s))


def _nodes(block_s: float, interval_s: np.ndarray) -> int:
    return max(1, int((block_s / float(np.median(interval_s)) + 1.0) / 2.0) * 2 - 1)


def few_blocks(nodes: int) -> Blocks:
    """Blocks of a vehicle in arcs, which turns within seconds: with as few nodes as `MOST_BLOCKS` allow."""
    return Blocks((nodes // MOST_BLOCKS + 1) // 2 * 2 + 1)
