"""Evidence against brute-force integration."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

from ins_eval.estimation.evidence import SCALES, log_bayes_factors, log_evidence, reduce
from ins_eval.estimation.whitening import Whitened

INTEGRATION = 1e-6


@pytest.fixture
def rows() -> tuple[np.ndarray, np.ndarray]:
    """A whitened residual (n,) and two columns (n, 2) that are not orthogonal."""
    rng = np.random.default_rng(3)
    x = rng.standard_normal((12, 2)) @ np.array([[1.0, 0.4], [0.0, 0.8]])
    return x @ np.array([0.7, -1.1]) + rng.standard_normal(12), x


def sums(e: np.ndarray, x: np.ndarray) -> Whitened:
    return Whitened(x.T @ x, x.T @ e, float(e @ e), 1.7, e.size, np.empty(0))


def test_evidence_is_the_integral_of_likelihood_times_prior(rows) -> None:
    e, x = rows

    grid = np.linspace(-7.0, 7.0, 401)  # the trapezoid is exact to rounding for what dies away at both ends
    p, q = np.meshgrid(grid, grid)
    left = e[:, None, None] - x[:, 0, None, None] * p - x[:, 1, None, None] * q
    density = np.exp(norm.logpdf(left).sum(axis=0) + norm.logpdf(p) + norm.logpdf(q))
    integral = density.sum() * (grid[1] - grid[0]) ** 2
    assert log_evidence(sums(e, x)) == pytest.approx(np.log(integral) - 0.5 * 1.7, abs=INTEGRATION)


@pytest.mark.parametrize("centre", [0.0, 2.0])
def test_bayes_factor_of_a_further_column(rows, centre: float) -> None:
    e, x = rows

    def evidence_at(q: float) -> float:
        """With the second coefficient fixed and the first integrated out."""
        return np.exp(log_evidence(sums(e - q * x[:, 1], x[:, :1])))

    scales = SCALES if centre == 0.0 else (1.0,)
    integrals = [
        quad(lambda q, s=s: evidence_at(q) * norm.pdf(q, centre, s), -30.0, 30.0, limit=400, epsabs=0.0)[0]
        for s in scales
    ]
    left = reduce(sums(e, x), 1)
    found = log_bayes_factors(left.normal[0, 0], left.projection[0], centre)
    assert found == pytest.approx(np.log(np.mean(integrals) / evidence_at(0.0)), abs=INTEGRATION)


def test_a_column_that_the_data_do_not_see_says_nothing() -> None:
    assert log_bayes_factors(0.0, 0.0) == pytest.approx(0.0, abs=1e-12)
