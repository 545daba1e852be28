"""Polynomial fits against the printed coefficients, numpy.polyfit and scipy's least squares."""

import numpy as np
import pytest
import scipy.linalg

from ins_eval.calibration import fits
from ins_eval.calibration.four_point import four_point
from ins_eval.errors import DataRefused
from ins_eval.scale_factor import TERMS, scale_factor

PRINTED = {  # Paper A, eqs (15)-(17), in the order alpha, beta, eta, epsilon, mu, gamma
    "#1": (273.0, 0.1008, -0.02409, 88.14, -32.76, 320320.0),
    "#2": (102.76, 0.08, -1.4912, 21.01, -49.81, 308000.0),
    "#3": (49.12, 0.2385, -0.0972, 48.53, -41.14, 328000.0),
}
CLOSED_FORM_TOLERANCE = 1e-7  # relative, noise-free readings
LIBRARY_TOLERANCE = 1e-8  # relative, against another least squares


@pytest.fixture
def noisy():
    rng = np.random.default_rng(5)
    temperature, rate = rng.uniform(-55.0, 78.0, 800), rng.uniform(-0.5, 0.5, 800)
    return temperature, rate, scale_factor(PRINTED["#1"], temperature - 22.0, rate) + rng.normal(0.0, 10.0, 800)


@pytest.mark.parametrize("unit", PRINTED)
def test_six_terms_of_a_textbook_chamber_are_recovered(unit, chamber_of):
    printed = PRINTED[unit]
    chamber = chamber_of(
        lambda temperature, rate: scale_factor(printed, temperature - 22.0, rate),
        lambda temperature, _: 0 * temperature,
    )
    points = four_point(chamber)
    fit = fits.polynomial(points.temperature_c, points.rate_c_per_min, points.scale)
    np.testing.assert_allclose([fit.coefficients[term] for term in TERMS], printed, rtol=CLOSED_FORM_TOLERANCE)
    assert fit.residual_rms < 1e-6


def test_six_terms_agree_with_scipy(noisy):
    temperature, rate, values = noisy
    d = temperature - 22.0
    design = np.stack([rate**2, d**2, rate * d, rate, d, np.ones_like(d)], axis=1)
    expected, *_ = scipy.linalg.lstsq(design, values)
    np.testing.assert_allclose(fits.polynomial(*noisy).values, expected, rtol=LIBRARY_TOLERANCE)


@pytest.mark.parametrize(("fit", "degree"), [(fits.line, 1), (fits.quadratic, 2)])
def test_line_and_quadratic_agree_with_numpy_polyfit(fit, degree, noisy):
    temperature, _, values = noisy
    found = fit(*noisy)
    np.testing.assert_allclose(found.values, np.polyfit(temperature - 22.0, values, degree), rtol=LIBRARY_TOLERANCE)
    assert found.covariance is None  # it takes more than the fit: see test_uncertainty


def test_anchored_line_passes_through_the_value_at_the_reference_temperature(noisy):
    temperature, rate, values = noisy
    at_reference = values[np.abs(temperature - 22.0) <= 1.0].mean()
    d = temperature - 22.0
    found = fits.anchored_line(temperature, rate, values)
    assert found.evaluate(np.array([22.0]), 0.0)[0] == pytest.approx(at_reference, rel=1e-12)
    # Legendre's normal equation of a line with a given intercept
    assert found.coefficients["mu"] == pytest.approx(d @ (values - at_reference) / (d @ d), rel=1e-9)
    assert abs(found.coefficients["gamma"] - fits.line(*noisy).coefficients["gamma"]) > 10.0  # another line


def test_constant_is_the_mean_near_the_reference_or_the_nearest_value():
    temperature = np.array([0.0, 21.5, 22.5, 23.5, 40.0])
    values = np.array([1.0, 2.0, 4.0, 8.0, 16.0])
    assert fits.constant(temperature, 0 * values, values).values == pytest.approx([3.0])
    far = np.array([0.0, 30.0, 31.0, 32.0, 40.0])
    assert fits.constant(far, 0 * values, values).values == pytest.approx([2.0])


@pytest.mark.parametrize("terms", [fits.LINE, TERMS, ("alpha", "gamma")])
def test_design_times_coefficients_is_the_curve(terms, noisy):
    temperature, rate, values = noisy
    fit = fits.polynomial(temperature, rate, values, terms)
    curve = fit.design(temperature, rate) @ fit.values
    np.testing.assert_allclose(curve, fit.evaluate(temperature, rate), rtol=LIBRARY_TOLERANCE)


@pytest.mark.parametrize("terms", [fits.CONSTANT, fits.LINE, fits.QUADRATIC, TERMS, ("alpha", "gamma")])
def test_curve_is_equation_11_with_the_other_terms_zero(terms, noisy):
    temperature, rate, values = noisy
    fit = fits.polynomial(temperature, rate, values, terms)
    full = [fit.coefficients[term] for term in TERMS]
    assert sum(value != 0 for value in full) == len(terms)
    np.testing.assert_allclose(
        fit.evaluate(temperature, rate), scale_factor(full, temperature - 22.0, rate), rtol=LIBRARY_TOLERANCE
    )


def test_another_reference_temperature_moves_the_coefficients_not_the_curve(noisy):
    temperature, rate, _ = noisy
    warm, cold = fits.polynomial(*noisy), fits.polynomial(*noisy, reference_c=0.0)
    assert warm.coefficients["gamma"] != pytest.approx(cold.coefficients["gamma"], rel=1e-4)
    np.testing.assert_allclose(warm.evaluate(temperature, rate), cold.evaluate(temperature, rate), rtol=1e-10)


TEMPERATURES = np.tile(np.linspace(-60.0, 70.0, 131), 4)
RATES = {
    "one direction": np.full(524, -0.3),
    "one rate": np.repeat([-0.3, 0.3, -0.3, 0.3], 131),
    "two rates": np.repeat([-0.3, 0.3, -0.9, 0.9], 131),
}


@pytest.mark.parametrize(
    ("rates", "rank", "what"),
    [
        ("one direction", 3, "alpha from epsilon and gamma cannot be separated; eta from mu cannot be separated"),
        ("one rate", 5, "alpha from gamma cannot be separated"),
    ],
)
def test_too_few_rates_leave_terms_inseparable(rates, rank, what):
    d = TEMPERATURES - 22.0
    r = RATES[rates]
    design = np.stack([r**2, d**2, r * d, r, d, np.ones_like(d)], axis=1)
    assert np.linalg.matrix_rank(design / np.linalg.norm(design, axis=0)) == rank
    with pytest.raises(DataRefused, match=rf"determine {rank} of 6 coefficients") as refused:
        fits.polynomial(TEMPERATURES, r, d)
    assert what in str(refused.value)
    assert "two or more rates" in str(refused.value)


def test_two_rates_in_both_directions_determine_all_six():
    values = scale_factor(PRINTED["#3"], TEMPERATURES - 22.0, RATES["two rates"])
    found = fits.polynomial(TEMPERATURES, RATES["two rates"], values)
    np.testing.assert_allclose(found.values, PRINTED["#3"], rtol=CLOSED_FORM_TOLERANCE)


def test_terms_that_no_reading_shows_are_named():
    with pytest.raises(DataRefused, match="alpha cannot be seen; eta cannot be seen; epsilon cannot be seen"):
        fits.polynomial(TEMPERATURES, 0.0 * TEMPERATURES, TEMPERATURES)
    with pytest.raises(DataRefused, match="determine 1 of 2 .*mu from gamma"):
        fits.line(np.full(5, 30.0), np.zeros(5), np.ones(5))
