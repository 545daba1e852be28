"""Where a receiver jumps: fixes made by hand of an INS that drifts, an antenna that sways and a receiver that jumps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ins_eval.diagnosis.answer.judge import judge
from ins_eval.error_model.observations import CHANNELS, Observations
from ins_eval.error_model.propagation import STATES
from ins_eval.estimation.case import prepare
from ins_eval.estimation.receiver_jumps import jumps

ROWS, SPEED_MPS, HEADING = 1800, 200.0, 0.5
POSITION_M, VELOCITY_MPS, STATED_M = 2.0, 0.05, 4.0  # what is stated is twice what is there
TIME_S = np.arange(float(ROWS))
AT, LATER = 600, 1200
ALONG = np.array([np.cos(HEADING), np.sin(HEADING), 0.0])
ACROSS = np.array([-np.sin(HEADING), np.cos(HEADING), 0.0])
BESIDE = 3  # fixes, within which an instant is known
SIZE_M, OF_SIZE = 6.0, 0.3  # of seven sigmas of its estimate, and of three axes with noise in each
FIX_M, FIX_MPS, CLOCK_S, RADIUS_M = 1.0, 0.02, 0.025, 6.37e6


@pytest.fixture(scope="module")
def seen() -> Observations:
    """Fixes once a second; kilometres of drift and metres of sway are in position and velocity alike."""
    rng = np.random.default_rng(5)
    t = TIME_S
    sigma = np.repeat([STATED_M, VELOCITY_MPS, np.nan], 3) * np.ones((ROWS, 1))
    residual = np.repeat([POSITION_M, VELOCITY_MPS, np.nan], 3) * rng.standard_normal((ROWS, CHANNELS))
    rates = [(0.8 * np.cos(t / 800.0), 640.0 * np.sin(t / 800.0)), (0.3 * np.cos(t / 5.0), 1.5 * np.sin(t / 5.0))]
    for axis, (velocity, position) in enumerate(rates):
        residual[:, axis] += position
        residual[:, 3 + axis] += velocity
    of_delay = np.zeros((ROWS, CHANNELS))
    of_delay[:, :3] = SPEED_MPS * ALONG
    return Observations(
        (),
        residual=residual,
        sigma=sigma,
        design=np.zeros((ROWS, CHANNELS, STATES)),
        of_arm=np.zeros((ROWS, 3, CHANNELS)),
        of_delay=of_delay,
        arc=np.zeros(ROWS, dtype=int),
        measured_by=("gps",) * 6 + ("",) * 3,
    )


def jumped(seen: Observations, *sizes: tuple[int, np.ndarray]) -> Observations:
    residual = seen.residual.copy()
    for at, size_m in sizes:
        residual[at:, :3] -= size_m
    return replace(seen, residual=residual)


def found(seen: Observations) -> tuple[list[int], np.ndarray]:
    """The fixes before which it jumps, and the variance of the first."""
    variance = jumps(seen, TIME_S)
    at = np.flatnonzero(variance.any(axis=1)) + 1
    return list(at), variance[at[0] - 1]


def test_a_receiver_that_never_jumps_has_none(seen) -> None:
    assert not jumps(seen, TIME_S).any()


def test_a_jump_across_the_way_is_found_with_its_size(seen) -> None:
    (at,), variance = found(jumped(seen, (AT, SIZE_M * ACROSS)))
    assert abs(at - AT) <= BESIDE
    assert np.sqrt(variance.sum()) == pytest.approx(SIZE_M, rel=OF_SIZE)


def test_a_jump_is_no_farther_than_what_is_stated(seen) -> None:
    _, variance = found(jumped(seen, (AT, 20.0 * STATED_M * ACROSS)))
    np.testing.assert_allclose(variance, STATED_M**2)


def test_a_clock_that_is_set_anew_is_no_jump_but_where_others_are(seen) -> None:
    clock = (LATER, SIZE_M * ALONG)
    assert not jumps(jumped(seen, clock), TIME_S).any()
    at, _ = found(jumped(seen, (AT, SIZE_M * ACROSS), clock))
    np.testing.assert_allclose(at, (AT, LATER), atol=BESIDE)


def test_what_lies_in_a_hole_is_not_known(seen) -> None:
    after = jumped(seen, (AT, SIZE_M * ACROSS))
    after.residual[AT - 60 : AT + 60] = np.nan
    assert not jumps(after, TIME_S).any()


@pytest.mark.slow
@pytest.mark.parametrize("of", ["clock", "receiver"])
def test_a_receiver_that_jumps_anywhere_has_no_clock_that_is_set_anew(flight, of: str) -> None:
    """One of its jumps happens to be along the way, as far as a clock moves a fix that is set anew."""
    fixes, rng = flight.gps, np.random.default_rng(2)
    count, velocity = fixes.time_s.size, fixes.velocity_n
    error, error_mps = FIX_M * rng.standard_normal((count, 3)), FIX_MPS * rng.standard_normal((count, 3))
    at = int(0.6 * count)
    if of == "clock":
        error[at:] += CLOCK_S * velocity[at:]
        error_mps[at:] += CLOCK_S * np.gradient(velocity, fixes.time_s, axis=0)[at:]
    else:
        error[at:] += CLOCK_S * velocity[at]
        for k in (np.array([0.3, 0.45, 0.8]) * count).astype(int):
            error[k:] += CLOCK_S * np.cross(velocity[k], [0.0, 0.0, 1.0])
    received = replace(
        fixes,
        latitude_rad=fixes.latitude_rad + error[:, 0] / RADIUS_M,
        longitude_rad=fixes.longitude_rad + error[:, 1] / RADIUS_M / np.cos(fixes.latitude_rad),
        height_m=fixes.height_m - error[:, 2],
        velocity_n=velocity + error_mps,
    )
    names = [one.hypothesis.candidate.name for one in judge([prepare(replace(flight, gps=received))]).effects]
    assert names == (["recording.clock_step"] if of == "clock" else [])
