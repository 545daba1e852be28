"""What is measured against a solution: gaps, a source that tells nothing, a standstill, what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ins_eval.diagnosis.estimate import noise
from ins_eval.diagnosis.model import error_model, null, observations
from ins_eval.recording import Fixes, Recording

SWAY_MPS = 0.003
LEVEL = 0.15  # relative, of a level from some thousand measurements


def seen_of(recording: Recording) -> observations.Observations:
    believed = null.believe(recording)
    (solution,) = null.solve(believed)
    measured = observations.sources(believed, solution.time_s[-1])
    model = error_model.build(believed, (solution,), observations.nodes(believed, measured, solution.time_s[-1]))
    return observations.observe(believed, model.states, model.arc, measured)


def test_missing_values_are_gaps_and_nothing_else(flight) -> None:
    fixes = flight.gps
    velocity, height, valid = fixes.velocity_n.copy(), fixes.height_m.copy(), fixes.valid.copy()
    velocity[100:200, 1], height[150:300], valid[400:450] = np.nan, np.nan, False
    whole = seen_of(flight).residual
    gaps = seen_of(replace(flight, gps=replace(fixes, velocity_n=velocity, height_m=height, valid=valid))).residual
    missing = np.isnan(gaps) & ~np.isnan(whole)
    assert missing.sum(axis=0).tolist() == [50, 50, 200, 50, 150, 50, 0, 0, 0]
    np.testing.assert_allclose(gaps[~np.isnan(gaps)], whole[~np.isnan(gaps)], atol=1e-6)


def test_a_reference_that_tells_nothing_is_no_source(flight) -> None:
    nothing = np.full(50, np.nan)
    empty = Fixes(np.arange(50.0) + 10.0, nothing, nothing, nothing, np.full((50, 3), np.nan), np.ones(50, dtype=bool))
    believed = null.believe(replace(flight, reference=empty))
    found = observations.sources(believed, believed.time_s[-1])
    assert [source.name for source in found] == ["gps"]


def test_the_white_noise_of_a_standstill_is_read_off_where_it_is_disturbed(ideal_recording) -> None:
    seen = seen_of(ideal_recording("oven"))
    rng = np.random.default_rng(5)
    residual = seen.residual.copy()
    disturbed = slice(1000, 1200)
    residual[:, 3] += SWAY_MPS * rng.standard_normal(residual.shape[0])
    residual[:, 4] += 1e-4 * rng.standard_normal(residual.shape[0])
    residual[disturbed, 4] += 0.02 * rng.standard_normal(200)
    level, _ = noise.white(replace(seen, residual=residual))
    assert np.median(level[1:, 3]) == pytest.approx(SWAY_MPS, rel=LEVEL)
    assert np.median(level[1:900, 4]) == pytest.approx(1e-4, rel=LEVEL)
    assert np.median(level[disturbed, 4]) == pytest.approx(0.02, rel=2.0 * LEVEL)


def test_white_noise_is_told_apart_from_a_random_walk() -> None:
    rng = np.random.default_rng(6)
    count = 20_000
    walk = np.cumsum(rng.standard_normal(count))
    assert noise._level_less_walk(np.diff(0.5 * rng.standard_normal(count) + walk, 2)) == pytest.approx(0.5, rel=LEVEL)
    assert noise._level_less_walk(np.diff(rng.standard_normal(count), 2)) == pytest.approx(1.0, rel=LEVEL)
    assert noise._level_less_walk(np.diff(walk, 2)) < 0.3
