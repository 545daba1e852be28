"""The oven refinement: a residual that was put in is taken out; and the mirror of two models."""

import numpy as np
import pytest

from ins_eval.calibration.branches import BranchCurve
from ins_eval.compensation import Samples
from ins_eval.compensation.mirrored import Mirrored
from ins_eval.compensation.refined import Refined
from ins_eval.compensation.registry import load_model
from ins_eval.errors import UsageError
from ins_eval.thermal import filtered_rate
from ins_eval.units import STANDARD_GRAVITY, UG

REMOVED_UG = 3.0  # the ridge takes 1 % of a loop up to 230 ug wide
SAME_MPS2 = 1e-12

# a loop that is straight between multiples of 5 degC
LOOP_UG = BranchCurve(np.array([-15.0, 0.0, 15.0]), np.array([80.0, -60.0, 150.0]), np.array([10.0, -200.0, 90.0]))


def oven(seed=0, turn_on_ug=0.0, known_mps2=0.0):
    """Samples of an accelerometer that outputs 1 pulse per m/s^2 and second, with the loop and a turn-on bias."""
    time_s = np.arange(1.0, 8401.0)
    # there and back twice, so that both branches are seen everywhere
    temperature = 14.0 * np.cos(2.0 * np.pi * time_s / 4200.0 + 0.1 * seed)
    rate = filtered_rate(time_s, temperature)
    residual = UG * (LOOP_UG.evaluate(temperature, rate) + turn_on_ug)
    return Samples(time_s, known_mps2 + residual, temperature, rate)


class Ideal:
    """One pulse is 1 m/s^2; nothing to fit."""

    name = "ideal"

    def fit(self, chamber):
        return self

    def specific_force(self, samples):
        return 1.0 * samples.output


def left_ug(model, samples, known_mps2=0.0):
    return (model.specific_force(samples) - known_mps2) / UG


def test_injected_loop_is_removed():
    refined = Refined(Ideal()).refine([(oven(), 0.0)])
    assert np.abs(left_ug(Ideal(), oven())).max() > 150.0
    assert (
        np.abs(left_ug(refined, oven())).max() < 4.0 * REMOVED_UG
    )  # at a turning point of temperature, where both branches end
    assert np.sqrt(np.mean(left_ug(refined, oven()) ** 2)) < REMOVED_UG
    assert refined.name == "ideal_refined"


def test_known_force_may_vary_and_is_not_taken_for_a_residual():
    known = -STANDARD_GRAVITY + 1e-3 * np.sin(np.arange(8400.0))
    scalar = Refined(Ideal()).refine([(oven(), 0.0)])
    varying = Refined(Ideal()).refine([(oven(known_mps2=known), known)])
    samples = oven()
    np.testing.assert_allclose(varying.specific_force(samples), scalar.specific_force(samples), atol=1e-9)


def test_runs_are_averaged():
    """Turn-on biases of +90 and -90 ug cancel in two runs and stay in one."""
    one = Refined(Ideal()).refine([(oven(turn_on_ug=90.0), 0.0)])
    two = Refined(Ideal()).refine([(oven(turn_on_ug=90.0), 0.0), (oven(turn_on_ug=-90.0), 0.0)])
    assert left_ug(one, oven()).mean() == pytest.approx(-90.0, abs=REMOVED_UG)
    assert left_ug(two, oven()).mean() == pytest.approx(0.0, abs=REMOVED_UG)


def test_constant_of_each_run_can_be_left_to_its_turn_on():
    runs = [(oven(turn_on_ug=90.0), 0.0), (oven(seed=1, turn_on_ug=-700.0), 0.0)]
    refined = Refined(Ideal(), constant=False).refine(runs)
    left = left_ug(refined, oven())
    # the shape goes, a constant stays: that of the loop itself, not those of the runs
    assert np.std(left) < REMOVED_UG
    loops = np.concatenate([LOOP_UG.evaluate(run.temperature_c, run.rate_c_per_min) for run, _ in runs])
    assert left.mean() == pytest.approx(loops.mean(), abs=REMOVED_UG)


def test_correction_is_constant_beyond_the_temperatures_of_the_oven():
    refined = Refined(Ideal()).refine([(oven(), 0.0)])
    temperature = np.array([14.0, 40.0, -14.0, -55.0])
    beyond = refined.specific_force(Samples(np.arange(4.0), np.zeros(4), temperature, np.full(4, -0.3)))
    assert beyond[1] == pytest.approx(beyond[0], abs=SAME_MPS2 + 1e-9)
    assert beyond[3] == pytest.approx(beyond[2], abs=SAME_MPS2 + 1e-9)


def test_before_refinement_it_is_the_wrapped_model_and_a_new_fit_forgets():
    refined = Refined(Ideal())
    np.testing.assert_array_equal(refined.specific_force(oven()), oven().output)
    refined.refine([(oven(), 0.0)]).fit(None)
    np.testing.assert_array_equal(refined.specific_force(oven()), oven().output)


def test_no_oven_run_is_refused():
    with pytest.raises(UsageError, match="ideal_refined: refine was given no oven run"):
        Refined(Ideal()).refine([])


def test_samples_with_a_gap_and_an_uneven_step_are_binned():
    samples = oven()
    keep = (samples.time_s < 3000.0) | (samples.time_s > 3456.7)
    part = Samples(*(getattr(samples, name)[keep] for name in ("time_s", "output", "temperature_c", "rate_c_per_min")))
    refined = Refined(Ideal()).refine([(part, 0.0)])
    assert np.sqrt(np.mean(left_ug(refined, samples) ** 2)) < REMOVED_UG


@pytest.fixture
def fitted(chamber_of):
    chamber = chamber_of(
        lambda temperature, rate: 320320.0 - 32.76 * (temperature - 22.0) + 88.14 * rate + 273.0 * rate**2,
        lambda temperature, rate: 300.0 + 0.02 * (temperature - 22.0) ** 2 - 100.0 * rate,
    )
    return lambda name: load_model(name).fit(chamber)


@pytest.fixture
def samples():
    some = oven()
    return Samples(some.time_s, 320000.0 * np.sin(some.time_s / 50.0), some.temperature_c, some.rate_c_per_min)


def test_mirror_reflects_the_second_model_in_the_first(fitted, samples):
    mirror, simple, hysteresis = (fitted(name) for name in ("2 simple - hysteresis", "simple", "hysteresis"))
    a, b, c = (model.specific_force(samples) for model in (simple, hysteresis, mirror))
    assert np.abs(a - b).max() > 10.0 * UG
    np.testing.assert_allclose(c - a, a - b, atol=1e-12)
    assert mirror.name == "2 simple - hysteresis"


def test_mirror_of_a_model_in_itself_is_that_model(fitted, samples):
    np.testing.assert_array_equal(
        fitted("2 simple - simple").specific_force(samples), fitted("simple").specific_force(samples)
    )


def test_refined_mirror_is_the_mirror_of_the_refined(fitted, samples):
    """The refinement is linear in the residual, so it does not matter which is done first."""
    inside = fitted("2 simple_refined - hysteresis_refined").refine([(samples, 0.0)])
    outside = Refined(Mirrored(fitted("simple"), fitted("hysteresis"))).refine([(samples, 0.0)])
    np.testing.assert_allclose(inside.specific_force(samples), outside.specific_force(samples), atol=1e-9)


def test_mirror_refines_only_the_model_that_takes_it(fitted, samples):
    mirror = fitted("2 simple - hysteresis_refined").refine([(samples, 0.0)])
    refined = fitted("hysteresis_refined").refine([(samples, 0.0)])
    expected = 2.0 * fitted("simple").specific_force(samples) - refined.specific_force(samples)
    np.testing.assert_allclose(mirror.specific_force(samples), expected, atol=1e-12)
