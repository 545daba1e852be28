"""A chamber recording as a case: silent where the belief is true, and at the rate term where that was left out."""

from __future__ import annotations

import numpy as np
import pytest

from ins_eval.diagnosis.chamber import prepare_chamber
from ins_eval.diagnosis.judge import judge
from ins_eval.recording import ChamberReadings
from ins_eval.recording.belief import AccelerometerBelief, AxisBelief, Belief, BiasBelief, ScaleBelief
from ins_eval.thermal import filtered_rate

GAMMA, MU, EPSILON, K0_UG, OMEGA = 320000.0, -30.0, 60.0, 800.0, 5.0  # pulse/(g s), degC, degC/min, ug
NOISE = 1.0  # pulse/s
REFERENCE_C = 22.0


def measured(epsilon: float) -> ChamberReadings:
    """Four positions, each through 20 -> 60 -> 20 degC at 0.4 degC/min, by eqs (11) and (4) with tilts of its own."""
    rng = np.random.default_rng(2)
    time_s = np.arange(0.0, 13200.0, 30.0)
    temperature = 20.0 + 0.4 / 60.0 * np.clip(np.minimum(time_s - 600.0, 12600.0 - time_s), 0.0, None)
    rate = filtered_rate(time_s, temperature)
    scale = GAMMA + MU * (temperature - REFERENCE_C) + epsilon * rate
    bias = 1e-6 * (K0_UG + OMEGA * (temperature - REFERENCE_C))
    runs = []
    for force in (1.0, 0.0, -1.0, 0.0):
        tilt = 3e-4 * rng.standard_normal()
        runs.append(scale * (bias + force + tilt) + NOISE * rng.standard_normal(time_s.size))
    count = time_s.size
    return ChamberReadings(
        time_s=np.arange(4 * count) * 30.0 + 1000.0 * np.repeat(np.arange(4), count),
        run=np.repeat(np.arange(4), count),
        input_g=np.repeat([1.0, 0.0, -1.0, 0.0], count),
        rate_c_per_min=np.tile(np.sign(np.gradient(temperature)) * 0.4, 4),
        temperature_c=np.round(np.tile(temperature, 4), 2),
        output=np.concatenate(runs),
        axis="y",
    )


@pytest.fixture
def belief() -> Belief:
    scale, bias = ScaleBelief(gamma=GAMMA, mu=MU, epsilon=EPSILON), BiasBelief(k0_ug=K0_UG, omega_ug_per_c=OMEGA)
    return Belief(accelerometer=AccelerometerBelief(y=AxisBelief(scale=scale, bias=bias)))


def test_a_true_belief_is_left_alone(belief) -> None:
    judgement = judge(prepare_chamber(measured(EPSILON), belief, "chamber"))
    assert judgement.mismatches == ()
    assert judgement.statistics["largest_log_bayes_factor"] < 3.0


def test_a_rate_term_that_was_left_out_shows_in_its_axis(belief) -> None:
    judgement = judge(prepare_chamber(measured(2.0 * EPSILON), belief, "chamber"))
    assert judgement.statistics["largest_effect"] == "accelerometer.scale_temperature_rate y"
    assert judgement.mismatches[0].channel == "accelerometer.y"
