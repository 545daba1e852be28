"""What a reference implies is what an ideal IMU feels, by the closed forms of the trajectory."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ins_eval.earth import EARTH_RATE, gravity
from ins_eval.errors import DataRefused
from ins_eval.implied import epoch_spacing_s, implied_increments
from ins_eval.profile import HeightChange, Place, Profile, SpeedChange, Thermal, Turn
from ins_eval.recording import Fixes
from ins_eval.recording.belief import EarthBelief
from ins_eval.trajectory import Trajectory
from ins_eval.units import DEG

RATE_HZ = 100.0
# Per sample, so the smallest motion that the splines may miss between two epochs counts in full.
RATE_TOLERANCE_RADPS = 2e-6  # the flight turns at up to 0.2 rad/s
FORCE_TOLERANCE_MPS2 = 2e-5  # and accelerates at up to 5 m/s^2
EXACT = 1e-9  # of curves that the splines contain


@pytest.fixture(scope="module")
def flight() -> Trajectory:
    return Trajectory(
        Profile(
            name="turns",
            duration_s=160.0,
            start=Place(latitude_deg=34.4, longitude_deg=108.0, height_m=400.0, heading_deg=60.0, stand_s=10.0),
            speed=(SpeedChange(from_s=0.0, to_s=60.0, to_mps=120.0, edge_s=10.0),),
            height=(HeightChange(from_s=30.0, to_s=150.0, to_m=900.0, edge_s=30.0),),
            turn=(Turn(at_s=70.0, by_deg=50.0, bank_deg=30.0), Turn(at_s=110.0, by_deg=-50.0, bank_deg=30.0)),
            thermal=Thermal(self_heating_c=0.0),
        )
    )


def reference(trajectory: Trajectory, period_s: float = 0.1, offset_s: float = 0.0) -> Fixes:
    """The truth as a better navigator gives it; `offset_s` is its stamp minus the IMU's of the same instant."""
    time_s = np.arange(trajectory.start_s, trajectory.end_s + 1e-9, period_s)
    truth = trajectory.truth(time_s)
    return Fixes(
        time_s + offset_s,
        truth.latitude_rad,
        truth.longitude_rad,
        truth.height_m,
        truth.velocity_n,
        np.ones(time_s.size, dtype=bool),
        truth.attitude_rad,
    )


def test_ten_hertz_imply_the_increments_of_the_trajectory_at_a_hundred(flight):
    true = flight.increments(RATE_HZ)
    implied = implied_increments(reference(flight), true.time_s, flight.start_s)
    assert np.abs(true.dtheta_b).max() * RATE_HZ > 0.1  # the flight does turn
    assert np.abs(implied.dtheta_b - true.dtheta_b).max() * RATE_HZ < RATE_TOLERANCE_RADPS
    assert np.abs(implied.dv_b - true.dv_b).max() * RATE_HZ < FORCE_TOLERANCE_MPS2


def test_denser_epochs_imply_more_exactly(flight):
    true = flight.increments(RATE_HZ)
    errors = []
    for period_s in (0.8, 0.4, 0.2):
        implied = implied_increments(reference(flight, period_s), true.time_s, flight.start_s)
        errors.append(np.nanmax(np.abs(implied.dv_b - true.dv_b)))
    assert errors[0] > 6.0 * errors[1] > 36.0 * errors[2]  # third order: a factor 8 each


def test_a_known_clock_offset_is_taken_out(flight):
    true = flight.increments(RATE_HZ)
    implied = implied_increments(reference(flight, offset_s=-0.37), true.time_s, flight.start_s, time_offset_s=-0.37)
    known = np.isfinite(implied.dtheta_b).all(axis=1)
    assert known.mean() > 0.99
    assert np.abs(implied.dtheta_b - true.dtheta_b)[known].max() * RATE_HZ < RATE_TOLERANCE_RADPS


def test_a_lever_arm_is_taken_out(flight):
    arm_b = np.array([2.0, -0.5, 1.0])
    fixes, true = reference(flight), flight.increments(RATE_HZ)
    step_s = 1e-3  # the arm's own motion in the navigation frame, by differences of the true attitude

    def arm_n(time_s):
        angles = flight.truth(np.clip(time_s, flight.start_s, flight.end_s)).attitude_rad
        return Rotation.from_euler("ZYX", angles[:, ::-1]).apply(arm_b)

    moved = (arm_n(fixes.time_s + step_s) - arm_n(fixes.time_s - step_s)) / (2.0 * step_s)
    elsewhere = replace(fixes, velocity_n=fixes.velocity_n + moved)
    ignored = implied_increments(elsewhere, true.time_s, flight.start_s)
    implied = implied_increments(elsewhere, true.time_s, flight.start_s, lever_arm_m=tuple(arm_b))
    # the arm also turns with the navigation frame, at 2e-5 rad/s, which the difference above leaves out
    assert np.abs(implied.dv_b - true.dv_b).max() * RATE_HZ < 5.0 * FORCE_TOLERANCE_MPS2
    assert np.abs(ignored.dv_b - true.dv_b).max() * RATE_HZ > 1e-2


def test_at_rest_the_earth_turns_and_holds():
    latitude, height, heading, roll = 0.6, 380.0, 1.1, 0.05
    time_s = np.arange(0.0, 21.0)
    fixes = still(time_s, latitude, height, (roll, 0.0, heading))
    samples_s = np.arange(0.1, 20.05, 0.1)
    implied = implied_increments(fixes, samples_s, 0.0)
    to_body = Rotation.from_euler("ZYX", [heading, 0.0, roll]).inv()
    rate_b = to_body.apply(EARTH_RATE * np.array([np.cos(latitude), 0.0, -np.sin(latitude)]))
    force_b = to_body.apply([0.0, 0.0, -gravity(latitude, height)])
    assert np.allclose(implied.dtheta_b, 0.1 * rate_b, rtol=0.0, atol=EXACT * EARTH_RATE)
    assert np.allclose(implied.dv_b, 0.1 * force_b, rtol=EXACT)


def still(time_s, latitude, height, attitude) -> Fixes:
    n = time_s.size
    return Fixes(
        time_s,
        np.full(n, latitude),
        np.zeros(n),
        np.full(n, height),
        np.zeros((n, 3)),
        np.ones(n, dtype=bool),
        np.tile(attitude, (n, 1)),
    )


@pytest.mark.parametrize("left_out", ["rotation", "coriolis", "transport_rate"])
def test_terms_of_the_earth_can_be_left_out(left_out):
    """Level, heading north, 200 m/s east at the latitude 45 degrees, where each term is a product of a few numbers."""
    latitude, speed = 45.0 * DEG, 200.0
    time_s = np.arange(0.0, 11.0)
    east = replace(still(time_s, latitude, 0.0, (0.0, 0.0, 0.0)), velocity_n=np.tile([0.0, speed, 0.0], (11, 1)))
    samples_s = np.arange(1.0, 10.5)
    full = implied_increments(east, samples_s, 0.0)
    part = implied_increments(east, samples_s, 0.0, earth=EarthBelief(**{left_out: False}))
    transverse = 6378137.0 / np.sqrt(1.0 - 0.00669437999014 * 0.5)
    earth = EARTH_RATE * np.sqrt(0.5) * np.array([1.0, 0.0, -1.0])
    transport = speed / transverse * np.array([1.0, 0.0, -1.0])
    velocity = np.array([0.0, speed, 0.0])
    missing = {
        "rotation": (earth, np.cross(2.0 * earth, velocity)),
        "coriolis": (np.zeros(3), np.cross(2.0 * earth, velocity)),
        "transport_rate": (transport, np.cross(transport, velocity)),
    }[left_out]
    assert np.allclose((full.dtheta_b - part.dtheta_b)[5], missing[0], rtol=1e-6, atol=1e-12)
    assert np.allclose((full.dv_b - part.dv_b)[5], missing[1], rtol=1e-6, atol=1e-9)


def test_gaps_are_not_bridged(flight):
    fixes, true = reference(flight), flight.increments(RATE_HZ)
    kept = (fixes.time_s < 40.0) | (fixes.time_s > 45.0)
    lost = (fixes.time_s > 80.05) & (fixes.time_s < 83.05)
    attitude = fixes.attitude_rad.copy()
    attitude[(fixes.time_s > 100.05) & (fixes.time_s < 101.05), 1] = np.nan
    broken = replace(fixes, valid=~lost, attitude_rad=attitude)
    broken = Fixes(*(None if v is None else v[kept] for v in vars(broken).values()))
    implied = implied_increments(broken, true.time_s, flight.start_s)
    silent = np.isnan(implied.dtheta_b).any(axis=1)
    begin_s = true.time_s - 1.0 / RATE_HZ
    for first, last in ((39.95, 45.05), (80.0, 83.1), (100.0, 101.1)):
        inside = (begin_s > first + 0.05) & (true.time_s < last - 0.05)
        assert silent[inside].all() and inside.any()
    assert silent.sum() == pytest.approx(RATE_HZ * (5.2 + 3.1 + 1.1), abs=60)
    assert np.array_equal(silent, np.isnan(implied.dv_b).any(axis=1))


def test_a_reference_without_attitude_or_in_crumbs_is_refused(flight):
    fixes, time_s = reference(flight), np.arange(1.0, 10.0)
    with pytest.raises(DataRefused, match="has no attitude"):
        implied_increments(replace(fixes, attitude_rad=None), time_s, 0.0)
    with pytest.raises(DataRefused, match="no 4 of them follow one another"):
        implied_increments(replace(fixes, valid=np.arange(fixes.time_s.size) % 4 > 0), time_s, 0.0)


def test_spacing_is_that_of_most_epochs(flight):
    assert epoch_spacing_s(reference(flight, 0.25)) == pytest.approx(0.25)
