"""Slow factors against their definitions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ins_eval.effects.parts import conditions
from ins_eval.effects.slow import branch, creep, per_second
from ins_eval.effects.temperature import SmoothedTemperature
from ins_eval.thermal import filtered_rate

# an integrator's error; of 63 % reached within one width; of smoothing where the temperature bends
ODE_C, SHARE, SMOOTHED_C = 1e-5, 1e-3, 0.02


def test_creep_solves_its_equation() -> None:
    time_s = np.arange(0.0, 6000.0, 1.0)
    temperature = 20.0 + 15.0 * np.sin(time_s / 900.0) + 3.0
    tau = 1500.0
    solved = solve_ivp(
        lambda t, y: (23.0 + 15.0 * np.sin(t / 900.0) - y) / tau,
        (0.0, 5999.0), [temperature[0]], t_eval=time_s, rtol=1e-9, atol=1e-9,
    ).y[0]  # fmt: skip
    np.testing.assert_allclose(creep(time_s, temperature, tau), solved - temperature[0], atol=ODE_C)


def test_a_branch_is_reached_to_63_percent_within_its_width_whatever_the_speed() -> None:
    width = 2.0
    up, down = np.linspace(0.0, 30.0, 3000), np.linspace(30.0, 28.0, 500)
    quick = np.linspace(30.0, 28.0, 50)
    for way in (down, quick):
        side = branch(np.concatenate([up, way]), width)
        assert side[up.size - 1] == pytest.approx(-1.0)
        assert side[-1] == pytest.approx(-1.0 + 2.0 * (1.0 - np.exp(-1.0)), abs=SHARE)


def test_the_branch_on_which_it_begins_is_forgotten_within_its_width() -> None:
    width, up = 2.0, np.linspace(0.0, 10.0, 1001)
    for begin in (-1.0, -0.3, 0.8):
        side = branch(up, width, begin)
        np.testing.assert_allclose(side, -1.0 + (begin + 1.0) * np.exp(-up / width), atol=SHARE)
    np.testing.assert_array_equal(branch(up, width), branch(up, width, -1.0))  # else on the branch that it follows


def test_memory_begins_anew_in_each_run() -> None:
    time_s = np.arange(0.0, 4000.0, 10.0)
    runs = (np.arange(0, 200), np.arange(200, 400))
    smooth = np.tile(np.linspace(0.0, 30.0, 200), 2)
    seen = SmoothedTemperature(time_s, np.repeat(smooth[:, None], 3, 1), np.zeros((400, 3)), 22.0, 180.0, runs)
    memory = seen.in_runs(lambda t, c: creep(t, c, 600.0), 0)
    np.testing.assert_allclose(memory[200:], memory[:200])
    assert memory[200] == 0.0


def test_means_over_seconds() -> None:
    time_s = 5.0 + np.arange(1, 41) / 20.0
    second, mean = per_second(time_s, np.arange(40.0))
    np.testing.assert_allclose(second, [5.525, 6.525])
    np.testing.assert_allclose(mean, [9.5, 29.5])


def test_the_temperature_of_a_flight_is_its_reading_made_smooth(flight) -> None:
    seen = conditions(flight).temperature
    at_grid = np.interp(seen.time_s, flight.imu.time_s, flight.imu.temperature_c)
    np.testing.assert_allclose(seen.smooth_c[:, 1], at_grid, atol=SMOOTHED_C)
    np.testing.assert_allclose(seen.rate_c_per_min[:, 2], filtered_rate(seen.time_s, seen.smooth_c[:, 2]))
