"""Gauss-Markov processes: autocovariance, start, any spacing."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2, norm

from ins_eval.random_processes import gauss_markov

CHANCE = 1e-3  # of a bound, each side; seeds are fixed
RUNS = 4000


def ensemble(time_s: np.ndarray, sigma: float, time_constant_s: float, start: float | None = None) -> np.ndarray:
    """(RUNS, n) independent processes."""
    rng = np.random.default_rng(20)
    return np.array([gauss_markov(time_s, sigma, time_constant_s, rng, start) for _ in range(RUNS)])


def test_autocovariance() -> None:
    """sigma^2 exp(-|dt| / tau) between all pairs of irregular epochs; sampling error sigma^2 sqrt((1 + r^2) / RUNS)."""
    time_s = np.array([0.0, 1.0, 5.0, 12.0, 40.0, 41.0, 100.0])
    sigma, tau = 2.5, 30.0
    found = np.cov(ensemble(time_s, sigma, tau), rowvar=False)
    correlation = np.exp(-np.abs(np.subtract.outer(time_s, time_s)) / tau)
    bound = norm.ppf(1.0 - CHANCE / time_s.size**2) * sigma**2 * np.sqrt((1.0 + correlation**2) / RUNS)
    assert np.all(np.abs(found - sigma**2 * correlation) < bound)


def test_it_is_stationary_from_the_first_sample() -> None:
    """Same variance at every epoch, within a chi-square bound."""
    values = ensemble(np.arange(0.0, 50.0, 10.0), 1.5, 20.0)
    low, high = chi2.ppf([CHANCE, 1.0 - CHANCE], RUNS)
    squares = np.sum((values / 1.5) ** 2, axis=0)
    assert np.all((squares > low) & (squares < high))


def test_from_a_given_start() -> None:
    """Mean start exp(-t / tau), variance sigma^2 (1 - exp(-2 t / tau))."""
    time_s, sigma, tau = np.array([0.0, 10.0, 40.0]), 2.0, 20.0
    values = ensemble(time_s, sigma, tau, start=5.0)
    assert np.all(values[:, 0] == 5.0)
    variance = sigma**2 * (1.0 - np.exp(-2.0 * time_s[1:] / tau))
    mean = 5.0 * np.exp(-time_s[1:] / tau)
    assert np.all(np.abs(values[:, 1:].mean(axis=0) - mean) < norm.ppf(1.0 - CHANCE) * np.sqrt(variance / RUNS))
    low, high = chi2.ppf([CHANCE, 1.0 - CHANCE], RUNS)
    squares = np.sum((values[:, 1:] - mean) ** 2 / variance, axis=0)
    assert np.all((squares > low) & (squares < high))


def test_steps_are_white() -> None:
    """What is left of x_k after exp(-dt / tau) x_k-1 has no memory and the variance sigma^2 (1 - exp(-2 dt / tau))."""
    sigma, tau, dt = 3.0, 100.0, 5.0
    x = gauss_markov(np.arange(20000) * dt, sigma, tau, np.random.default_rng(21))
    decay = np.exp(-dt / tau)
    driven = x[1:] - decay * x[:-1]
    low, high = chi2.ppf([CHANCE, 1.0 - CHANCE], driven.size)
    assert low < np.sum(driven**2) / (sigma**2 * (1.0 - decay**2)) < high
    lag = np.mean(driven[1:] * driven[:-1]) / np.var(driven)
    assert abs(lag) < norm.ppf(1.0 - CHANCE) / np.sqrt(driven.size)


def test_zero_sigma_is_zero() -> None:
    assert not np.any(gauss_markov(np.arange(5.0), 0.0, 10.0, np.random.default_rng(1)))


def test_the_same_draws_whether_it_starts_somewhere_or_not() -> None:
    """Giving a start consumes as many draws, so what follows in the stream stays."""
    streams = [np.random.default_rng(9), np.random.default_rng(9)]
    gauss_markov(np.arange(10.0), 1.0, 5.0, streams[0])
    gauss_markov(np.arange(10.0), 1.0, 5.0, streams[1], start=0.0)
    assert streams[0].standard_normal() == pytest.approx(streams[1].standard_normal())
