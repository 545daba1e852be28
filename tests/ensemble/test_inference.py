"""Sizes of ensembles and places of flights in them, against draws and closed forms."""

from __future__ import annotations

from math import log, sqrt

import numpy as np
import pytest
from scipy import stats

from ins_eval.ensemble.inference import exceedance, power_size
from ins_eval.errors import UsageError

EXACT = 1e-12


def test_power_size_has_the_promised_power():
    """Ensembles of that size, drawn anew, pass with the promised probability."""
    log_ratio, sd, n = log(0.9), 0.027, 200
    size = power_size(log_ratio, sd, n)
    sd_at_size = sd * sqrt(n / size)
    bound = np.random.default_rng(13).normal(log_ratio, sd_at_size, 400_000) + 1.959964 * sd_at_size
    assert np.mean(bound < 0.0) == pytest.approx(0.995, abs=0.002)
    # one instrument fewer would not do
    assert stats.norm.cdf(-log_ratio / (sd * sqrt(n / (size - 1))) - 1.959964) < 0.995


def test_power_size_of_half_a_chance_is_the_resolved_change():
    """With power 0.5 the gain is just 1.96 standard deviations: 2.7 % at 200 resolves 5.3 %."""
    assert power_size(-1.959964 * 0.027, 0.027, 200, power=0.5) in (200, 201)


@pytest.mark.parametrize("log_ratio", [0.0, 0.1, float("nan")])
def test_no_size_resolves_what_is_no_gain(log_ratio):
    with pytest.raises(UsageError, match="expected below 0"):
        power_size(log_ratio, 0.03, 200)


def test_exceedance_has_the_clopper_pearson_interval():
    distribution = np.arange(100) / 100.0
    fraction, low, high = exceedance(0.825, distribution)
    assert fraction == pytest.approx(0.17, rel=EXACT)
    assert low == pytest.approx(stats.beta.ppf(0.025, 17, 84), rel=1e-6)
    assert high == pytest.approx(stats.beta.ppf(0.975, 18, 83), rel=1e-6)


def test_exceedance_beyond_the_distribution_still_has_an_interval():
    fraction, low, high = exceedance(9.0, np.zeros(100))
    assert (fraction, low) == (0.0, 0.0)
    assert high == pytest.approx(1.0 - 0.025 ** (1 / 100), rel=1e-6)
