"""Four-point estimates against the textbook output E = K1 (K0 + a), and what is refused."""

import dataclasses

import numpy as np
import pytest

from ins_eval.calibration.four_point import four_point
from ins_eval.errors import DataRefused

SCALE_TOLERANCE = 1e-10  # relative; rounding only
BIAS_TOLERANCE_UG = 1e-6
RATE_TOLERANCE_C_PER_MIN = 1e-9


def scale(temperature, rate):  # JB-KT8 #2, Paper A eq. (16)
    d = temperature - 22.0
    return 102.76 * rate**2 + 0.08 * d**2 - 1.4912 * rate * d - 49.81 * d + 21.01 * rate + 308000.0


def bias_ug(temperature, rate):
    return 120.0 + 30.0 * (temperature - 22.0) - 40.0 * rate


@pytest.fixture
def chamber(chamber_of):
    return chamber_of(scale, bias_ug)


def test_textbook_scale_factor_and_bias_are_recovered(chamber):
    points = four_point(chamber)
    rate = points.rate_c_per_min
    np.testing.assert_allclose(points.scale, scale(points.temperature_c, rate), rtol=SCALE_TOLERANCE)
    np.testing.assert_allclose(points.bias_ug, bias_ug(points.temperature_c, rate), atol=BIAS_TOLERANCE_UG)
    assert set(points.ramp_c_per_min) == {0.3, 0.9}


def test_rate_is_the_closed_form_of_the_filter_restarted_in_every_run(chamber, programme_of):
    points = four_point(chamber)
    for ramp in (0.3, 0.9):
        time_s, _, rate = programme_of(ramp)
        chosen = points.ramp_c_per_min == ramp
        kept = time_s >= 540.0
        np.testing.assert_allclose(points.elapsed_s[chosen], time_s[kept], atol=1e-6)
        np.testing.assert_allclose(points.rate_c_per_min[chosen], rate[kept], atol=RATE_TOLERANCE_C_PER_MIN)


def test_readings_are_dropped_until_the_filter_has_forgotten_its_start(chamber):
    assert four_point(chamber).elapsed_s.min() == 540.0  # three time constants of 180 s
    assert four_point(chamber, rate_filter_s=60.0).elapsed_s.min() == 180.0


def test_order_of_the_positions_does_not_matter(chamber, chamber_of):
    points = four_point(chamber)
    other = four_point(chamber_of(scale, bias_ug, positions=(0.0, -1.0, 0.0, 1.0)))
    np.testing.assert_allclose(other.scale, points.scale, rtol=SCALE_TOLERANCE)
    np.testing.assert_allclose(other.bias_ug, points.bias_ug, atol=BIAS_TOLERANCE_UG)


def test_quadratic_coefficient_stays_out_of_the_bias(chamber_of):
    points = four_point(chamber_of(scale, bias_ug, k2_per_g=20e-6))  # the mean of all four would be 10 ug off
    truth = bias_ug(points.temperature_c, points.rate_c_per_min)
    np.testing.assert_allclose(points.bias_ug, truth, atol=BIAS_TOLERANCE_UG)


def test_specific_force_as_given_is_used_not_the_nominal_position(chamber_of):
    points = four_point(chamber_of(scale, bias_ug, positions=(0.9987, 0.002, -0.9989, 0.001)))
    truth = bias_ug(points.temperature_c, points.rate_c_per_min)
    np.testing.assert_allclose(points.bias_ug, truth, atol=BIAS_TOLERANCE_UG)


def test_commanded_rate_may_carry_a_sign(chamber):
    sign = np.where(np.arange(chamber.time_s.size) % 2, 1.0, -1.0)
    signed = dataclasses.replace(chamber, rate_c_per_min=chamber.rate_c_per_min * sign)
    np.testing.assert_array_equal(four_point(signed).scale, four_point(chamber).scale)


def test_points_of_the_same_readings_are_computed_once(chamber):
    assert four_point(chamber) is four_point(chamber)


def rows(chamber, keep):
    fields = ("time_s", "run", "input_g", "rate_c_per_min", "temperature_c", "output")
    return dataclasses.replace(chamber, **{name: getattr(chamber, name)[keep] for name in fields})


def with_value(chamber, name, where, value):
    column = getattr(chamber, name).astype(float)
    column[where] = value
    return dataclasses.replace(chamber, **{name: column})


def shifted(chamber, name, run, by):
    return with_value(chamber, name, chamber.run == run, getattr(chamber, name)[chamber.run == run] + by)


REFUSALS = {
    "no readings": (lambda c: rows(c, slice(0, 0)), "no readings"),
    "no -1 g": (lambda c: rows(c, c.run != 2), r"0\.3 degC/min: 0 of the 1 run\(s\) at -1 g"),
    "one 0 g": (lambda c: rows(c, c.run != 7), r"0\.9 degC/min: 1 of the 2 run\(s\) at \+0 g"),
    "a run cut short": (lambda c: rows(c, slice(0, -1)), "readings and run 7 has"),
    "read at other times": (
        lambda c: with_value(c, "time_s", np.flatnonzero(c.run == 1)[5:], c.time_s[c.run == 1][5:] + 40.0),
        "reading 5 comes 300.0 s into run",
    ),
    "another programme": (lambda c: shifted(c, "temperature_c", 3, 9.0), "differ by 9.0 degC"),
    "not a number": (lambda c: with_value(c, "output", 17, np.nan), "row 17: output is nan"),
    "upside down": (lambda c: dataclasses.replace(c, input_g=-c.input_g), "sign of input_g"),
    "a run goes on later": (lambda c: with_value(c, "run", c.run == 2, 0), "run 0 goes on after another run"),
    "tilted": (lambda c: shifted(c, "input_g", 1, 0.4), "one position of"),
    "turned within a run": (lambda c: with_value(c, "input_g", 30, 0.0), "from 0 to 1"),
    "time goes back": (lambda c: with_value(c, "time_s", 30, 0.0), "run 0: time_s does not increase"),
    "too short": (lambda c: rows(c, first_minutes(c)), "last"),
}


def first_minutes(chamber):
    start = np.array([chamber.time_s[chamber.run == run][0] for run in chamber.run])
    return chamber.time_s - start < 500.0


@pytest.mark.parametrize("case", REFUSALS)
def test_refused_in_one_sentence(chamber, case):
    spoil, sentence = REFUSALS[case]
    with pytest.raises(DataRefused, match=sentence) as refused:
        four_point(spoil(chamber))
    assert str(refused.value).startswith("chamber")
    assert "\n" not in str(refused.value)
