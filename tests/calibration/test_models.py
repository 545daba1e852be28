"""A whole calibration of textbook units: what is determined, with what words, and the same curves as the models."""

from dataclasses import replace

import numpy as np
import pytest

from ins_eval.calibration import FITS, calibrate
from ins_eval.compensation.registry import load_model
from ins_eval.errors import DataRefused
from ins_eval.laboratory import Chamber, draw_printed_units
from ins_eval.scale_factor import TERMS, scale_factor
from ins_eval.streams import Streams

EQ_15 = (273.0, 0.1008, -0.02409, 88.14, -32.76, 320320.0)  # Paper A, eq. (15), JB-KT8 #1
SHIFT_UG = 20.0


def textbook(chamber_of, **programme):
    return chamber_of(
        lambda t, r: scale_factor(EQ_15, t - 22.0, r), lambda t, r: 300.0 + 50.0 * (t - 22.0), **programme
    )


def shifted(chamber, seed):
    """The same with a bias of its own in each run and some noise."""
    rng = np.random.default_rng(seed)
    of_run = SHIFT_UG * rng.standard_normal(chamber.run.max() + 1)
    error_ug = of_run[chamber.run] + 2.0 * rng.standard_normal(chamber.run.size)
    output = chamber.output + 3.2e5 * 1e-6 * error_ug
    return replace(chamber, output=output)


@pytest.fixture(scope="module")
def four_ramps():
    unit = draw_printed_units(Streams(3))["JB-KT8 #1"]
    readings = Chamber().measure(unit, Streams(3).at("day"), unit_id="JB-KT8 #1")
    return readings, calibrate(readings)


def test_curves_are_those_of_the_compensation_models(four_ramps):
    readings, found = four_ramps
    assert set(found.models) == set(FITS) == {"none", "simple", "simple_anchored", "quadratic", "hysteresis"}
    for name, model in found.models.items():
        fitted = load_model(name).fit(readings)
        np.testing.assert_array_equal(model.scale.values, fitted.scale_.values)
        np.testing.assert_array_equal(model.bias_ug.values, fitted.bias_ug_.values)
        np.testing.assert_array_equal(model.scale.covariance, fitted.curves_with_covariance()[0].covariance)


def test_every_coefficient_has_a_unit_and_an_interval_around_it(four_ramps):
    hysteresis = four_ramps[1].models["hysteresis"]
    assert [c.name for c in hysteresis.scale_coefficients] == list(TERMS)
    assert hysteresis.scale_coefficients[4].unit == "pulse/(g s)/degC"
    assert {c.unit for c in hysteresis.bias_coefficients} == {"ug"}
    assert hysteresis.bias_coefficients[1].name == "falling at -40.0 degC"
    for c in hysteresis.scale_coefficients + hysteresis.bias_coefficients:
        low, high = c.interval95
        assert low < c.value < high
    assert not hysteresis.remarks and not hysteresis.reason


def test_residuals_shrink_from_none_to_hysteresis(four_ramps):
    _, found = four_ramps
    chain = [found.models[name] for name in ("none", "simple", "quadratic", "hysteresis")]
    for quantity in ("residual_rms_ppm", "sensitivity_ppm_per_c"):
        values = [getattr(model, quantity) for model in chain]
        assert values == sorted(values, reverse=True)
    assert chain[0].sensitivity_ppm_per_c == pytest.approx(found.sensitivity_ppm_per_c, rel=1e-9)


def test_run_to_run_shifts_are_seen_in_the_prediction(chamber_of):
    """Shifts of 20 ug in each run and 2 ug of noise: half widths near t(6) 20 sqrt(1 + 1/4), on the average."""
    chamber = textbook(chamber_of, ramps=(0.3, 0.5, 0.7, 0.9))
    widths = []
    for seed in range(6):
        prediction = calibrate(shifted(chamber, seed)).models["hysteresis"].prediction
        low, high = prediction.interval95_ug(1, np.array([0.0]), np.array([0.3]))
        widths.append((high - low) / 2.0)
    assert np.mean(widths) == pytest.approx(2.447 * SHIFT_UG * np.sqrt(1.25), rel=0.35)


def test_one_direction_is_fitted_with_what_it_cannot_separate(chamber_of):
    chamber = textbook(chamber_of, ramps=(0.3, 0.9))
    start = np.r_[True, np.diff(chamber.run) != 0]
    elapsed = chamber.time_s - np.maximum.accumulate(np.where(start, chamber.time_s, -np.inf))
    # from half an hour after the start of the ramp to the turn at -60 degC, each ramp at its steady rate
    steady = (elapsed > 5400.0) & (elapsed < 3600.0 + 60.0 * 80.0 / chamber.rate_c_per_min)
    steady &= chamber.rate_c_per_min == 0.3
    columns = ("time_s", "run", "input_g", "rate_c_per_min", "temperature_c", "output")
    found = calibrate(replace(chamber, **{name: getattr(chamber, name)[steady] for name in columns}))
    assert found.identifiability.steady_rank == 3
    assert not found.models["simple"].reason
    (remark,) = [r for r in found.models["simple"].remarks if "interval can be given" in r]
    assert "one commanded rate" in remark
    # what is left of the start of the rate filter makes it fit, and the remark says how little that is
    text = " ".join(found.models["hysteresis"].remarks)
    assert "one direction: alpha from epsilon and gamma cannot be separated; eta from mu cannot be separated" in text
    assert "near turns (less than 1 % of all)" in text


def test_one_rate_is_fitted_with_the_warning_beside_it(chamber_of):
    hysteresis = calibrate(textbook(chamber_of, ramps=(0.5,))).models["hysteresis"]
    assert hysteresis.scale is not None and hysteresis.prediction is None
    assert all(c.interval95 is None for c in hysteresis.scale_coefficients)
    text = " ".join(hysteresis.remarks)
    assert "one rate: alpha from gamma cannot be separated" in text
    assert "one commanded rate shows nothing of the shifts between runs" in text
    assert "1 run(s) at +1 g show nothing of how runs differ" in text


def test_printed_equations_stand_beside_the_rest(chamber_of):
    printed = calibrate(textbook(chamber_of)).printed
    k1, k0 = 320320.0, 300e-6
    assert printed["turned"].eq13_scale == pytest.approx(k1, rel=1e-4)
    assert printed["Fig. 4"].eq3_scale == pytest.approx(-k1 / 2, rel=1e-4)
    assert printed["Fig. 4"].eq4_bias == pytest.approx(k0 - 0.5, abs=1e-5)


def test_three_positions_are_no_calibration(chamber_of):
    with pytest.raises(DataRefused, match="four-point calibration needs"):
        calibrate(textbook(chamber_of, positions=(1.0, 0.0, -1.0)))
