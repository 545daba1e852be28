"""Eq. (11) against what the paper prints, and against what follows from it by hand."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from ins_eval.accelerometer import Population, ThermalRun
from ins_eval.accelerometer.scale_polynomial import ScalePolynomial
from ins_eval.scale_factor import scale_factor
from ins_eval.streams import Streams

Through = Callable[..., ThermalRun]

# Paper A, eqs (15)-(17): alpha, beta, eta, epsilon, mu, gamma
PRINTED = (
    (273.0, 0.1008, -0.02409, 88.14, -32.76, 320320.0),
    (102.76, 0.08, -1.4912, 21.01, -49.81, 308000.0),
    (49.12, 0.2385, -0.0972, 48.53, -41.14, 328000.0),
)
RANGES_C = ((-54.0, 81.0), (-52.0, 82.0), (-53.0, 82.0))  # section 3.1
SENSITIVITY_PPM_PER_C = (107, 165, 136)  # of the printed polynomials over those ranges, T0 = 22 degC
FALLING_MINUS_RISING_PPM = (-165, -41, -89)  # as printed, at 0.3 degC/min and T0
ROUNDED = 0.5
PPM_TOLERANCE = 1e-6


def effect(population: Population, unit: int, **changes: object) -> ScalePolynomial:
    """The effect of one printed accelerometer, not perturbed."""
    found = population["scale_polynomial"]
    return found.model_copy(update={"units": (found.units[unit],), "spread": 0.0, **changes})


def scale_ppm(effect: ScalePolynomial, run: ThermalRun) -> np.ndarray:
    return effect.contribution(effect.draw(np.random.default_rng(0), {}), run, Streams(0)).scale_ppm


@pytest.mark.parametrize("unit", range(3))
def test_coefficients_are_those_of_the_paper(population: Population, unit: int) -> None:
    printed = effect(population, unit, rate_sign="printed")
    assert printed.coefficients(printed.units[0]) == pytest.approx(PRINTED[unit], rel=1e-12)
    text = effect(population, unit)
    assert text.coefficients(text.units[0]) == pytest.approx(np.array(PRINTED[unit]) * (1, 1, -1, -1, 1, 1), rel=1e-12)


@pytest.mark.parametrize("unit", range(3))
def test_temperature_sensitivity_over_the_quoted_range(population: Population, unit: int) -> None:
    one = effect(population, unit)
    low_c, high_c = RANGES_C[unit]
    scale = scale_factor(one.coefficients(one.units[0]), np.linspace(low_c, high_c, 2001) - 22.0, 0.0)
    sensitivity = 1e6 * (scale[0] - scale[-1]) / scale.mean() / (high_c - low_c)
    assert sensitivity == pytest.approx(SENSITIVITY_PPM_PER_C[unit], abs=ROUNDED)


@pytest.mark.parametrize("unit", range(3))
@pytest.mark.parametrize(("sign", "turned"), [("printed", 1), ("text", -1)])
def test_sign_of_the_rate_terms(population: Population, through, unit: int, sign: str, turned: int) -> None:
    one = effect(population, unit, rate_sign=sign)
    falling, rising = through((52.0, 22.0), 0.3), through((-8.0, 22.0), 0.3)
    loop_ppm = scale_ppm(one, falling)[-1] - scale_ppm(one, rising)[-1]
    assert loop_ppm == pytest.approx(turned * FALLING_MINUS_RISING_PPM[unit], abs=ROUNDED)


@pytest.mark.parametrize(("unit", "per_min_ppm", "per_s_ppm"), [(0, 55, 0.9), (1, 14, 0.2), (2, 30, 0.5)])
def test_unit_of_the_rate(population: Population, unit: int, per_min_ppm: float, per_s_ppm: float) -> None:
    # the size of epsilon r at 0.2 degC/min
    for rate_unit, expected, rounded in (("degC/min", per_min_ppm, 0.5), ("degC/s", per_s_ppm, 0.05)):
        one = effect(population, unit, rate_unit=rate_unit, rate_sign="printed")
        epsilon, gamma = one.coefficients(one.units[0])[[3, 5]]
        assert 1e6 * epsilon * 0.2 / gamma == pytest.approx(expected, abs=rounded)


def test_quadratic_rate_term_scales_with_the_square_of_the_unit(population: Population) -> None:
    per_min, per_s = (effect(population, 0, rate_unit=u) for u in ("degC/min", "degC/s"))
    ratio = per_min.coefficients(per_min.units[0]) / per_s.coefficients(per_s.units[0])
    assert ratio == pytest.approx([3600.0, 1.0, 60.0, 60.0, 1.0, 1.0])


def test_contribution_is_the_polynomial_in_ppm_of_gamma(population: Population, through: Through) -> None:
    run = through((22.0, -60.0), 0.7)
    alpha, beta, eta, epsilon, mu, gamma = PRINTED[1]
    d, r = -82.0, -0.7  # the filter has settled after two hours
    expected = 1e6 / gamma * (alpha * r**2 + beta * d**2 - eta * r * d - epsilon * r + mu * d)
    assert scale_ppm(effect(population, 1), run)[-1] == pytest.approx(expected, abs=1e-3)


def test_reference_temperature_can_be_chosen(population: Population, through: Through) -> None:
    run = through((0.0, 0.0 + 1e-12), 1e-12 / 60)
    assert scale_ppm(effect(population, 0, reference_temperature_c=0.0), run) == pytest.approx(0.0, abs=PPM_TOLERANCE)
    assert scale_ppm(effect(population, 0), run)[0] > 2000.0


def test_coefficients_may_be_in_ppm_of_gamma(population: Population) -> None:
    pulse = effect(population, 2)
    unit = pulse.units[0]
    in_ppm = {term: 1e6 * getattr(unit, term) / unit.gamma for term in ("alpha", "beta", "eta", "epsilon", "mu")}
    ppm = effect(population, 2, coefficients_in="ppm", units=(unit.model_copy(update=in_ppm),))
    assert ppm.coefficients(ppm.units[0]) == pytest.approx(pulse.coefficients(unit), rel=1e-12)


def test_every_coefficient_but_gamma_is_spread_by_a_fifth(population: Population, rng: np.random.Generator) -> None:
    one = population["scale_polynomial"]
    factors = np.array([one.draw(rng, {}) for _ in range(400)]) / one.coefficients(one.units[0])
    assert np.all(factors[:, 5] == 1.0)
    assert np.all(np.abs(factors[:, :5] - 1.0) <= 0.2)
    assert np.all(factors[:, :5].min(axis=0) < 0.82) and np.all(factors[:, :5].max(axis=0) > 1.18)
    assert np.abs(np.corrcoef(factors[:, :5].T) - np.eye(5)).max() < 0.2  # 4 sigma of 400 draws


def test_the_three_units_are_dealt_to_the_axes_at_random(population: Population) -> None:
    gammas = [tuple(unit.gamma for unit in population.draw(Streams(i))) for i in range(60)]
    assert {frozenset(g) for g in gammas} == {frozenset(p[5] for p in PRINTED)}
    assert len(set(gammas)) == 6  # every order occurs
