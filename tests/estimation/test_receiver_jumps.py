"""Where a receiver jumps: fixes made by hand of an INS that drifts, an antenna that sways and a receiver that jumps."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from ins_eval.diagnosis.answer.judge import judge
from ins_eval.error_model.observations import CHANNELS, SMOOTHINGS, Observations
from ins_eval.error_model.propagation import STATES
from ins_eval.estimation.case import prepare
from ins_eval.estimation.receiver_jumps import _of_receiver, _sizes, jumps
from ins_eval.units import DEG, DEG_PER_H

ROWS, SPEED_MPS, HEADING = 1800, 200.0, 0.5
POSITION_M, VELOCITY_MPS, STATED_M = 2.0, 0.05, 4.0  # what is stated is twice what is there
AT, LATER = 600, 1200
BESIDE = 5  # fixes, within which the instant of a jump is known that is three times the noise of one
SIZE_M, OF_SIZE = 6.0, 0.3  # of seven sigmas of its estimate, and of three axes with noise in each
GYRO_DEG_PER_H, OFF_M, LEFT_M = 0.05, 3000.0, 0.1
FIX_M, FIX_MPS, CLOCK_S, RADIUS_M = 1.0, 0.02, 0.025, 6.37e6


@dataclass(frozen=True)
class Way:
    """A vehicle that turns evenly, with fixes of unlike noise north."""

    interval_s: float = 1.0
    turn_deg_per_s: float = 0.0
    north: float = 1.0

    @property
    def time_s(self) -> np.ndarray:
        return self.interval_s * np.arange(ROWS)

    @property
    def along(self) -> np.ndarray:
        heading = HEADING + self.turn_deg_per_s * DEG * self.time_s
        return np.column_stack([np.cos(heading), np.sin(heading), np.zeros(ROWS)])

    @property
    def across(self) -> np.ndarray:
        return np.cross([0.0, 0.0, 1.0], self.along)

    @property
    def white(self) -> np.ndarray:
        return np.array([self.north * POSITION_M, *[POSITION_M] * 2, *[VELOCITY_MPS] * 3, *[np.nan] * 3]) * np.ones(
            (ROWS, 1)
        )

    def fixes(self, seed: int = 5) -> Observations:
        """Kilometres of drift and metres of sway are in position and velocity alike."""
        t, residual = self.time_s, self.white * np.random.default_rng(seed).standard_normal((ROWS, CHANNELS))
        rates = [
            (0.8 * np.cos(t / 800.0), 640.0 * np.sin(t / 800.0)),
            (0.3 * np.cos(t / 90.0), 27.0 * np.sin(t / 90.0)),
        ]
        for axis, (velocity, position) in enumerate(rates):
            residual[:, axis] += position
            residual[:, 3 + axis] += velocity
        of_delay = np.zeros((ROWS, CHANNELS))
        of_delay[:, :3] = SPEED_MPS * self.along
        return Observations(
            (),
            residual=residual,
            sigma=np.repeat([STATED_M, VELOCITY_MPS, np.nan], 3) * np.ones((ROWS, 1)),
            design=np.zeros((ROWS, CHANNELS, STATES)),
            of_arm=np.zeros((ROWS, 3, CHANNELS)),
            of_delay=of_delay,
            of_smoothing=np.zeros((ROWS, 2 * SMOOTHINGS, CHANNELS)),
            arc=np.zeros(ROWS, dtype=int),
            measured_by=("gps",) * 6 + ("",) * 3,
        )

    def variance(self, seen: Observations) -> np.ndarray:
        still = {"known": np.zeros((ROWS - 1, 9)), "transition": np.tile(np.eye(9), (ROWS - 1, 1, 1))}
        model = SimpleNamespace(nodes_s=self.time_s, interval_s=np.diff(self.time_s), **still)
        return jumps(seen, self.white, model)

    def found(self, seen: Observations) -> list[int]:
        """The fixes before which it jumps."""
        return list(np.flatnonzero(self.variance(seen).any(axis=1)) + 1)


def jumped(seen: Observations, at: int, size_m: np.ndarray, size_mps: np.ndarray | float = 0.0) -> Observations:
    """From `at` on by `size_m`, of one place or (rows, 3)."""
    residual, after = seen.residual.copy(), np.arange(ROWS)[:, None] >= at
    residual[:, :3] -= np.where(after, size_m, 0.0)
    residual[:, 3:6] -= np.where(after, size_mps, 0.0)
    return replace(seen, residual=residual)


def set_anew(way: Way, seen: Observations, size_m: float) -> Observations:
    """A clock that moves fixes by so much along the way from `LATER` on."""
    of_velocity = size_m * np.gradient(way.along, way.time_s, axis=0)
    return jumped(seen, LATER, size_m * way.along, of_velocity)


@pytest.mark.parametrize(("interval_s", "size_m"), [(0.2, SIZE_M), (1.0, SIZE_M), (10.0, 5.0 * SIZE_M)])
def test_one_jump_is_found_where_it_is_and_nothing_without_one(interval_s: float, size_m: float) -> None:
    way = Way(interval_s)
    assert way.found(way.fixes()) == []
    (at,) = way.found(jumped(way.fixes(), AT, size_m * way.across[AT]))
    assert abs(at - AT) <= BESIDE


def test_a_jump_has_its_size_up_to_what_is_stated() -> None:
    way = Way()
    for size_m, of_all in ((SIZE_M, SIZE_M), (20.0 * STATED_M, np.sqrt(3.0) * STATED_M)):
        variance = way.variance(jumped(way.fixes(), AT, size_m * way.across[AT])).sum(axis=0)
        assert np.sqrt(variance.sum()) == pytest.approx(of_all, rel=OF_SIZE)


@pytest.mark.parametrize("turn_deg_per_s", [0.0, 3.0])
@pytest.mark.parametrize("north", [1.0, 2.0])
@pytest.mark.parametrize("size_m", [9.0, 25.0, 100.0])
def test_a_clock_that_is_set_anew_is_no_jump(turn_deg_per_s: float, north: float, size_m: float) -> None:
    way = Way(1.0, turn_deg_per_s, north)
    assert way.found(set_anew(way, way.fixes(), size_m)) == []


def test_along_the_way_is_a_jump_where_the_receiver_jumps_across_too() -> None:
    way = Way()
    clock = set_anew(way, way.fixes(), SIZE_M)
    assert way.found(clock) == []
    np.testing.assert_allclose(way.found(jumped(clock, AT, SIZE_M * way.across[AT])), (AT, LATER), atol=BESIDE)


def test_louder_fixes_are_no_jumps() -> None:
    way, seen = Way(), Way().fixes()
    seen.residual[AT:LATER, :3] += 4.0 * POSITION_M * np.random.default_rng(8).standard_normal((LATER - AT, 3))
    assert way.found(seen) == []


def test_what_lies_in_a_hole_is_not_known_but_single_fixes_may_be_lost() -> None:
    way = Way()
    after = jumped(way.fixes(), AT, SIZE_M * way.across[AT])
    lost = np.random.default_rng(9).random(ROWS) < 0.15
    lost[AT] = False
    after.residual[lost] = np.nan
    assert np.abs(np.array(way.found(after)) - AT).max() <= BESIDE
    after.residual[AT - 60 : AT + 60] = np.nan
    assert way.found(after) == []


def test_an_ins_that_is_kilometres_off_is_not_taken_for_a_receiver_that_jumps(flight) -> None:
    """Of exact fixes nothing is left, through turns and climbs with the height loop at work."""
    imu = flight.imu
    gyro = imu.gyro + GYRO_DEG_PER_H * DEG_PER_H * np.median(np.diff(imu.time_s))
    case = prepare(replace(flight, imu=replace(imu, gyro=gyro)))
    here = np.arange(case.model.nodes_s.size)
    size = _sizes(_of_receiver(case.seen, case.model, here), 30)
    assert np.abs(case.seen.residual[:, :2]).max() > OFF_M
    assert np.abs(size).max() < LEFT_M
    assert not case.noise.jumps.any()


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
