"""Twins by the closed form of two correlated columns."""

from __future__ import annotations

import numpy as np
import pytest

from benchmark.scores.twins import MORE, twins

INFORMATION, SIGMAS = 1.0, 30.0


@pytest.mark.parametrize(("more", "is_twin"), [(0.5 * MORE, True), (2.0 * MORE, False)])
def test_a_column_is_a_twin_by_its_correlation_with_the_truth(more: float, is_twin: bool) -> None:
    """Of an effect of S sigma a column of correlation r leaves S^2 (1 - r^2) more of chi-square."""
    r = np.sqrt(1.0 - more / SIGMAS**2)
    normal = INFORMATION * np.array([[1.0, r], [r, 1.0]])
    found = twins(normal, normal @ [SIGMAS, 0.0], [("accelerometer.bias", "z"), ("accelerometer.scale", "z")])
    assert found == ({("accelerometer.scale", "z")} if is_twin else set())
