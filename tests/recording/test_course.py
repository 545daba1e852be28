"""Velocities that are turned against the way of their positions, or older: told, named, mended; else silent."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmark.worlds.grades import a_recording
from benchmark.worlds.record import Made
from ins_eval.estimation.case import with_effects
from ins_eval.estimation.description import wrong_descriptions
from ins_eval.recording import Fixes, form
from ins_eval.recording.consistency.alternatives import BEYOND_DOUBT
from ins_eval.recording.consistency.course import check_course
from ins_eval.recording.mending import mended, turned
from tests.recording.test_consistency import LATITUDE, LONGITUDE, RADIUS_M, circle

TURN_DEG, LATE_S = 12.0, 0.4
SIGMAS = 4.0


def winding(turn_deg: float = 0.0, late_s: float = 0.0) -> Fixes:
    """A level way that winds, driven faster and slower; its velocities are turned to the right, and late."""
    rng, t = np.random.default_rng(3), np.arange(0.0, 240.0, 0.2)

    def velocity(t: np.ndarray) -> np.ndarray:
        speed, course = 9.0 + 4.0 * np.sin(t / 11.0), 1.5 * np.sin(t / 13.0) + t / 90.0
        return np.column_stack([speed * np.cos(course), speed * np.sin(course)])

    fine_s = np.arange(0.0, t[-1] + 0.01, 0.01)
    way = np.vstack([np.zeros(2), np.cumsum(0.01 * velocity(fine_s[:-1] + 0.005), axis=0)])
    north, east = (np.interp(t, fine_s, column) + 0.5 * rng.standard_normal(t.size) for column in way.T)
    angle = np.radians(turn_deg)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    shown = velocity(t - late_s) @ turn.T + 0.05 * rng.standard_normal((t.size, 2))
    place = LATITUDE + north / RADIUS_M, LONGITUDE + east / (RADIUS_M * np.cos(LATITUDE)), np.zeros(t.size)
    return Fixes(t, *place, np.column_stack([shown, np.zeros(t.size)]), np.ones(t.size, dtype=bool))


@pytest.mark.parametrize(("turn_deg", "side"), [(TURN_DEG, "left"), (-TURN_DEG, "right")])
def test_velocities_from_another_north_are_named(turn_deg, side):
    (found,) = check_course(winding(turn_deg), "gps", alone=True)
    angle, sigma = np.degrees(found.turned)
    assert abs(angle + turn_deg) < SIGMAS * sigma
    assert f"to the {side} of the velocities" in found.seen and found.decided
    (beside,) = check_course(winding(turn_deg), "gps", alone=False)
    assert beside.turned is None


@pytest.mark.parametrize(("late_s", "older"), [(LATE_S, "older"), (-LATE_S, "younger")])
def test_velocities_of_another_instant_are_warned_of_and_not_refused(late_s, older):
    (found,) = check_course(winding(late_s=late_s), "gps", alone=True)
    assert f"{older} than the positions" in found.seen and found.log_odds <= BEYOND_DOUBT
    words = found.seen.split()
    assert abs(float(words[4]) - abs(late_s)) < SIGMAS * float(words[6])


@pytest.mark.parametrize("speed_mps", [0.02, 1.0, 5.0])
def test_a_slow_error_of_velocities_on_a_straight_way_is_no_turn(speed_mps):
    rng, t = np.random.default_rng(8), np.arange(0.0, 240.0, 0.2)
    north, east = speed_mps * t + 0.3 * rng.standard_normal(t.size), 0.3 * rng.standard_normal(t.size)
    place = LATITUDE + north / RADIUS_M, LONGITUDE + east / (RADIUS_M * np.cos(LATITUDE)), np.zeros(t.size)
    shown = np.column_stack([np.full(t.size, speed_mps), np.full(t.size, 0.2), np.zeros(t.size)])
    fixes = Fixes(t, *place, shown + 0.05 * rng.standard_normal((t.size, 3)), np.ones(t.size, dtype=bool))
    assert [one for one in check_course(fixes, "gps", alone=True) if one.turned is not None] == []


def test_a_turn_is_mended_and_what_is_missing_stays_missing():
    """The velocity down of a receiver that has none."""
    fixes = winding(TURN_DEG)
    fixes.velocity_n[:, 2] = np.nan
    (found,) = check_course(fixes, "gps", alone=True)
    right = turned(fixes, found.turned[0])
    assert list(check_course(right, "gps", alone=True)) == []
    assert np.isnan(right.velocity_n[:, 2]).all()


def test_where_course_and_age_agree_or_look_alike_nothing_is_said():
    """On a circle at one speed a turn is a delay."""
    assert list(check_course(winding(), "gps", alone=True)) == []
    assert list(check_course(turned(circle(), np.radians(TURN_DEG)), "gps", alone=True)) == []


def test_velocities_from_magnetic_north_are_named_with_the_angle(tmp_path) -> None:
    one = a_recording(np.random.default_rng(5), "industrial", "drive", 20.0)
    gps = dict(one.tables["gps"])
    speed = (gps["velocity_n_mps"] + 1j * gps["velocity_e_mps"]) * np.exp(1j * np.radians(TURN_DEG))
    gps["velocity_n_mps"], gps["velocity_e_mps"] = speed.real, speed.imag
    Made(**{**vars(one), "tables": {**one.tables, "gps": gps}}).save(tmp_path / "drive")
    recording = form.read(tmp_path / "drive", doubted=True)
    ((found,), _) = wrong_descriptions(recording)
    assert (found.effect.name, found.effect.frame_found) == ("recording.reference_frame", "magnetic north")
    assert found.effect.value == pytest.approx(TURN_DEG, abs=SIGMAS * found.sigma)
    right = mended(replace(recording, belief=with_effects(recording.belief, [found.effect])))
    course = [np.arctan2(*fixes.velocity_n[:, 1::-1].T) for fixes in (recording.gps, right.gps)]
    turned = np.degrees(np.unwrap(course[0]) - np.unwrap(course[1])) % 360.0
    assert turned == pytest.approx(found.effect.value)
