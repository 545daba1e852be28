"""What is taken together: the figures are those of a random walk beside white noise in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from ins_eval.estimation.blocks import (
    BLOCK_S,
    EACH,
    FEWEST_NODES,
    MOST_BLOCKS,
    few_blocks,
    short_blocks,
    standing_blocks,
)

NODES, WALK, ANGLE_WALK = 4 * FEWEST_NODES, 5e-5, 1e-7
INTERVAL_S = np.ones(NODES)


def white(position_m: float, velocity_mps: float, attitude_rad: float) -> np.ndarray:
    return np.tile(np.repeat([position_m, velocity_mps, attitude_rad], 3), (NODES, 1))


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_a_channel_is_averaged_where_a_mean_is_less_certain_than_it_moves(share: float) -> None:
    """Of 5 nodes a mean is known to w / sqrt(5); in 5 s a velocity moves by q sqrt(5)."""
    velocity, position, attitude = WALK * BLOCK_S, WALK * np.sqrt(5.0 * BLOCK_S**3 / 3.0), ANGLE_WALK * BLOCK_S
    found = standing_blocks(INTERVAL_S, share * white(position, velocity, attitude), (WALK, ANGLE_WALK))
    assert found.nodes == 5
    assert found.averaged == (share > 1.0,) * 9


def test_nodes_at_which_nothing_was_measured_have_no_say() -> None:
    seen = white(1e-3, 1e-5, 1e-6)
    seen[: NODES * 3 // 4] = np.nan
    assert standing_blocks(INTERVAL_S, seen, (WALK, ANGLE_WALK)).averaged[3:6] == (False,) * 3


def test_a_block_of_what_moves_is_shorter_than_a_walk_takes_to_a_sigma_of_a_position() -> None:
    """q sqrt(t^3 / 3) = w at t = (3 w^2 / q^2)^(1 / 3)."""
    assert short_blocks(INTERVAL_S, WALK * np.sqrt(3.2**3 / 3.0), WALK).nodes == 3
    assert short_blocks(INTERVAL_S, 2.5, WALK).nodes == 5


def test_short_recordings_are_taken_node_by_node() -> None:
    few = INTERVAL_S[: FEWEST_NODES - 1]
    assert short_blocks(few, 2.5, WALK) == standing_blocks(few, white(1.0, 1.0, 1.0), (WALK, ANGLE_WALK)) == EACH


def test_a_vehicle_in_arcs_has_as_few_blocks_as_are_allowed() -> None:
    assert few_blocks(MOST_BLOCKS - 1) == EACH
    assert few_blocks(4 * MOST_BLOCKS).nodes == 5
