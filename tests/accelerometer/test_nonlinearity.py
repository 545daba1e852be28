"""The rest of eq. (1), term by term."""

from __future__ import annotations

import numpy as np
import pytest

from ins_eval.accelerometer import Population, SlowErrors
from ins_eval.accelerometer.model import Accelerometer
from ins_eval.output_equation import Coefficients
from ins_eval.streams import Streams

SCALE = 320000.0
BIAS_UG = 70.0
FORCE_G = np.array([0.3, -1.7, 2.2])  # forward, right, down
# input, pendulous, output axis of each accelerometer, as body axes
AXES = {"x": "xzy", "y": "yzx", "z": "zxy"}


def accelerometer(population: Population, axis: str, coefficients: Coefficients) -> Accelerometer:
    drawn = population.only("nonlinearity").draw(Streams(3))["xyz".index(axis)]
    return Accelerometer(axis, drawn.effects, {**drawn.units, "nonlinearity": coefficients})


@pytest.mark.parametrize("axis", "xyz")
@pytest.mark.parametrize("term", Coefficients._fields)
def test_each_term_of_equation_1(population: Population, axis: str, term: str) -> None:
    ai, ap, ao = (FORCE_G["xyz".index(letter)] for letter in AXES[axis])
    by_hand = {
        "k2": 400.0 * ai**2,
        "k3": 400.0 * ai**3,
        "kip": 400.0 * ai * ap,
        "kio": 400.0 * ai * ao,
        "delta_o": 400.0 * ap,
        "delta_p": -400.0 * ao,
    }
    none = Coefficients(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    unit = accelerometer(population, axis, none._replace(**{term: 400.0}))
    expected = SCALE * (1e-6 * (BIAS_UG + by_hand[term]) + ai)
    assert unit.output(FORCE_G, SCALE, BIAS_UG) == pytest.approx(expected, rel=1e-13)
    assert unit.output(np.tile(FORCE_G, (4, 1)), SCALE, BIAS_UG) == pytest.approx(np.full(4, expected), rel=1e-13)


def test_all_terms_together(population: Population) -> None:
    unit = accelerometer(population, "z", Coefficients(1e3, 2e3, 3e3, 4e3, 5e3, 6e3))
    i, p, o = 2.2, 0.3, -1.7
    extra = 1e-3 * (i**2 + 2 * i**3 + 3 * i * p + 4 * i * o + 5 * p - 6 * o)
    slow = SlowErrors(np.array([SCALE]), np.array([BIAS_UG]))
    counts = unit.counts(np.array([2.0]), FORCE_G, slow, Streams(0))
    assert counts == pytest.approx(2.0 * SCALE * (BIAS_UG * 1e-6 + i + extra), rel=1e-13)


def test_only_the_quadratic_term_by_default(population: Population, rng: np.random.Generator) -> None:
    units = np.array([population["nonlinearity"].draw(rng, {}) for _ in range(4000)])
    assert np.std(units[:, 0]) == pytest.approx(30.0, rel=0.05)  # 30 ppm of the output at 1 g
    assert np.all(units[:, 1:] == 0.0)


def test_the_other_terms_can_be_given(population: Population, rng: np.random.Generator) -> None:
    sigmas = {"k3_sigma_ug_per_g3": 1.0, "kip_sigma_ug_per_g2": 2.0, "kio_sigma_ug_per_g2": 3.0}
    sigmas |= {"delta_o_sigma_urad": 4.0, "delta_p_sigma_urad": 5.0}
    effect = population["nonlinearity"].model_copy(update=sigmas)
    units = np.array([effect.draw(rng, {}) for _ in range(4000)])
    assert units.std(axis=0) == pytest.approx([30.0, 1.0, 2.0, 3.0, 4.0, 5.0], rel=0.06)
