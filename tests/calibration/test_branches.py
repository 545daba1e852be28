"""The two-branch curve against numpy.interp, a dense least squares, and its own promises."""

import numpy as np
import pytest

from ins_eval.calibration.branches import KNOTS_C, BranchCurve, branches

FALLING_FAST, RISING_FAST = -0.12, 0.12  # degC/min: from here on one branch alone
EXACT = 1e-12
FIT_TOLERANCE = 1e-4  # of values of the order 1000: what a ridge of 1e-6 readings leaves
BRIDGE_TOLERANCE = 1e-3  # of the range of values: the weight of the middle in the ridge


@pytest.fixture
def curve():
    rng = np.random.default_rng(3)
    return BranchCurve(KNOTS_C, rng.normal(0.0, 1000.0, KNOTS_C.size), rng.normal(0.0, 1000.0, KNOTS_C.size))


@pytest.fixture
def readings():
    """Temperatures and rates that reach every knot on both branches."""
    rng = np.random.default_rng(4)
    return np.append(rng.uniform(-60.0, 70.0, 5000), (-60.0, 70.0)), np.append(rng.uniform(-0.4, 0.4, 5000), (0.0, 0.0))


@pytest.mark.parametrize(("rate", "branch"), [(FALLING_FAST, "falling"), (RISING_FAST, "rising"), (-3.0, "falling")])
def test_pure_branch_is_a_piecewise_line_that_ends_level(curve, rate, branch):
    temperature = np.linspace(-90.0, 100.0, 1901)
    expected = np.interp(temperature, KNOTS_C, getattr(curve, branch))
    np.testing.assert_allclose(curve.evaluate(temperature, rate), expected, rtol=EXACT, atol=1e-9)


def test_blend_is_even_at_rest_and_linear_in_the_rate(curve):
    temperature = np.linspace(-60.0, 70.0, 50)
    falling, rising = (np.interp(temperature, KNOTS_C, v) for v in (curve.falling, curve.rising))
    np.testing.assert_allclose(curve.evaluate(temperature, 0.0), (falling + rising) / 2, atol=1e-9)
    np.testing.assert_allclose(curve.evaluate(temperature, 0.06), 0.25 * falling + 0.75 * rising, atol=1e-9)


def test_design_times_values_is_the_curve(curve):
    rng = np.random.default_rng(8)
    temperature, rate = rng.uniform(-80.0, 90.0, 400), rng.uniform(-0.3, 0.3, 400)
    design = curve.design(temperature, rate)
    np.testing.assert_allclose(design @ curve.values, curve.evaluate(temperature, rate), atol=1e-9)
    np.testing.assert_allclose(design.sum(axis=1), 1.0, rtol=EXACT)


def test_curve_is_continuous_in_temperature_and_rate(curve):
    """No step in the curve is larger than its steepest slope times the step of the argument."""
    steepest = max(np.abs(np.diff(v) / np.diff(KNOTS_C)).max() for v in (curve.falling, curve.rising))
    temperature = np.arange(-70.0, 80.0, 1e-3)
    assert np.abs(np.diff(curve.evaluate(temperature, 0.03))).max() <= steepest * 1e-3 * (1 + 1e-6)
    rate = np.arange(-0.3, 0.3, 1e-4)
    widest = np.abs(curve.falling - curve.rising).max()
    assert np.abs(np.diff(curve.evaluate(-12.0, rate))).max() <= widest / 0.24 * 1e-4 * (1 + 1e-6)


def test_a_curve_is_recovered_from_its_own_values(curve, readings):
    found = branches(*readings, curve.evaluate(*readings))
    np.testing.assert_allclose(found.knots_c, KNOTS_C)
    np.testing.assert_allclose(found.falling, curve.falling, atol=FIT_TOLERANCE)
    np.testing.assert_allclose(found.rising, curve.rising, atol=FIT_TOLERANCE)


def test_fit_is_least_squares(readings):
    temperature, rate = readings
    values = 5.0 * temperature + 300.0 * np.sin(temperature / 9.0) + np.random.default_rng(6).normal(0.0, 50.0, 5002)
    hats = np.stack([np.interp(temperature, KNOTS_C, row) for row in np.eye(KNOTS_C.size)], axis=1)
    falling = np.clip(0.5 - rate / 0.24, 0.0, 1.0)[:, None]
    expected, *_ = np.linalg.lstsq(np.hstack([falling * hats, (1 - falling) * hats]), values)
    found = branches(temperature, rate, values)
    np.testing.assert_allclose(np.append(found.falling, found.rising), expected, atol=FIT_TOLERANCE)


def test_knots_end_where_the_readings_end():
    temperature = np.linspace(-52.0, 78.0, 1000)
    found = branches(temperature, np.where(np.arange(1000) % 2, 0.2, -0.2), 50.0 * temperature)
    np.testing.assert_allclose(found.knots_c, [-52.0, -40.0, -20.0, -5.0, 10.0, 22.0, 40.0, 55.0, 70.0, 78.0])
    np.testing.assert_allclose(found.falling, 50.0 * found.knots_c, atol=1e-3)
    assert found.evaluate(np.array([-90.0]), 0.0)[0] == pytest.approx(50.0 * -52.0, abs=1e-3)


def test_a_branch_without_readings_follows_the_other():
    temperature = np.linspace(-30.0, 30.0, 500)
    found = branches(temperature, np.full(500, -0.3), temperature**2)
    np.testing.assert_allclose(found.rising, found.falling, atol=BRIDGE_TOLERANCE * 900.0)
    # a polygon between knots h apart leaves a parabola by h^2 / 4 at most, here h = 18 degC
    np.testing.assert_allclose(found.falling, found.knots_c**2, atol=18.0**2 / 4)


def test_a_gap_in_the_readings_is_bridged_within_its_ends():
    temperature = np.concatenate((np.linspace(-60.0, -41.0, 200), np.linspace(41.0, 70.0, 200)))
    values = np.where(temperature < 0, 100.0, 400.0)
    found = branches(temperature, np.where(np.arange(400) % 2, 0.2, -0.2), values)
    assert np.all(np.diff(found.falling) >= -1.0)
    assert found.falling.min() > 95.0 and found.falling.max() < 405.0


def test_readings_at_one_temperature_give_a_constant():
    found = branches(np.full(20, 12.0), np.zeros(20), np.full(20, 7.0))
    np.testing.assert_allclose(found.evaluate(np.array([-40.0, 12.0, 60.0]), 0.3), 7.0, atol=1e-9)


def test_constants_of_runs_stay_out_of_the_curve(curve, readings):
    run = np.arange(readings[0].size) % 3
    values = curve.evaluate(*readings)
    found = branches(*readings, values + np.array([0.0, 500.0, -200.0])[run], run=run)
    assert found.evaluate(*readings).mean() == pytest.approx(0.0, abs=1e-6)
    np.testing.assert_allclose(found.evaluate(*readings), values - values.mean(), atol=1e-3)
