"""Positions without velocities: what unit and order they have is told by a motion in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ins_eval.recording import Fixes, Imu, Recording, Start
from ins_eval.recording.consistency.alternatives import BEYOND_DOUBT
from ins_eval.recording.consistency.triads import check_triads
from ins_eval.units import DEG
from tests.recording.readers.conftest import drive

RATE_HZ, LASTED_S, EVERY = 50.0, 120.0, 10
NOISE_M = 0.05  # of a receiver between neighbouring fixes
RADIUS_M = 6.37e6


def a_drive(every: int, noise_m: float) -> Recording:
    motion = drive(RATE_HZ, LASTED_S)
    rate, force = (0.5 / RATE_HZ * (one[1:] + one[:-1]) for one in (motion.rate_b, motion.force_b))
    imu = Imu(motion.time_s[1:], rate, force, "increment")
    at = slice(0, None, every)
    noise = noise_m * np.random.default_rng(2).standard_normal((3, motion.time_s[at].size))
    fixes = Fixes(
        motion.time_s[at],
        motion.latitude[at] + noise[0] / RADIUS_M,
        motion.longitude[at] + noise[1] / RADIUS_M,
        motion.height[at] + noise[2],
        np.full((noise.shape[1], 3), np.nan),
        np.ones(noise.shape[1], dtype=bool),
    )
    return Recording("drive", "flight", Start(0.0, motion.latitude[0], motion.longitude[0], 100.0), imu, fixes)


@pytest.fixture(scope="module")
def driven() -> Recording:
    return a_drive(EVERY, NOISE_M)


def degrees_for_radians(fixes: Fixes) -> Fixes:
    return replace(fixes, latitude_rad=fixes.latitude_rad * DEG, longitude_rad=fixes.longitude_rad * DEG)


def exchanged(fixes: Fixes) -> Fixes:
    return replace(fixes, latitude_rad=fixes.longitude_rad, longitude_rad=fixes.latitude_rad)


@pytest.mark.parametrize(
    ("spoil", "key", "value", "said"),
    [
        (degrees_for_radians, "position.unit", "rad", "radians read as degrees"),
        (exchanged, "gps.position", None, "latitude and longitude are exchanged"),
        (lambda f: replace(f, height_m=f.height_m / 0.3048), "height.unit", "feet", "the height is in feet"),
        (lambda f: replace(f, height_m=f.height_m * 1e3), "height.unit", "mm", "the height is in mm"),
    ],
)
def test_a_position_in_another_unit_or_order_is_told_by_the_motion(driven, spoil, key, value, said):
    (found,) = check_triads(replace(driven, gps=spoil(driven.gps)))
    assert (found.key, found.value) == (key, value) and said in found.seen and found.log_odds > BEYOND_DOUBT


def test_a_position_that_fits_the_motion_is_left_alone(driven):
    assert check_triads(driven) == []


@pytest.mark.parametrize("noise_m", [1.0, 3.0])
def test_a_unit_in_which_the_noise_is_less_is_no_better_one(noise_m):
    """Fixes of 1 Hz: of heights read as cm little noise is left, and that passed for what the motion explains."""
    assert not [found for found in check_triads(a_drive(round(RATE_HZ), noise_m)) if found.decided]


@pytest.mark.parametrize(("gyro", "force"), [(1.0 / DEG, 1.0), (1.0, 0.1), (0.0, 1.0)])
def test_triads_that_no_position_explains_blame_none(driven, gyro, force):
    imu = replace(driven.imu, gyro=gyro * driven.imu.gyro, accelerometer=force * driven.imu.accelerometer)
    assert not [found for found in check_triads(replace(driven, imu=imu)) if found.decided]


def test_a_position_that_does_not_move_tells_nothing_and_that_is_said(driven):
    gps, imu = driven.gps, driven.imu
    rng = np.random.default_rng(3)
    noise = 1e-5 * rng.standard_normal((2, len(imu.time_s), 3))
    parked = replace(imu, gyro=noise[0], accelerometer=noise[1] - [0.0, 0.0, 9.8 / RATE_HZ])
    stands = replace(gps, latitude_rad=0.0 * gps.latitude_rad + 0.7, longitude_rad=0.0 * gps.longitude_rad + 0.3)
    (found,) = check_triads(replace(driven, imu=parked, gps=replace(stands, height_m=0.0 * gps.height_m + 100.0)))
    assert not found.decided and "does not determine the unit and order of the position" in found.seen
