"""Velocities that a table computed: made from positions of known noise here, or measured apart from them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ins_eval.recording import Fixes
from ins_eval.recording.computed import without_computed, without_extrapolated

RADIUS_M, LATITUDE, LONGITUDE = 6.37e6, 0.7, 0.3
DIGITS = 7  # of degrees, as receivers write them: 11 mm
DEG = np.pi / 180.0


def circle(sigma_m: float, sigma_mps: float, rate_hz: float = 1.0, seed: int = 3) -> Fixes:
    """Ten minutes of a climbing circle of 400 m at 20 m/s, positions and velocities with white noise."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 600.0, 1.0 / rate_hz)
    course = t / 20.0
    n = sigma_m * rng.standard_normal((3, t.size))
    return Fixes(
        t,
        DEG * np.round((LATITUDE + (400.0 * np.sin(course) + n[0]) / RADIUS_M) / DEG, DIGITS),
        DEG * np.round((LONGITUDE + (-400.0 * np.cos(course) + n[1]) / (RADIUS_M * np.cos(LATITUDE))) / DEG, DIGITS),
        100.0 + 0.2 * t + n[2],
        np.column_stack([20.0 * np.cos(course), 20.0 * np.sin(course), np.full(t.size, -0.2)])
        + sigma_mps * rng.standard_normal((t.size, 3)),
        np.ones(t.size, dtype=bool),
    )


def computed(fixes: Fixes, way: str) -> Fixes:
    """The same with velocities that are differences of its positions, on the sphere of this file."""
    north_m = RADIUS_M * fixes.latitude_rad
    east_m = RADIUS_M * np.cos(LATITUDE) * fixes.longitude_rad
    d = np.diff(np.column_stack([north_m, east_m, -fixes.height_m]), axis=0) / np.diff(fixes.time_s)[:, None]
    velocity = {
        "the last interval": np.vstack([d[:1], d]),
        "the next interval": np.vstack([d, d[-1:]]),
        "both intervals beside": np.vstack([d[:1], 0.5 * (d[1:] + d[:-1]), d[-1:]]),
    }[way]
    return replace(fixes, velocity_n=velocity)


@pytest.mark.parametrize("sigma_m", [0.5, 3.0])
@pytest.mark.parametrize("way", ["the last interval", "the next interval", "both intervals beside"])
def test_differences_of_positions_are_no_velocities(way: str, sigma_m: float) -> None:
    left, (said,) = without_computed(computed(circle(sigma_m, 0.05), way), "gps")
    assert np.isnan(left.velocity_n).all()
    assert said.startswith(f"Warning: the velocities of gps are differences of its positions over {way};")


@pytest.mark.parametrize("rate_hz", [1.0, 10.0])
@pytest.mark.parametrize(("sigma_m", "sigma_mps"), [(3.0, 0.05), (0.01, 0.05), (0.0, 0.0), (0.01, 0.5)])
def test_what_was_measured_stays(sigma_m: float, sigma_mps: float, rate_hz: float) -> None:
    fixes = circle(sigma_m, sigma_mps, rate_hz)
    left, said = without_computed(fixes, "gps")
    assert left is fixes and said == []


def test_a_way_that_was_summed_from_velocities_leaves_these_alone() -> None:
    fixes = circle(0.0, 0.0)
    way_m = np.vstack([np.zeros(3), np.cumsum(fixes.velocity_n[1:], axis=0)])
    summed = replace(
        fixes,
        latitude_rad=LATITUDE + way_m[:, 0] / RADIUS_M,
        longitude_rad=LONGITUDE + way_m[:, 1] / (RADIUS_M * np.cos(LATITUDE)),
        height_m=100.0 - way_m[:, 2],
    )
    assert without_computed(summed, "reference") == (summed, [])


def test_a_velocity_down_that_is_zero_while_heights_change_was_not_measured() -> None:
    fixes = circle(3.0, 0.05)
    level = replace(fixes, velocity_n=fixes.velocity_n * [1.0, 1.0, 0.0])
    left, (said,) = without_computed(level, "gps")
    assert np.isnan(left.velocity_n[:, 2]).all() and np.array_equal(left.velocity_n[:, :2], level.velocity_n[:, :2])
    assert "is 0 in every fix, and heights change by 1" in said
    on_water = replace(level, height_m=np.full_like(level.height_m, 100.0))
    assert without_computed(on_water, "gps") == (on_water, [])


def straight_on(fixes: Fixes, first: int, last: int) -> Fixes:
    """The same with fixes after `first` up to `last` that keep its velocity and leave it along a straight line."""
    held = slice(first + 1, last + 1)
    since_s = fixes.time_s[held] - fixes.time_s[first]
    north, east, down = fixes.velocity_n[first]
    latitude, longitude, height_m = fixes.latitude_rad.copy(), fixes.longitude_rad.copy(), fixes.height_m.copy()
    latitude[held] = latitude[first] + north * since_s / RADIUS_M
    longitude[held] = longitude[first] + east * since_s / (RADIUS_M * np.cos(LATITUDE))
    height_m[held] = height_m[first] - down * since_s
    velocity_n = fixes.velocity_n.copy()
    velocity_n[held] = fixes.velocity_n[first]
    return replace(fixes, latitude_rad=latitude, longitude_rad=longitude, height_m=height_m, velocity_n=velocity_n)


def test_fixes_that_go_straight_on_and_jump_back_are_an_outage() -> None:
    fixes = circle(3.0, 0.05)
    left, (said,) = without_extrapolated(straight_on(fixes, 100, 120), "gps")
    assert np.array_equal(np.flatnonzero(~left.valid), np.arange(101, 121))
    assert said.startswith("Warning: 20 fixes of gps keep one velocity to the last digit, the first from 100 to 120 s")
    assert without_extrapolated(fixes, "gps") == (fixes, [])


def test_fixes_that_stand_in_motion_are_an_outage() -> None:
    fixes = circle(3.0, 0.05)
    stands = straight_on(replace(fixes, velocity_n=fixes.velocity_n * (np.arange(600) != 100)[:, None]), 100, 120)
    left, _ = without_extrapolated(stands, "gps")
    assert np.array_equal(np.flatnonzero(~left.valid), np.arange(101, 121))


def test_a_receiver_that_holds_a_vehicle_at_rest_has_measured_it() -> None:
    """It stands for 100 s after it braked, and the position leaps by 40 m when it drives off."""
    fixes = circle(0.0, 0.0)
    slow = np.clip(np.abs(fixes.time_s - 300.0) - 50.0, 0.0, 20.0) / 20.0  # of its speed: it brakes by 1 m/s^2
    way_m = np.cumsum(20.0 * slow)
    north_m = way_m + np.where(fixes.time_s > 350.0, 40.0, 0.0)
    velocity_n = np.column_stack([20.0 * slow, 0.0 * slow, 0.0 * slow])
    stood = replace(
        fixes,
        latitude_rad=LATITUDE + north_m / RADIUS_M,
        longitude_rad=np.full_like(fixes.longitude_rad, LONGITUDE),
        velocity_n=velocity_n,
    )
    assert without_extrapolated(stood, "gps") == (stood, [])


def test_a_turn_of_five_g_is_no_jump() -> None:
    t = np.arange(0.0, 60.0, 0.1)
    course = np.maximum(t - 30.0, 0.0) * 5.0 * 9.8 / 100.0
    velocity_n = np.column_stack([100.0 * np.cos(course), 100.0 * np.sin(course), 0.0 * t])
    way_m = np.vstack([np.zeros(3), np.cumsum(0.05 * (velocity_n[1:] + velocity_n[:-1]), axis=0)])
    truth = Fixes(
        t,
        LATITUDE + way_m[:, 0] / RADIUS_M,
        LONGITUDE + way_m[:, 1] / (RADIUS_M * np.cos(LATITUDE)),
        np.full(t.size, 100.0),
        velocity_n,
        np.ones(t.size, dtype=bool),
    )
    assert without_extrapolated(truth, "reference") == (truth, [])


def test_positions_that_are_measured_beside_velocities_that_repeat_stay() -> None:
    """A logger at 10 Hz writes the velocity of each second ten times."""
    fixes = circle(0.01, 0.05, 10.0)
    repeated = replace(fixes, velocity_n=np.repeat(fixes.velocity_n[::10], 10, axis=0))
    assert without_extrapolated(repeated, "gps") == (repeated, [])


def test_a_velocity_that_a_vehicle_keeps_is_measured() -> None:
    """Nothing jumps: with positions of 3 m, written to 0.5 m/s on a circle, and at the end of a table."""
    fixes = circle(3.0, 0.0)
    keeps = replace(straight_on(fixes, 0, len(fixes.time_s) - 1), velocity_n=np.tile([20.0, 0.0, 0.0], (600, 1)))
    coarse = replace(fixes, velocity_n=np.round(2.0 * fixes.velocity_n) / 2.0)
    for one in (keeps, coarse, straight_on(fixes, 580, 599)):
        assert without_extrapolated(one, "gps") == (one, [])
