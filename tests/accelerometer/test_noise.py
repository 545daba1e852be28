"""White noise: its mean over an interval, and the random walk of velocity that it makes."""

from __future__ import annotations

import numpy as np
import pytest

from ins_eval.accelerometer import Population

SAMPLES = 20000


@pytest.mark.parametrize(("interval_s", "sigma_ug"), [(1.0, 2.0), (0.01, 20.0), (60.0, 2.0 / np.sqrt(60.0))])
def test_mean_over_an_interval(population: Population, rng, interval_s: float, sigma_ug: float) -> None:
    noise_ug = population["noise"].noise_ug(np.full(SAMPLES, interval_s), rng)
    assert np.std(noise_ug) == pytest.approx(sigma_ug, rel=0.03)
    assert abs(np.corrcoef(noise_ug[1:], noise_ug[:-1])[0, 1]) < 4 / np.sqrt(SAMPLES)


def test_velocity_walks_alike_at_any_rate(population: Population, rng: np.random.Generator) -> None:
    # after 100 s: 2 ug/sqrt(Hz) sqrt(100 s)
    for rate_hz in (1, 20):
        interval_s = np.full((2000, 100 * rate_hz), 1.0 / rate_hz)
        noise_ug = population["noise"].noise_ug(interval_s.ravel(), rng).reshape(interval_s.shape)
        assert np.std((noise_ug * interval_s).sum(axis=1)) == pytest.approx(2.0 * np.sqrt(100.0), rel=0.07)
