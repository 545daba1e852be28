"""Bias with temperature, by hand."""

from __future__ import annotations

import numpy as np
import pytest

from ins_eval.accelerometer import Population
from ins_eval.streams import Streams

BIAS_TOLERANCE_UG = 1e-9


def test_cubic_in_the_temperature_of_the_elements(population: Population, through) -> None:
    effect, streams = population["bias_temperature"], Streams(0)
    unit = np.array([-40.0, 0.03, -2e-4])
    run = through((22.0, 62.0), 0.6)
    d = 40.0
    at_surface = -40.0 * d + 0.03 * d**2 - 2e-4 * d**3
    assert effect.contribution(unit, run, streams).bias_ug[-1] == pytest.approx(at_surface, abs=BIAS_TOLERANCE_UG)
    d -= 0.6 / 60.0 * 180.0  # the elements are 1.8 degC behind on a long ramp
    lagging = -40.0 * d + 0.03 * d**2 - 2e-4 * d**3
    behind = run.with_element_lag(180.0)
    assert effect.contribution(unit, behind, streams).bias_ug[-1] == pytest.approx(lagging, abs=1e-6)


def test_coefficients_of_the_population(population: Population, rng: np.random.Generator) -> None:
    effect = population["bias_temperature"]
    omega = np.array([effect.draw(rng, {}) for _ in range(4000)])
    size = np.abs(omega[:, 0])
    assert np.median(size) == pytest.approx(50.0, rel=0.04)
    assert np.std(np.log(size)) == pytest.approx(0.4, rel=0.05)
    assert np.mean(omega[:, 0] > 0) == pytest.approx(0.5, abs=0.04)
    assert np.std(omega[:, 1]) == pytest.approx(0.03, rel=0.05)
    assert np.std(omega[:, 2]) == pytest.approx(2e-4, rel=0.05)
