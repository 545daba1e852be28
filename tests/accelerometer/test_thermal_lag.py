"""Inner elements behind the surface."""

from __future__ import annotations

import numpy as np
import pytest

from ins_eval.accelerometer import Population

LAG_TOLERANCE_C = 1e-9


def test_elements_trail_a_long_ramp_by_rate_times_lag(population: Population, through) -> None:
    run = population["thermal_lag"].inside(through((60.0, -60.0), 0.6))
    behind_c = run.element_c[-1] - run.temperature_c[-1]
    assert behind_c == pytest.approx(0.6 / 60.0 * 180.0, abs=LAG_TOLERANCE_C)


def test_elements_start_at_the_surface_and_approach_a_step_exponentially(population: Population, through) -> None:
    run = population["thermal_lag"].inside(through((22.0, 32.0, 32.0 + 1e-9), 10.0 / 1e-6, step_s=1e-7))
    assert run.element_c[0] == 22.0
    time_s = np.array([0.0, 1e-6, 90.0, 180.0, 540.0])
    step = type(run)(time_s, np.array([22.0, 32.0, 32.0, 32.0, 32.0]), "oven", 180.0)
    assert step.element_c == pytest.approx(32.0 - 10.0 * np.exp(-time_s / 180.0), abs=1e-6)
