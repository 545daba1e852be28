"""Instants at which innovations show a jump: none in noise, those that were put in; and a search that needs one.

A jump is tried every so many seconds of a recording; where measurements are sharp it explains nothing a little later.
"""

from __future__ import annotations

import numpy as np
import pytest

from ins_eval.diagnosis.answer.judge import judge
from ins_eval.diagnosis.estimate import case as cases
from ins_eval.diagnosis.estimate.instants import MOST, WIDTHS, remarkable

NODES, FALSE_SHARE = 4000, 0.05  # of recordings of noise in which an instant is shown
STEP_UG, AT_S, AT_TOLERANCE_S, SIZE = 400.0, 1337.4, 2.0, 0.05


def test_noise_shows_no_instant_and_jumps_show_theirs() -> None:
    rng = np.random.default_rng(7)
    nodes_s = np.arange(float(NODES))
    shown = [bool(remarkable(rng.standard_normal((NODES, 9)), nodes_s)) for _ in range(100)]
    assert np.mean(shown) <= FALSE_SHARE
    left = rng.standard_normal((NODES, 9))
    left[rng.random(left.shape) < 0.3] = np.nan
    left[1000:1008, 5] += 4.0
    left[3000:3002, 1] = 9.0
    left[0, 2] = 50.0  # the start
    assert sorted(remarkable(left, nodes_s)) == pytest.approx([999.5, 2999.5], abs=1.0)
    left[::100, 0] = 30.0
    found = remarkable(left, nodes_s)
    assert len(found) == MOST
    assert np.diff(sorted(found)).min() >= WIDTHS[-1]


def test_a_sharp_jump_between_the_instants_that_are_tried_is_named(recording_at_rest) -> None:
    recording = recording_at_rest(3600.0, seed=3, error_ug=lambda time_s: STEP_UG * (time_s >= AT_S))
    (found,) = judge([cases.prepare(recording)]).effects
    one = found.hypothesis.candidate
    assert (one.name, one.axis) == ("accelerometer.bias_step", "z")
    assert found.value == pytest.approx(STEP_UG, rel=SIZE)
    assert one.parameters["at_s"] == pytest.approx(AT_S, abs=AT_TOLERANCE_S)
