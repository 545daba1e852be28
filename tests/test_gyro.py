"""The gyro triad: each error alone against its law, their sizes over a population, draws that stay where they are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from ins_eval.gyro import GyroPopulation
from ins_eval.streams import Streams
from ins_eval.units import DEG_PER_H, DEG_PER_SQRT_H, PPM

CHANCE = 1e-3  # of a chi-square bound, each side; seeds are fixed
EXACT = 1e-9  # relative
TRIADS = 200
START_S = -10.0
TIME_S = START_S + np.arange(1, 1001) * 0.5
ERRORS = {
    "bias_deg_per_h": 0.014,
    "instability_deg_per_h": 0.003,
    "angle_random_walk_deg_per_sqrt_h": 0.001,
    "scale_ppm": 20.0,
    "asymmetry_ppm": 20.0,
}
PERFECT = GyroPopulation().perfect()
STILL = np.zeros((TIME_S.size, 3))


def error(population: GyroPopulation, true: np.ndarray, number: int = 0) -> np.ndarray:
    return population.increments(TIME_S, START_S, true, Streams(3).at(number)) - true


def assert_sigma(values: np.ndarray, sigma: float) -> None:
    """The values are draws of N(0, sigma^2): their sum of squares is a chi-square."""
    low, high = chi2.ppf([CHANCE, 1.0 - CHANCE], values.size)
    assert low < np.sum((values / sigma) ** 2) < high


def test_the_shipped_population_is_that_of_table_5() -> None:
    """Stability and repeatability of 0.01 deg/h together, linearity 20 ppm; the rest is assumed."""
    population = GyroPopulation()
    assert {name: getattr(population, name) for name in ERRORS} == ERRORS
    assert population.bias_deg_per_h == pytest.approx(np.hypot(0.01, 0.01), rel=0.02)


def test_without_errors_the_truth_comes_out() -> None:
    true = np.random.default_rng(1).standard_normal(STILL.shape)
    assert np.array_equal(PERFECT.increments(TIME_S, START_S, true, Streams(3)), true)


def test_bias_is_constant_and_has_the_stated_sigma() -> None:
    """b dt on every sample; over triads and axes a normal distribution."""
    population = replace(PERFECT, bias_deg_per_h=0.014)
    rates = np.array([error(population, STILL, n) for n in range(TRIADS)]) / 0.5
    assert np.ptp(rates, axis=1).max() < EXACT * DEG_PER_H
    assert_sigma(rates[:, 0], 0.014 * DEG_PER_H)


def test_scale_factor_and_asymmetry() -> None:
    """s d and a |d|: the one changes sign with the rate, the other does not."""
    turn = np.full(STILL.shape, 0.02)
    for name, sign in (("scale_ppm", -1.0), ("asymmetry_ppm", 1.0)):
        population = replace(PERFECT, **{name: 20.0})
        found = np.array([error(population, turn, n)[0] for n in range(TRIADS)])
        assert_sigma(found / 0.02, 20.0 * PPM)
        assert error(population, -turn) == pytest.approx(sign * error(population, turn), rel=1e-6)


def test_random_walk_grows_with_the_square_root_of_time() -> None:
    """N sqrt(t): the sum over 500 s, and each sample by itself; three axes of each triad."""
    population = replace(PERFECT, angle_random_walk_deg_per_sqrt_h=0.001)
    found = np.array([error(population, STILL, n) for n in range(TRIADS)])
    density = 0.001 * DEG_PER_SQRT_H
    assert_sigma(found.sum(axis=1), density * np.sqrt(500.0))
    assert_sigma(found[:5], density * np.sqrt(0.5))


def test_random_walk_does_not_depend_on_the_sample_rate() -> None:
    """The angle after 500 s has the same variance at 2 Hz as at 20 Hz."""
    population = replace(PERFECT, angle_random_walk_deg_per_sqrt_h=0.001)
    fine_s = START_S + np.arange(1, 10001) * 0.05
    still = np.zeros((fine_s.size, 3))
    ends = [population.increments(fine_s, START_S, still, Streams(4).at(n)).sum(axis=0) for n in range(TRIADS)]
    assert_sigma(np.array(ends), 0.001 * DEG_PER_SQRT_H * np.sqrt(500.0))


def test_instability_wanders_slowly_with_the_stated_sigma() -> None:
    """A Gauss-Markov rate: sigma at any instant, correlation exp(-dt / 1800 s) over the 490 s."""
    population = replace(PERFECT, instability_deg_per_h=0.003)
    rates = np.array([error(population, STILL, n) for n in range(TRIADS)]) / 0.5 / DEG_PER_H
    assert_sigma(rates[:, 0], 0.003)
    first, last = rates[:, 0].ravel(), rates[:, 980].ravel()
    expected = np.exp(-490.0 / 1800.0)
    assert np.corrcoef(first, last)[0, 1] == pytest.approx(expected, abs=4.0 * (1.0 - expected**2) / np.sqrt(600.0))


@pytest.mark.parametrize("name", ERRORS)
def test_switching_an_error_off_moves_no_other_draw(name: str) -> None:
    """The error of all together is the error without one, plus that one alone."""
    true = np.full(STILL.shape, 0.01)
    population = GyroPopulation()
    rest = replace(population, **{name: 0.0})
    alone = replace(PERFECT, **{name: ERRORS[name]})
    both = error(rest, true) + error(alone, true)
    assert np.any(error(alone, true))
    assert error(population, true) == pytest.approx(both, abs=1e-16)


def test_the_same_streams_give_the_same_bytes() -> None:
    population = GyroPopulation()
    runs = [population.increments(TIME_S, START_S, STILL, Streams(3).at(n)).tobytes() for n in (1, 1, 2)]
    assert runs[0] == runs[1] != runs[2]


def test_thermal_drift_follows_the_temperature_and_has_the_stated_sigma() -> None:
    """c (T - 22 degC) dt on every sample, one c for each gyro and run."""
    population = replace(PERFECT, thermal_deg_per_h_per_c=4e-4)
    temperature_c = np.linspace(30.0, -10.0, TIME_S.size)
    runs = [population.increments(TIME_S, START_S, STILL, Streams(3).at(n), temperature_c) for n in range(TRIADS)]
    per_c = np.array([run[0] / (0.5 * (30.0 - 22.0)) for run in runs])
    assert_sigma(per_c, 4e-4 * DEG_PER_H)
    for run, coefficients in zip(runs, per_c, strict=True):
        np.testing.assert_allclose(run, 0.5 * np.outer(temperature_c - 22.0, coefficients), rtol=1e-9, atol=1e-22)
