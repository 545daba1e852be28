"""Whole pulses, and nothing lost."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ins_eval.accelerometer import Population
from ins_eval.accelerometer.quantisation import whole_pulses

ROUNDING = 1e-9


@settings(max_examples=200, deadline=None)
@given(st.lists(st.floats(-1e4, 1e4), min_size=1, max_size=60))
def test_the_sum_is_never_off_by_a_pulse(due: list[float]) -> None:
    pulses = np.array(due)
    counts = whole_pulses(pulses)
    assert np.all(counts == np.round(counts))
    assert np.abs(np.cumsum(counts) - np.cumsum(pulses)).max() < 1.0 + ROUNDING


def test_small_forces_come_out_as_single_pulses() -> None:
    counts = whole_pulses(np.full(1000, 0.01))
    assert set(counts) == {0.0, 1.0}
    assert 9 <= counts.sum() <= 10
    assert list(whole_pulses(np.array([0.6, 0.6, -0.5, -0.6, -0.9]))) == [0.0, 1.0, 0.0, 0.0, -1.0]
    assert list(whole_pulses(np.array([-0.6, -0.6, -3.3]))) == [0.0, -1.0, -3.0]


def test_an_hour_of_samples_keeps_its_last_pulse(population: Population) -> None:
    rng = np.random.default_rng(4)
    pulses = 3203.2 + rng.normal(0.0, 40.0, 360000)
    counts = population["quantisation"].counted(pulses)
    assert abs(int(counts.sum()) - pulses.sum()) < 1.0 + 1e-5
    assert counts == pytest.approx(pulses, abs=2.0)
