"""Instants at which innovations show a jump: none in noise, those that were put in; and a search that needs one.

A jump is tried every so many seconds of a recording; where measurements are sharp it explains nothing a little later.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ins_eval.estimation import case as cases
from ins_eval.estimation.instants import MOST, WIDTHS, remarkable
from ins_eval.estimation.linearisation import linearise
from ins_eval.estimation.placing import Point
from ins_eval.estimation.study import fit_noise
from ins_eval.policy import Policy
from ins_eval.units import UG

NODES, FALSE_SHARE = 4000, 0.05  # of recordings of noise in which an instant is shown
STEP_UG, AT_S, AT_TOLERANCE_S = 1800.0, 403.3, 4.5  # one and a half epochs of what stands for a quarter of an hour
WORTH = 20.0  # nats of the right instant over all that lie evenly
WALK_UG = 100.0
COARSE_UG = 2e4  # a bias so uncertain that its wander may hide a jump that is not tried at its very instant


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


def test_a_sharp_jump_is_tried_where_it_is(recording_at_rest) -> None:
    recording = recording_at_rest(900.0, seed=3, error_ug=lambda time_s: STEP_UG * (time_s >= AT_S))
    imu, walk = recording.imu, {"velocity_random_walk_ug_per_sqrt_hz": WALK_UG}
    noise = np.random.default_rng(4).standard_normal((imu.time_s.size, 3))
    noise *= WALK_UG * UG * np.sqrt(recording.interval_s)[:, None]
    coarse = recording.belief.accelerometer.model_copy(update={"bias_sigma_ug": COARSE_UG, **walk})
    belief = recording.belief.model_copy(update={"accelerometer": coarse})
    recording = replace(recording, imu=replace(imu, accelerometer=imu.accelerometer + noise), belief=belief)
    case = cases.prepare(recording)
    around = linearise(Point((case,), (), np.zeros(0), tuple(fit_noise([case], [], [None]))), Policy())
    steps = {
        one.candidate.parameters["at_s"]: around.gain([k])
        for k, one in enumerate(around.hypotheses)
        if one.candidate.key[:2] == ("accelerometer.bias_step", "z")
    }
    best = max(steps, key=steps.__getitem__)
    assert best == pytest.approx(AT_S, abs=AT_TOLERANCE_S)
    evenly = [gain for at_s, gain in steps.items() if abs(at_s - best) > AT_TOLERANCE_S]
    assert steps[best] > WORTH + max(evenly)
    assert around.hypotheses[around.best.members[0]].candidate.parameters["at_s"] == best
