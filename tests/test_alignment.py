"""Self-alignment at rest: exact without errors, closed forms of what biases do, and sigmas that mean something."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from ins_eval.alignment import AlignmentNoise, align, coarse_attitude
from ins_eval.earth import EARTH_RATE, gravity
from ins_eval.errors import DataRefused
from ins_eval.gyro import GyroPopulation
from ins_eval.recording import Start
from ins_eval.streams import Streams
from ins_eval.units import DEG, DEG_PER_H, UG

RATE_HZ = 20.0
EXACT_RAD = 1e-7  # rounding and the filter's priors: 0.02 arc seconds
CLOSED_FORM_TOLERANCE = 0.01
DRAWS = 60
CHANCE = 1e-3  # of a chi-square bound, each side; seeds are fixed

Stretch = tuple[np.ndarray, np.ndarray, np.ndarray, Start]


def at_rest(
    attitude_rad: tuple[float, float, float],
    latitude_deg: float = 34.65,
    duration_s: float = 600.0,
    rate_n: tuple[float, float, float] = (0.0, 0.0, 0.0),
    force_n: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Stretch:
    """Times, gyro and velocity increments of a vehicle that stands, constant errors given in NED, and where it is."""
    at = Start(-duration_s, latitude_deg * DEG, 1.9, 400.0)
    time_s = at.time_s + np.arange(1, round(duration_s * RATE_HZ) + 1) / RATE_HZ
    earth_n = EARTH_RATE * np.array([np.cos(at.latitude_rad), 0.0, -np.sin(at.latitude_rad)])
    up_n = np.array([0.0, 0.0, -gravity(at.latitude_rad, at.height_m)])
    to_body = Rotation.from_euler("ZYX", attitude_rad[::-1]).inv()
    gyro = to_body.apply(earth_n + rate_n) / RATE_HZ
    velocity = to_body.apply(up_n + force_n) / RATE_HZ
    return time_s, np.tile(gyro, (time_s.size, 1)), np.tile(velocity, (time_s.size, 1)), at


def error_n(found_rad, true_rad) -> np.ndarray:
    """Rotation vector (3,) from the true to the found attitude, NED: a positive third part is heading too far right."""
    found, true = (Rotation.from_euler("ZYX", np.asarray(a)[::-1]) for a in (found_rad, true_rad))
    return (found * true.inv()).as_rotvec()


@pytest.mark.parametrize("heading_deg", [-179.0, -90.0, 0.0, 60.0, 135.0])
@pytest.mark.parametrize("latitude_deg", [-75.0, -30.0, 0.0, 34.65, 60.0])
def test_without_errors_the_attitude_is_exact(latitude_deg: float, heading_deg: float) -> None:
    """Any heading, both hemispheres, with roll and pitch; coarse and fine."""
    attitude = (0.05, -0.08, heading_deg * DEG)
    alignment = align(*at_rest(attitude, latitude_deg))
    assert np.abs(error_n(alignment.start.attitude_rad, attitude)).max() < EXACT_RAD
    assert np.abs(error_n(alignment.coarse_attitude_rad, attitude)).max() < EXACT_RAD


def test_the_state_that_navigation_starts_from() -> None:
    """At the last sample that was used, at the known place, standing."""
    time_s, gyro, velocity, at = at_rest((0.0, 0.0, 1.0))
    start = align(time_s, gyro, velocity, at).start
    assert start.time_s == pytest.approx(time_s[-1])
    assert (start.latitude_rad, start.longitude_rad, start.height_m) == (at.latitude_rad, at.longitude_rad, at.height_m)
    assert start.velocity_n == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("latitude_deg", [0.0, 34.65, -60.0])
def test_an_east_gyro_bias_turns_the_heading(latitude_deg: float) -> None:
    """-b / (Omega cos L): the gyros cannot tell the bias from the Earth's rate; the level stays."""
    bias = 0.014 * DEG_PER_H
    attitude = (0.02, 0.01, 0.9)
    alignment = align(*at_rest(attitude, latitude_deg, rate_n=(0.0, bias, 0.0)))
    error = error_n(alignment.start.attitude_rad, attitude)
    expected = -bias / (EARTH_RATE * np.cos(latitude_deg * DEG))
    assert error[2] == pytest.approx(expected, rel=CLOSED_FORM_TOLERANCE)
    assert np.abs(error[:2]).max() < 1e-3 * abs(expected)


@pytest.mark.parametrize(
    ("force_n", "axis", "sign"), [((50.0 * UG, 0.0, 0.0), 1, 1.0), ((0.0, 50.0 * UG, 0.0), 0, -1.0)]
)
def test_a_level_accelerometer_bias_tilts(force_n: tuple[float, float, float], axis: int, sign: float) -> None:
    """b / g: towards north it lifts the nose (about east), towards east it turns about north the other way."""
    attitude = (0.0, 0.0, 0.4)
    stretch = at_rest(attitude, force_n=force_n)
    tilt = error_n(align(*stretch).start.attitude_rad, attitude)[axis]
    at = stretch[-1]
    assert tilt == pytest.approx(sign * 50.0 * UG / gravity(at.latitude_rad, at.height_m), rel=CLOSED_FORM_TOLERANCE)


def test_a_north_gyro_bias_is_estimated() -> None:
    """It tilts the computed level with time, so that it is seen: heading is hardly touched by what is not east."""
    bias = 0.014 * DEG_PER_H
    attitude = (0.0, 0.0, 0.0)
    alignment = align(*at_rest(attitude, duration_s=900.0, rate_n=(bias, 0.0, 0.0)))
    assert np.abs(error_n(alignment.start.attitude_rad, attitude)).max() < 0.02 * bias / EARTH_RATE


def test_heading_sigma_is_what_the_gyro_bias_allows() -> None:
    """sigma_b / (Omega cos L) for gyros without random walk; it grows towards the pole."""
    noise = AlignmentNoise(angle_random_walk_deg_per_sqrt_h=1e-6, velocity_random_walk_ug_per_sqrt_hz=0.1)
    for latitude_deg in (0.0, 34.65, 60.0):
        alignment = align(*at_rest((0.0, 0.0, 0.0), latitude_deg, duration_s=900.0), noise)
        expected = 0.014 * DEG_PER_H / (EARTH_RATE * np.cos(latitude_deg * DEG))
        assert alignment.heading_sigma_rad == pytest.approx(expected, rel=0.03)


def test_reported_sigmas_cover_the_errors_of_the_shipped_gyros() -> None:
    """60 triads over 900 s: the sum of (error / sigma)^2 of the heading is a chi-square of 60 degrees of freedom.

    Level: the filter allows for a sway that is not there, so only the upper bound is asked of it.
    """
    attitude = (0.02, -0.03, 1.0)
    time_s, gyro, velocity, at = at_rest(attitude, duration_s=900.0)
    heading, level = [], []
    for number in range(DRAWS):
        indicated = GyroPopulation().increments(time_s, at.time_s, gyro, Streams(11).at(number))
        alignment = align(time_s, indicated, velocity, at)
        error = error_n(alignment.start.attitude_rad, attitude)
        heading.append(error[2] / alignment.heading_sigma_rad)
        level.append(error[:2] / alignment.level_sigma_rad)
    low, high = chi2.ppf([CHANCE, 1.0 - CHANCE], DRAWS)
    assert low < np.sum(np.square(heading)) < high
    assert np.sum(np.square(level)) < chi2.ppf(1.0 - CHANCE, 2 * DRAWS)


def test_fine_alignment_is_better_than_coarse_with_noisy_gyros() -> None:
    """Ten times the random walk of the shipped gyros: the filter uses 900 s, the coarse attitude the first 120 s."""
    attitude = (0.0, 0.0, 1.0)
    time_s, gyro, velocity, at = at_rest(attitude, duration_s=900.0)
    gyros = GyroPopulation(angle_random_walk_deg_per_sqrt_h=0.01, bias_deg_per_h=0.0, instability_deg_per_h=0.0)
    noise = AlignmentNoise(angle_random_walk_deg_per_sqrt_h=0.01, gyro_bias_deg_per_h=1e-4)
    coarse, fine = [], []
    for number in range(12):
        indicated = gyros.increments(time_s, at.time_s, gyro, Streams(12).at(number))
        alignment = align(time_s, indicated, velocity, at, noise)
        coarse.append(error_n(alignment.coarse_attitude_rad, attitude)[2])
        fine.append(error_n(alignment.start.attitude_rad, attitude)[2])
    assert np.std(fine) < 0.6 * np.std(coarse)


def refusal(action) -> str:
    """The message of the DataRefused that `action` raises, which must be one sentence."""
    with pytest.raises(DataRefused) as caught:
        action()
    message = str(caught.value)
    assert "\n" not in message
    assert ". " not in message
    return message


def test_a_standstill_below_a_minute_is_refused() -> None:
    message = refusal(lambda: align(*at_rest((0.0, 0.0, 0.0), duration_s=59.0)))
    for part in ("59.0 s at rest", "at least 60 s", "[start]"):
        assert part in message
    align(*at_rest((0.0, 0.0, 0.0), duration_s=60.0))


def test_gyros_that_do_not_feel_the_earth_turn_are_refused() -> None:
    time_s, gyro, velocity, at = at_rest((0.0, 0.0, 0.0))
    message = refusal(lambda: align(time_s, 0.05 * gyro, velocity, at))
    for part in ("cannot find north", "deg/h", "[start]"):
        assert part in message


def test_coarse_attitude_from_two_vectors() -> None:
    """Gravity and Earth's rate, as felt in body axes, give back the attitude they were turned by."""
    rng = np.random.default_rng(5)
    for attitude in rng.uniform([-3.0, -1.4, -3.0], [3.0, 1.4, 3.0], (30, 3)):
        to_body = Rotation.from_euler("ZYX", attitude[::-1]).inv()
        rate_b = to_body.apply(EARTH_RATE * np.array([np.cos(0.7), 0.0, -np.sin(0.7)]))
        found = coarse_attitude(rate_b, to_body.apply([0.0, 0.0, -9.8]))
        assert np.abs(error_n(found, attitude)).max() < EXACT_RAD
