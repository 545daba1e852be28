"""What is measured against a solution: gaps, a source that tells nothing, a standstill, what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ins_eval.error_model import drives, null, observations, propagation
from ins_eval.estimation import case as cases
from ins_eval.estimation import noise
from ins_eval.estimation.study import fit_noise
from ins_eval.recording import Fixes, Recording
from ins_eval.units import UG

SWAY_MPS = 0.003
FAR_MPS = 1.0  # within a flight of hours whose heading is off by a degree
EDGE_S, STEADY_UG, BIAS_UG = 3.0, 1e-3, 3.0
LEVEL = 0.15  # relative, of a level from some thousand measurements


def seen_of(recording: Recording) -> observations.Observations:
    believed = null.believe(recording)
    (solution,) = null.solve(believed)
    measured = observations.sources(believed, solution.time_s[-1])
    model = propagation.build(believed, (solution,), observations.nodes(believed, measured, solution.time_s[-1]))
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


def test_a_late_clock_moves_positions_as_fast_as_the_vehicle_and_not_as_the_solution_drifts(flight) -> None:
    """A heading off by a degree turns the velocity of the solution, which no receiver follows."""
    attitude = flight.start.attitude_rad + np.array([0.0, 0.0, np.radians(1.0)])
    drifting = replace(flight, start=replace(flight.start, attitude_rad=attitude))
    seen = seen_of(drifting)
    known = np.isfinite(seen.residual[:, observations.POSITION]).all(axis=1)
    moved = seen.of_delay[known][:, observations.POSITION]
    np.testing.assert_array_equal(moved, flight.gps.velocity_n[: len(moved)])
    assert np.abs(moved[:, 1] - seen.residual[known, 4]).max() > FAR_MPS  # the solution itself is as far off
    blind = replace(drifting, gps=replace(flight.gps, velocity_n=np.full_like(flight.gps.velocity_n, np.nan)))
    by_solution = seen_of(blind).of_delay[known][:, observations.POSITION]
    off = by_solution - flight.gps.velocity_n[: len(moved)]
    np.testing.assert_allclose(off, seen.residual[known][:, observations.VELOCITY], atol=1e-9)


def test_a_standstill_has_no_stamps(ideal_recording) -> None:
    assert not seen_of(ideal_recording("oven")).of_delay.any()


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
    count = residual.shape[0]
    disturbed = slice(count // 2, count // 2 + 100)
    residual[:, 3] += SWAY_MPS * rng.standard_normal(count)
    residual[:, 4] += 1e-4 * rng.standard_normal(count)
    residual[disturbed, 4] += 0.02 * rng.standard_normal(100)
    level, _ = noise.white(replace(seen, residual=residual))
    assert np.median(level[1:, 3]) == pytest.approx(SWAY_MPS, rel=2.0 * LEVEL)  # a difference of two variances
    assert np.median(level[1 : count // 2 - 10, 4]) == pytest.approx(1e-4, rel=2.0 * LEVEL)
    assert np.median(level[disturbed, 4]) == pytest.approx(0.02, rel=2.0 * LEVEL)


def test_drives_of_a_stand_hold_no_noise_and_every_second_of_it_tells_no_more(recording_at_rest, monkeypatch) -> None:
    """At rest the specific force is constant; what single samples add to it is in the residual and is no drive."""
    recording = recording_at_rest(3600.0, seed=1, error_ug=lambda time_s: 100.0 + 0.0 * time_s)
    case = cases.prepare(recording)
    inside = (case.model.middle_s > EDGE_S) & (case.model.middle_s < 3600.0 - EDGE_S)
    for axis, felt in enumerate((0.0, 0.0, -9.8)):
        drive = [case.model.integrals[inside, drives.source("accelerometer", axis, of)] for of in ("f", "1")]
        force = drives.strength(*drive)
        assert np.ptp(force) < STEADY_UG * UG
        assert force.mean() == pytest.approx(felt, abs=0.05)
    assert case.model.interval_s == pytest.approx(observations.STANDING_EPOCH_S)
    assert not any(one.name.startswith(("gps.", "recording.clock")) for one in case.candidates)  # no receiver is asked
    monkeypatch.setattr(observations, "STANDING_EPOCH_S", 1.0)
    finer = cases.prepare(recording)
    assert finer.model.interval_s == pytest.approx(1.0)
    for one in (case, finer):
        (fitted,) = fit_noise([one], [], [None])
        (bias,) = (k for k in one.candidates if (k.name, k.axis) == ("accelerometer.bias", "z"))
        whitened = one.whitened([bias.column], fitted.noise_point)
        mean = np.linalg.solve(np.eye(whitened.normal.shape[0]) + whitened.normal, whitened.projection)
        turn_on = next(k for k, c in enumerate(one.nuisances) if c.name == "turn-on bias of accelerometer z")
        prior_ug = recording.belief.accelerometer.bias_sigma_ug
        found = mean[-1] * bias.nominal + mean[turn_on] * prior_ug
        assert found == pytest.approx(100.0, abs=BIAS_UG)


def test_white_noise_is_told_apart_from_a_random_walk() -> None:
    rng = np.random.default_rng(6)
    count = 20_000
    walk = np.cumsum(rng.standard_normal(count))
    assert noise._level_less_walk(np.diff(0.5 * rng.standard_normal(count) + walk, 2)) == pytest.approx(0.5, rel=LEVEL)
    assert noise._level_less_walk(np.diff(rng.standard_normal(count), 2)) == pytest.approx(1.0, rel=LEVEL)
    assert noise._level_less_walk(np.diff(walk, 2)) < 0.3
