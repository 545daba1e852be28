"""What a scale-factor error does in flight: closed forms of run-up, turn and climb, and instruments really flown."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ins_eval.ensemble import Plan, World, fly
from ins_eval.ensemble.changes import Change
from ins_eval.ensemble.response import Response, response
from ins_eval.imu import Mission
from ins_eval.profile import load

X, Y, Z = range(3)
CLOSED_FORM = 0.01  # relative: Earth rate and the curvature of the path are left out of the closed forms
SHORT = 0.05  # relative: what gravity answers through the platform within two minutes
LINEAR = 0.01
SAME_MPS = 1e-9
PULSES_M = 0.1  # position that counts rounded elsewhere may make of a few minutes
CLIMB = """
[[height]]
from_s = 70.0
to_s = 130.0
to_m = 700.0
edge_s = 10.0
"""


@pytest.fixture
def plan(profile: Path) -> Plan:
    return Plan(profile=str(profile), arms=("simple",))


@pytest.fixture
def mission(profile: Path) -> Mission:
    return Mission(load(str(profile)), 10.0)


def fed_in(found: Response, axis: int, begin_s: float, end_s: float) -> np.ndarray:
    """North and east velocity in m/s that 100 ppm put in between two times."""
    first, last = np.searchsorted(found.time_s, (begin_s, end_s))
    return 100.0 * (found.fed_in[axis, last] - found.fed_in[axis, first])[:2]


def test_take_off_is_felt_along_x(mission: Mission) -> None:
    """100 ppm of 100 m/s on the course of 60 degrees."""
    found = response(mission, "given")
    expected = 1e-4 * 100.0 * np.array([np.cos(np.pi / 3), np.sin(np.pi / 3)])
    assert fed_in(found, X, 0.0, 60.0) == pytest.approx(expected, rel=CLOSED_FORM)
    assert 100.0 * found.velocity[X, 60, :2] == pytest.approx(expected, rel=SHORT)
    for axis in (Y, Z):
        assert np.abs(fed_in(found, axis, 0.0, 60.0)).max() < 1e-4


def test_coordinated_turn_is_felt_along_z(mission: Mission) -> None:
    """tan(roll) = V psi' / g: scaling g / cos(roll) adds 100 ppm of the change of velocity, and y feels nothing."""
    found = response(mission, "given")
    begin_s, end_s = mission.trajectory.turns_s[0]
    course = np.pi / 3 + np.array([0.0, np.pi / 3])
    change = 1e-4 * 100.0 * (np.array([np.cos(course[1]), np.sin(course[1])]) - [np.cos(course[0]), np.sin(course[0])])
    assert fed_in(found, Z, begin_s, end_s + 1.0) == pytest.approx(change, rel=CLOSED_FORM, abs=1e-4)
    assert np.abs(fed_in(found, Y, begin_s, end_s + 1.0)).max() < 1e-3


def test_climb_is_felt_along_x_and_z_with_opposite_signs(profile: Path) -> None:
    """Gravity through the pitch, tan(pitch) = h' / V: 100 ppm of g times integral of sin cos, about 300 m / 100 m/s."""
    profile.write_text(profile.read_text() + CLIMB)
    mission = Mission(load(str(profile)), 10.0)
    found = response(mission, "given")
    time_s = np.linspace(70.0, 130.0, 6001)
    pitch = mission.trajectory.truth(time_s).attitude_rad[:, 1]
    expected = 1e-4 * 9.797 * np.trapezoid(np.sin(pitch) * np.cos(pitch), time_s)
    assert expected == pytest.approx(1e-4 * 9.797 * 3.0, rel=0.02)
    course = np.array([np.cos(np.pi / 3), np.sin(np.pi / 3)])
    assert fed_in(found, X, 70.0, 130.0) == pytest.approx(expected * course, rel=CLOSED_FORM)
    assert fed_in(found, Z, 70.0, 130.0) == pytest.approx(-expected * course, rel=CLOSED_FORM)


def test_alignment_on_a_level_stand_neither_hides_nor_adds_it(profile: Path) -> None:
    """Horizontal accelerometers feel nothing there; z makes the height swing in, which a long stand forgets."""
    profile.write_text(profile.read_text().replace("stand_s = 120.0", "stand_s = 900.0"))
    mission = Mission(load(str(profile)), 10.0)
    found, given = (response(mission, alignment) for alignment in ("found", "given"))
    apart_mps = 100.0 * np.abs(found.velocity - given.velocity)[..., :2].max(axis=(1, 2))
    assert np.all(apart_mps[[X, Y]] < SAME_MPS)
    assert apart_mps[Z] < 1e-4 < 5e-3 < 100.0 * np.abs(given.velocity[X]).max()


def test_level_flight_at_constant_speed_feeds_in_nothing(mission: Mission) -> None:
    found = response(mission, "given")
    for axis in (X, Y, Z):
        assert np.abs(fed_in(found, axis, 65.0, 145.0)).max() < 1e-4


def test_an_instrument_that_drifts_is_moved_as_the_response_says(plan: Plan) -> None:
    """Fresh and stored, flown in full with every other error: the difference is linear and nothing but the drift.

    The attitude is given: after a stand of two minutes a heading found is wrong by degrees, and turns the difference.
    """
    known: Change = ("alignment", "given")
    drift: Change = ("loop_gain.scale_ppm", (-1500.0, 400.0, 900.0, 2100.0))
    worlds = [World(replace(plan, changes=changes)) for changes in ((known,), (known, drift))]
    found = response(worlds[0].flight, "given")
    for index in range(3):
        fresh, stored = (fly(world, index)["simple"] for world in worlds)
        ppm = [unit.units["loop_gain"] for unit in worlds[1].instrument(index).accelerometers]
        at = np.searchsorted(found.time_s, fresh["track_s"])
        expected = np.tensordot(ppm, found.position, axes=1)[at, :2]
        moved = stored["track_m"] - fresh["track_m"]
        assert moved == pytest.approx(expected, abs=LINEAR * np.abs(expected).max() + PULSES_M)
        assert np.abs(expected).max() > 10.0 * PULSES_M
