"""The offset between two clocks, planted in a motion in closed form and found again within its uncertainty."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ins_eval.recording import Fixes, Imu
from ins_eval.recording.consistency.clocks import clock_offset

SIGMAS = 4.0
SAMPLING_S = 0.002  # what sampling and the finite search leave without any noise
LARGEST_SIGMA_S = 0.05


@pytest.fixture(scope="module")
def motion(weaving):
    return weaving(50.0, 150.0)


@pytest.fixture(scope="module")
def imu(motion) -> Imu:
    """Increments with a constant bias of each sensor and some noise."""
    rng = np.random.default_rng(4)
    n = len(motion.time_s) - 1
    gyro = 0.5 * (motion.rate_b[1:] + motion.rate_b[:-1]) + [2e-3, -1e-3, 1e-3] + 1e-3 * rng.standard_normal((n, 3))
    force = 0.5 * (motion.force_b[1:] + motion.force_b[:-1]) + [0.05, -0.1, 0.1] + 0.02 * rng.standard_normal((n, 3))
    return Imu(motion.time_s[1:], 0.02 * gyro, 0.02 * force, "increment")


def fixes(motion, offset_s: float, every: int = 10, attitude: bool = False) -> Fixes:
    rng = np.random.default_rng(5)
    rows = slice(0, None, every)
    velocity_n = motion.velocity_n[rows] + 0.02 * rng.standard_normal(motion.velocity_n[rows].shape)
    return Fixes(
        motion.time_s[rows] + offset_s,
        motion.latitude[rows],
        motion.longitude[rows],
        motion.height[rows],
        velocity_n,
        np.ones(len(velocity_n), dtype=bool),
        motion.attitude[rows] if attitude else None,
    )


@pytest.mark.parametrize("offset_s", [-0.4, -0.005, 0.0, 0.23, 0.6])
@pytest.mark.parametrize("attitude", [False, True])
def test_a_planted_offset_is_found(motion, imu, offset_s, attitude):
    found = clock_offset(imu, 0.0, fixes(motion, offset_s, attitude=attitude))
    assert found.sigma_s < LARGEST_SIGMA_S
    assert abs(found.offset_s - offset_s) < SIGMAS * found.sigma_s + SAMPLING_S
    assert ("attitude" in found.method) == attitude
    assert found.residual_rms <= found.residual_rms_unshifted * (1.0 + 1e-9)


def test_outages_and_fixes_once_a_second(motion, imu):
    slow = fixes(motion, 0.3, every=50)
    valid = np.ones(len(slow.time_s), dtype=bool)
    valid[40:60] = False
    velocity_n = np.where(valid[:, None], slow.velocity_n, np.nan)
    found = clock_offset(imu, 0.0, replace(slow, valid=valid, velocity_n=velocity_n))
    assert abs(found.offset_s - 0.3) < SIGMAS * found.sigma_s + SAMPLING_S


def test_no_motion_or_too_little_of_it_tells_nothing(motion, imu):
    parked = fixes(motion, 0.0)
    rng = np.random.default_rng(6)
    still = replace(parked, velocity_n=0.02 * rng.standard_normal(parked.velocity_n.shape))
    quiet = replace(
        imu,
        gyro=1e-5 * rng.standard_normal(imu.gyro.shape),
        accelerometer=0.02 * np.array([0.0, 0.0, -9.8]) + 1e-4 * rng.standard_normal(imu.gyro.shape),
    )
    assert clock_offset(quiet, 0.0, still) is None
    short = slice(0, 1000)
    cut = Imu(imu.time_s[short], imu.gyro[short], imu.accelerometer[short], "increment")
    assert clock_offset(cut, 0.0, parked) is None
    assert clock_offset(imu, 0.0, replace(parked, valid=np.zeros(len(parked.time_s), dtype=bool))) is None


def test_the_same_recording_gives_the_same_answer(motion, imu):
    assert clock_offset(imu, 0.0, fixes(motion, 0.1)) == clock_offset(imu, 0.0, fixes(motion, 0.1))
