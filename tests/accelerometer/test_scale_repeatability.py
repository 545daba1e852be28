"""Scale factor from switch-on to switch-on."""

from __future__ import annotations

import numpy as np
import pytest

from ins_eval.accelerometer import Population, ThermalRun
from ins_eval.streams import Streams


def test_thirty_ppm_constant_in_a_run_and_new_in_the_next(population: Population, flight: ThermalRun) -> None:
    effect = population["scale_repeatability"]
    parts = [effect.contribution(None, flight, Streams(1).at(k)) for k in range(4000)]
    ppm = np.array([part.scale_ppm for part in parts])
    assert ppm.shape == (4000,)  # one number for each run
    assert np.std(ppm) == pytest.approx(30.0, rel=0.05)
    assert abs(np.mean(ppm)) < 4 * 30.0 / np.sqrt(4000)
    assert all(part.bias_ug == 0.0 for part in parts)
