"""The built-in models on textbook units: each is exact on the physics that it assumes, and on no more."""

import numpy as np
import pytest

from ins_eval.calibration.branches import KNOTS_C
from ins_eval.compensation import CompensationModel, Samples
from ins_eval.compensation.registry import BUILT_IN, load_model
from ins_eval.scale_factor import scale_factor
from ins_eval.units import STANDARD_GRAVITY, UG

EXACT_UG = 1e-3
CLEARLY_WRONG_UG = 20.0

ALPHA, BETA, ETA, EPSILON, MU, GAMMA = 273.0, 0.1008, -0.02409, 88.14, -32.76, 320320.0  # Paper A, eq. (15)


def six_term_scale(temperature, rate):
    return scale_factor((ALPHA, BETA, ETA, EPSILON, MU, GAMMA), temperature - 22.0, rate)


def parabolic_scale(temperature, rate):
    return scale_factor((0.0, BETA, 0.0, 0.0, MU, GAMMA), temperature - 22.0, rate)


def linear_scale(temperature, rate):
    return scale_factor((0.0, 0.0, 0.0, 0.0, MU, GAMMA), temperature - 22.0, rate)


def constant_scale(temperature, rate):
    return GAMMA + 0.0 * temperature


def linear_bias(temperature, rate):
    return 300.0 + 50.0 * (temperature - 22.0)


def constant_bias(temperature, rate):
    return 300.0 + 0.0 * temperature


def parabolic_bias(temperature, rate):
    return linear_bias(temperature, rate) + 0.1 * (temperature - 22.0) ** 2


def looped_bias(temperature, rate):
    """Straight between the default knots on either branch, 60 ug apart in the middle."""
    falling = np.interp(temperature, KNOTS_C, 40.0 * KNOTS_C)
    width = np.interp(temperature, KNOTS_C, [0.0, 20.0, 40.0, 60.0, 60.0, 50.0, 30.0, 10.0, 0.0])
    return falling - (1.0 - np.clip(0.5 - rate / 0.24, 0.0, 1.0)) * width


@pytest.fixture
def flight():
    """Temperature and rate as in a flight, and a lively specific force in m/s^2."""
    time_s = np.arange(1.0, 3001.0)
    temperature = 10.0 + 15.0 * np.sin(time_s / 400.0)
    rate = 60.0 * 15.0 / 400.0 * np.cos(time_s / 400.0) / 6.0
    return time_s, temperature, rate, STANDARD_GRAVITY * np.sin(time_s / 37.0)


def error_ug(name, scale, bias_ug, chamber_of, flight):
    time_s, temperature, rate, force = flight
    output = scale(temperature, rate) * (1e-6 * bias_ug(temperature, rate) + force / STANDARD_GRAVITY)  # eq. (12)
    model = load_model(name).fit(chamber_of(scale, bias_ug))
    return np.abs(model.specific_force(Samples(time_s, output, temperature, rate)) - force).max() / UG


@pytest.mark.parametrize(
    ("name", "scale", "bias_ug"),
    [
        ("none", constant_scale, constant_bias),
        ("simple", linear_scale, linear_bias),
        ("simple_anchored", constant_scale, constant_bias),
        ("quadratic", parabolic_scale, parabolic_bias),
        ("hysteresis", six_term_scale, looped_bias),
        ("hysteresis_scale_only", six_term_scale, linear_bias),
        ("hysteresis_bias_only", linear_scale, looped_bias),
        ("hysteresis_without_rate", parabolic_scale, looped_bias),
    ],
)
def test_model_is_exact_on_the_unit_that_it_assumes(name, scale, bias_ug, chamber_of, flight):
    assert error_ug(name, scale, bias_ug, chamber_of, flight) < EXACT_UG


@pytest.mark.parametrize(
    ("name", "scale", "bias_ug"),
    [
        ("none", linear_scale, constant_bias),
        ("none", constant_scale, linear_bias),
        ("simple", parabolic_scale, linear_bias),
        ("simple", linear_scale, looped_bias),
        ("quadratic", six_term_scale, linear_bias),
        ("quadratic", linear_scale, looped_bias),
        ("hysteresis_scale_only", six_term_scale, looped_bias),
        ("hysteresis_bias_only", six_term_scale, looped_bias),
        ("hysteresis_without_rate", six_term_scale, looped_bias),
    ],
)
def test_model_errs_where_physics_goes_beyond_it(name, scale, bias_ug, chamber_of, flight):
    assert error_ug(name, scale, bias_ug, chamber_of, flight) > CLEARLY_WRONG_UG


def test_anchored_line_keeps_the_value_at_the_reference_temperature(chamber_of):
    """A curved bias pulls the free intercept away from K0(T0); the anchored one stays."""
    chamber = chamber_of(linear_scale, parabolic_bias)
    at_reference = [
        load_model(name).fit(chamber).bias_ug_.evaluate(np.array([22.0]), 0.0)[0]
        for name in ("simple", "simple_anchored")
    ]
    assert abs(at_reference[0] - 300.0) > 100.0
    assert at_reference[1] == pytest.approx(300.0, abs=2.0)  # readings within 1 degC of T0


def test_ablation_shares_its_halves_with_the_models_it_is_made_of(chamber_of):
    chamber = chamber_of(six_term_scale, looped_bias)
    simple, hysteresis, only_scale, only_bias = (
        load_model(name).fit(chamber)
        for name in ("simple", "hysteresis", "hysteresis_scale_only", "hysteresis_bias_only")
    )
    assert only_scale.scale_.coefficients == hysteresis.scale_.coefficients
    assert only_scale.bias_ug_.coefficients == simple.bias_ug_.coefficients
    assert only_bias.scale_.coefficients == simple.scale_.coefficients
    np.testing.assert_array_equal(only_bias.bias_ug_.falling, hysteresis.bias_ug_.falling)


@pytest.mark.parametrize("name", BUILT_IN)
def test_built_in_obeys_the_protocol(name):
    model = load_model(name)
    assert isinstance(model, CompensationModel)
    assert model.name == name
