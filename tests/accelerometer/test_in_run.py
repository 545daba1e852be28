"""The Gauss-Markov bias has the covariance of one, on a regular grid and on an irregular one."""

from __future__ import annotations

import numpy as np
import pytest

from ins_eval.accelerometer import Population, ThermalRun
from ins_eval.streams import Streams

RUNS = 6000
COVARIANCE_TOLERANCE = 5.0 * np.sqrt(2.0 / RUNS)  # five standard errors of a variance


@pytest.mark.parametrize("time_s", [(0.0, 600.0, 1200.0, 1800.0), (0.0, 1.0, 900.0, 7200.0)])
def test_covariance(population: Population, time_s: tuple[float, ...]) -> None:
    run = ThermalRun(np.array(time_s), np.full(4, 22.0), "flight")
    effect = population["in_run"]
    bias_ug = np.array([effect.contribution(None, run, Streams(1).at(k)).bias_ug for k in range(RUNS)])
    apart_s = np.abs(np.subtract.outer(run.time_s, run.time_s))
    expected = 25.0**2 * np.exp(-apart_s / 1800.0)
    assert np.cov(bias_ug.T) == pytest.approx(expected, abs=25.0**2 * COVARIANCE_TOLERANCE)
    assert np.abs(bias_ug.mean(axis=0)).max() < 4 * 25.0 / np.sqrt(RUNS)
