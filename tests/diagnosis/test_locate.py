"""The largest of many ratios has the probability that it is given; an interval is found where it is."""

from __future__ import annotations

import numpy as np
import pytest

from ins_eval.diagnosis.unnamed import locate
from ins_eval.diagnosis.unnamed.locate import Channel
from ins_eval.estimation.evidence import Reduced

WINDOWS, CHANNELS = 24, 3
DRAWS = 400


@pytest.fixture
def normal() -> np.ndarray:
    """A of windows that are correlated within a channel and between channels."""
    rng = np.random.default_rng(1)
    rows = np.cumsum(rng.standard_normal((400, WINDOWS * CHANNELS)), axis=0) / 20.0 + rng.standard_normal((400, 72))
    return rows.T @ rows


@pytest.fixture
def over() -> list[Channel]:
    return [Channel(f"accelerometer.{axis}", axis, 1.0) for axis in "xyz"]


def test_probabilities_hold_under_the_null(normal, over) -> None:
    edges_s = np.arange(WINDOWS + 1.0)
    law = locate.significance(Reduced(normal, np.zeros(72)), WINDOWS, np.random.default_rng(0))
    root = np.linalg.cholesky(normal)
    rng = np.random.default_rng(99)
    largest = [locate.scan(Reduced(normal, root @ rng.standard_normal(72)), over, edges_s)[0].t2 for _ in range(DRAWS)]
    probabilities = np.array([law.probability(t2) for t2 in largest])
    for level in (0.05, 0.2):
        expected, sigma = level * DRAWS, np.sqrt(level * (1.0 - level) * DRAWS)
        assert abs(np.count_nonzero(probabilities < level) - expected) < 4.0 * sigma


def test_ends_that_are_looked_for_more_finely_are_counted(over) -> None:
    """Of white noise the best ends near the best interval seem sure too often with the trials of the windows alone."""
    fine = locate.FINER
    law = locate.significance(Reduced(fine * np.eye(WINDOWS), np.zeros(WINDOWS)), WINDOWS, np.random.default_rng(0))
    rng = np.random.default_rng(98)
    found = []
    for _ in range(DRAWS):
        noise = rng.standard_normal(fine * WINDOWS)
        rough = Reduced(fine * np.eye(WINDOWS), noise.reshape(WINDOWS, fine).sum(axis=1))
        best = locate.scan(rough, over[:1], fine * np.arange(WINDOWS + 1.0))[0]
        near = slice(max(0, int(best.begin_s) - fine), int(best.end_s) + fine)
        exact = Reduced(np.eye(noise[near].size), noise[near])
        found.append(locate.scan(exact, over[:1], np.arange(noise[near].size + 1.0))[0].t2)
    level, sigma = 0.05, np.sqrt(0.05 * 0.95 / DRAWS)
    assert np.mean([law.probability(t2) < level for t2 in found]) > level + 4.0 * sigma
    assert np.mean([law.finer.probability(t2) < level for t2 in found]) < level + 4.0 * sigma


def test_a_disturbance_is_found_where_it_is(normal, over) -> None:
    size = np.zeros(72)
    size[WINDOWS + 5 : WINDOWS + 11] = 4.0
    edges_s = 100.0 * np.arange(WINDOWS + 1.0)
    best = locate.scan(Reduced(normal, normal @ size), over, edges_s)[0]
    assert (best.channel.name, best.begin_s, best.end_s) == ("accelerometer.y", 500.0, 1100.0)
    assert best.size == pytest.approx(4.0)


def test_sigma_goes_on_where_the_probability_underflows() -> None:
    law = locate.Significance(1000.0)
    values = [law.sigma(t2) for t2 in (1.0, 30.0, 55.0, 75.0, 1e3, 1e6)]
    assert values[0] == 0.0
    assert values == sorted(values)
    assert np.isfinite(values).all()
