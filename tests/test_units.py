"""Degrees and back to the last bit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ins_eval.units import DEG, through_degrees, to_degrees_exactly

ONE_DOUBLE = 1.0  # in units of the spacing of doubles


@given(st.floats(-1e6, 1e6))
def test_what_came_from_degrees_comes_back(degrees):
    assert to_degrees_exactly(degrees * DEG) * DEG == degrees * DEG


def test_no_double_does_better_than_the_one_given():
    """Where the product misses, those of the neighbours miss too, and by as much or more."""
    rad = np.concatenate([np.random.default_rng(0).uniform(-7.0, 7.0, 100_000), 2.0 ** np.arange(-30, 3)])
    degrees = to_degrees_exactly(rad)
    miss = np.abs(degrees * DEG - rad)
    assert 0.05 < np.mean(miss > 0.0) < 0.15
    for side in (-np.inf, np.inf):
        assert (np.abs(np.nextafter(degrees, side) * DEG - rad) >= miss).all()


def test_few_decimals_are_found_again():
    degrees = np.round(np.random.default_rng(0).uniform(-180.0, 180.0, 10_000), 7)
    assert np.array_equal(to_degrees_exactly(degrees * DEG), degrees)
    assert to_degrees_exactly(34.65 * DEG) == 34.65


@given(st.floats(-10.0, 10.0).filter(lambda rad: rad == 0.0 or abs(rad) > 1e-300))
def test_other_values_move_by_one_double_at_most_and_then_stay(rad):
    near = through_degrees(rad)
    assert abs(near - rad) <= ONE_DOUBLE * np.spacing(abs(rad))
    assert through_degrees(near) == near


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 0.0, -0.0])
def test_odd_values_pass(value):
    np.testing.assert_array_equal(through_degrees(np.array([value])), [value])
    assert np.signbit(through_degrees(value)) == np.signbit(value)
