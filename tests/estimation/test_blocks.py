"""What is taken together: the figures are those of a random walk beside white noise in closed form."""

from __future__ import annotations

import numpy as np

from ins_eval.estimation.blocks import (
    EACH,
    FEWEST_NODES,
    MOST_BLOCKS,
    few_blocks,
    short_blocks,
)

WALK = 5e-5
INTERVAL_S = np.ones(4 * FEWEST_NODES)


def test_a_block_of_what_moves_is_shorter_than_a_walk_takes_to_a_sigma_of_a_position() -> None:
    """q sqrt(t^3 / 3) = w at t = (3 w^2 / q^2)^(1 / 3)."""
    assert short_blocks(INTERVAL_S, WALK * np.sqrt(3.2**3 / 3.0), WALK).nodes == 3
    assert short_blocks(INTERVAL_S, 2.5, WALK).nodes == 5


def test_short_recordings_are_taken_node_by_node() -> None:
    few = INTERVAL_S[: FEWEST_NODES - 1]
    assert short_blocks(few, 2.5, WALK) == EACH


def test_a_vehicle_in_arcs_has_as_few_blocks_as_are_allowed() -> None:
    assert few_blocks(MOST_BLOCKS - 1) == EACH
    assert few_blocks(4 * MOST_BLOCKS).nodes == 5
