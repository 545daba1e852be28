"""What a recording could show: against quadrature and simulation, and against what a flight cannot know."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import trapezoid
from scipy.stats import norm

from ins_eval.diagnosis.answer.detectability import detectability, expected, shows_from
from ins_eval.estimation.case import prepare
from ins_eval.estimation.evidence import SCALES, expected_log_evidence
from ins_eval.estimation.study import sums, union

DRAWS = 4000
STANDARD_ERRORS = 4.0
MIXTURE_NATS = 0.4  # by which the mean over the scales may lie below the expectation of its log
ENOUGH = 5.3
INVISIBLE = 1.0


def bayes_factor(a: float, b: float, scale: float) -> float:
    """The mean of the likelihood ratio over a Gaussian prior, by quadrature around its maximum."""
    spread = 1.0 / np.sqrt(a + scale**-2)
    middle = b * spread**2
    top = b * middle - 0.5 * a * middle**2
    p = middle + spread * np.linspace(-10.0, 10.0, 401)
    density = np.exp(b * p - 0.5 * a * p**2 - top) * np.exp(-0.5 * (p / scale) ** 2) / (scale * np.sqrt(2.0 * np.pi))
    part = trapezoid(density, p)  # of what is smooth and ends at 0: to rounding
    return float(top + np.log(part))


@pytest.mark.parametrize("a", [0.04, 1.0, 25.0])
@pytest.mark.parametrize("size", [0.5, 1.0, 3.0])
def test_expected_evidence_is_the_mean_of_simulated_evidence(a: float, size: float) -> None:
    rng = np.random.default_rng(4)
    draws = a * size + np.sqrt(a) * rng.standard_normal(100)
    each = np.array([[bayes_factor(a, b, scale) for scale in SCALES] for b in draws])
    told = np.logaddexp.reduce(each, axis=1) - np.log(len(SCALES))
    error = STANDARD_ERRORS * told.std() / np.sqrt(told.size)
    assert told.mean() - MIXTURE_NATS - error < expected(a, size) < told.mean() + error


def test_a_size_that_physics_fixes_is_exact() -> None:
    rng = np.random.default_rng(5)
    a, centre = 2.0, 4.0
    draws = a * centre + np.sqrt(a) * rng.standard_normal(DRAWS)
    # prior N(centre, 1): ratio of the densities of b with and without the effect
    told = norm.logpdf(draws, a * centre, np.sqrt(a + a**2)) - norm.logpdf(draws, 0.0, np.sqrt(a))
    error = STANDARD_ERRORS * told.std() / np.sqrt(DRAWS)
    assert expected(a, centre, centre) == pytest.approx(told.mean(), abs=error)


@pytest.mark.parametrize("centre", [0.0, 4.0])
def test_one_column_is_a_set_of_one(centre: float) -> None:
    several = expected_log_evidence(np.array([[2.0]]), {0: 3.0}, [0], np.array([centre]))
    assert expected(2.0, 3.0, centre) == pytest.approx(several, rel=1e-12)


def test_effects_apart_from_one_another_bring_the_sum_however_many_they_are() -> None:
    """Z of columns at right angles is a product; twelve with every combination of scales would be 5^12 of them."""
    a, size = np.geomspace(0.01, 100.0, 12), np.linspace(-3.0, 30.0, 12)
    found = expected_log_evidence(np.diag(a), dict(enumerate(size)), range(12), np.zeros(12))
    assert found == pytest.approx(sum(expected(*one) for one in zip(a, size, strict=True)), rel=1e-9)


def test_the_size_that_shows_is_expected_to_bring_enough() -> None:
    sizes = [shows_from(a, ENOUGH) for a in (0.01, 1.0, 100.0)]
    for a, size in zip((0.01, 1.0, 100.0), sizes, strict=True):
        assert expected(a, size) == pytest.approx(ENOUGH, abs=1e-6)
    assert sizes == sorted(sizes, reverse=True)
    assert shows_from(0.0, ENOUGH) is None


def test_a_transport_flight_shows_a_vertical_drift_and_hides_higher_orders(flight) -> None:
    case = prepare(flight)
    hypotheses = union([case])
    here = sums([case], [np.zeros(len(case.noise.free))], hypotheses, coarse=True)
    found = detectability([one.candidate for one in hypotheses], np.diag(here.normal), ENOUGH)
    assert len({(one.name, one.axis, one.other_axis) for one in found}) == len(found)
    gains = {(one.name, one.axis): one.expected_log_bayes_factor for one in found}
    in_order = [one.expected_log_bayes_factor for one in found]
    assert in_order == sorted(in_order)
    for name in ("quadratic", "cubic", "cross_output"):  # along a horizontal axis a flight feels hundredths of g
        assert gains[f"accelerometer.{name}", "x"] < INVISIBLE
    assert gains["accelerometer.bias_drift", "z"] > ENOUGH  # GPS height sees 60 ug after two hours
    by_key = {(one.name, one.axis): one for one in found}
    # 60 ug after two hours is far more than enough, so less than the usual drift shows
    drift = by_key["accelerometer.bias_drift", "z"]
    assert drift.shows_from < drift.usual
    assert by_key["accelerometer.quadratic", "x"].shows_from > by_key["accelerometer.quadratic", "x"].usual
