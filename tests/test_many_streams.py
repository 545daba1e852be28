"""Many streams at once: the numbers that NumPy gives one stream at a time."""

from __future__ import annotations

import numpy as np
import pytest

from ins_eval.many_streams import ManyStreams, normal_sums, normals
from ins_eval.streams import Streams

COUNT = 60_000  # of 5 streams: some 80 lie in the tail of the ziggurat


@pytest.mark.parametrize("entropy", [0, 1, 2**32 + 7, 2**130 + 9])
def test_normals_are_those_of_numpy(entropy: int) -> None:
    nodes = [Streams(entropy).at("instrument", index) for index in range(5)]
    table = ManyStreams.of(nodes).at("flight", "noise").begin()
    expected = np.array([node.at("flight", "noise").rng().standard_normal(COUNT) for node in nodes]).T
    assert np.abs(expected).max() > 4.0  # beyond 3.65 the tail begins
    assert np.array_equal(normals(table, COUNT // 2), expected[: COUNT // 2])
    assert np.array_equal(normals(table, COUNT - COUNT // 2), expected[COUNT // 2 :])  # a stream goes on


def test_sums_are_those_of_numpy() -> None:
    nodes = [Streams(3).at(index) for index in range(4)]
    expected = [node.rng().standard_normal((50, 10, 3)).sum(axis=1) for node in nodes]
    found = normal_sums(ManyStreams.of(nodes).begin(), 50, 10, 3)
    assert found == pytest.approx(np.moveaxis(expected, 0, 2), abs=1e-13)
