"""Eq. (11) as a polynomial."""

from __future__ import annotations

import numpy as np
import pytest

from ins_eval.scale_factor import TERMS, scale_factor, scale_factor_terms


def test_terms_stand_in_the_stated_order() -> None:
    assert TERMS == ("alpha", "beta", "eta", "epsilon", "mu", "gamma")
    terms = scale_factor_terms(np.array([10.0]), np.array([3.0]))
    assert terms == pytest.approx(np.array([[9.0, 100.0, 30.0, 3.0, 10.0, 1.0]]))


def test_a_scalar_goes_with_an_array() -> None:
    assert scale_factor_terms(np.arange(4), 0.5).shape == (4, 6)
    assert scale_factor_terms(2.0, 0.5).shape == (1, 6)


def test_equation_15_by_hand() -> None:
    # JB-KT8 #1 at dT = -30 degC and -0.2 degC/min: 10.92 + 90.72 - 0.14454 - 17.628 + 982.8 + 320320
    coefficients = (273.0, 0.1008, -0.02409, 88.14, -32.76, 320320.0)
    assert scale_factor(coefficients, np.array([-30.0]), np.array([-0.2])) == pytest.approx(321386.66746, abs=1e-6)


@pytest.mark.parametrize(("rates", "rank"), [((-0.3,), 3), ((-0.3, 0.3), 5), ((-0.3, 0.3, -0.5, 0.5), 6)])
def test_what_a_calibration_can_tell_apart(rates: tuple[float, ...], rank: int) -> None:
    difference, rate = (a.ravel() for a in np.meshgrid(np.linspace(-80.0, 50.0, 40), rates))
    assert np.linalg.matrix_rank(scale_factor_terms(difference, rate)) == rank
