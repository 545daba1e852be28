"""Table 4's measure against the paper's own quotients and the printed polynomials."""

import numpy as np
import pytest

from ins_eval.calibration.sensitivity import change_ppm, degree_means, sensitivity_ppm_per_c

EQ_15 = (0.1008, -32.76, 320320.0)  # Paper A, eq. (15), JB-KT8 #1: beta, mu, gamma
DEGREE_TOLERANCE = 0.01  # relative: a mean over a degree at either end, and the mean level


def test_change_is_the_papers_quotient():
    """(X - Y) / A: 330000 and 320000 around 325000 are 30769 ppm."""
    assert change_ppm(np.array([320000.0, 325000.0, 330000.0])) == pytest.approx(1e6 * 10000.0 / 325000.0)


def test_printed_polynomial_over_the_printed_range():
    """Eq. (15), T0 = 22 degC, falls by 4654 pulse/(g s) from -54 to 81 degC: 107.5 ppm/degC, printed is 74.14."""
    temperature = np.linspace(-54.0, 81.0, 5401)
    values = np.polyval(EQ_15, temperature - 22.0)
    cold, hot = np.polyval(EQ_15, np.array([-76.0, 59.0]))
    expected = 1e6 * (cold - hot) / values.mean() / 135.0
    assert expected == pytest.approx(107.5, abs=0.1)
    found = sensitivity_ppm_per_c(temperature, np.ones(5401), values)
    assert found == pytest.approx(expected, rel=DEGREE_TOLERANCE)


def test_a_loop_counts_although_neither_branch_changes():
    """Branches 100 ppm apart over 100 degC: 1 ppm/degC."""
    temperature = np.tile(np.linspace(-50.0, 50.0, 1001), 2)
    rate = np.repeat([-0.2, 0.2], 1001)
    values = 3e5 * (1.0 - 50e-6 * np.sign(rate))
    assert sensitivity_ppm_per_c(temperature, rate, values) == pytest.approx(1.0, rel=DEGREE_TOLERANCE)


def test_noise_does_not_decide_it():
    """White noise of 10 ppm in 20 readings a degree: the extremes of 202 means lie 5.6 of their sigmas apart, not 8."""
    rng = np.random.default_rng(3)
    temperature = np.repeat(np.linspace(-50.0, 50.0, 2020), 2)
    rate = np.tile([-0.2, 0.2], 2020)
    values = 3e5 * (1.0 + 1e-5 * rng.standard_normal(4040))
    assert np.ptp(values) / 3e5 * 1e6 > 65.0
    assert sensitivity_ppm_per_c(temperature, rate, values) == pytest.approx(5.6 * 10.0 / np.sqrt(20) / 100.0, rel=0.3)


def test_degrees_that_hardly_a_reading_reaches_are_left_out():
    temperature = np.append(np.repeat(np.arange(-5.0, 6.0), 20), [6.0, 6.0])
    means = degree_means(temperature, np.full(222, 0.3), temperature)
    np.testing.assert_allclose(means.temperature_c, np.arange(-5.0, 6.0))
    assert not means.falling.any()


def test_one_temperature_has_no_sensitivity():
    assert np.isnan(sensitivity_ppm_per_c(np.full(5, 22.0), np.zeros(5), np.full(5, 3e5)))
