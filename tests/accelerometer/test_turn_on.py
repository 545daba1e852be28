"""Bias from switch-on to switch-on."""

from __future__ import annotations

import numpy as np
import pytest

from ins_eval.accelerometer import Population, ThermalRun
from ins_eval.streams import Streams


@pytest.mark.parametrize(("kind", "sigma_ug"), [("flight", 50.0), ("oven", 50.0), ("chamber", 20.0)])
def test_constant_in_a_run_and_new_in_the_next(population: Population, kind: str, sigma_ug: float) -> None:
    run = ThermalRun(np.arange(3.0), np.full(3, 22.0), kind)
    parts = [population["turn_on"].contribution(None, run, Streams(1).at(k)) for k in range(4000)]
    bias_ug = np.array([part.bias_ug for part in parts])
    assert bias_ug.shape == (4000,)  # one number for each run
    assert np.std(bias_ug) == pytest.approx(sigma_ug, rel=0.05)
    assert abs(np.mean(bias_ug)) < 4 * sigma_ug / np.sqrt(4000)
    assert all(part.scale_ppm == 0.0 for part in parts)
