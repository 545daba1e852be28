"""Clocks that differ by a constant, jump or drift, planted in a motion in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ins_eval.recording import Fixes, Imu
from ins_eval.recording.consistency.clock_history import LINEAR_S, clock_histories
from ins_eval.recording.consistency.clocks import COARSE_S

RATE_HZ, SECONDS, BLOCK_S = 50.0, 240.0, 10.0
PPM = 1e-6


@pytest.fixture(scope="module")
def motion(weaving):
    return weaving(RATE_HZ, SECONDS)


@pytest.fixture(scope="module")
def imu(motion) -> Imu:
    """With constant biases and some noise."""
    rng, n = np.random.default_rng(4), len(motion.time_s) - 1
    gyro = 0.5 * (motion.rate_b[1:] + motion.rate_b[:-1]) + [2e-3, -1e-3, 1e-3] + 1e-3 * rng.standard_normal((n, 3))
    force = 0.5 * (motion.force_b[1:] + motion.force_b[:-1]) + [0.05, -0.1, 0.1] + 0.1 * rng.standard_normal((n, 3))
    return Imu(motion.time_s[1:], gyro / RATE_HZ, force / RATE_HZ, "increment")


def fixes(motion, late_s: np.ndarray | float) -> Fixes:
    """5 Hz; `late_s` of every instant of the motion."""
    rng, rows = np.random.default_rng(5), slice(0, None, 10)
    velocity_n = motion.velocity_n[rows] + 0.03 * rng.standard_normal(motion.velocity_n[rows].shape)
    place = (motion.latitude[rows], motion.longitude[rows], motion.height[rows])
    stamps = (motion.time_s + late_s)[rows]
    return Fixes(stamps, *place, velocity_n, np.ones(len(velocity_n), dtype=bool))


@pytest.mark.parametrize("late_s", [-0.6, 0.24, 0.5])
def test_a_constant_offset_and_nothing_more(motion, imu, late_s: float) -> None:
    (found,) = clock_histories(imu, 0.0, fixes(motion, late_s))
    assert found.offset_s == pytest.approx(late_s, abs=COARSE_S)
    assert (found.jump_s, found.drift) == (0.0, 0.0)


@pytest.mark.parametrize("jump_s", [-0.2, 0.3])
def test_a_jump_beside_a_delay(motion, imu, jump_s: float) -> None:
    at_s = 97.0
    found = clock_histories(imu, 0.0, fixes(motion, 0.25 + jump_s * (motion.time_s >= at_s)))
    best = max(found, key=lambda one: one.log_evidence)
    assert best.offset_s == pytest.approx(0.25, abs=2.0 * COARSE_S)
    assert best.clock_step == pytest.approx(-jump_s, abs=3.0 * COARSE_S)
    assert best.at_s == pytest.approx(at_s, abs=BLOCK_S)


@pytest.mark.parametrize("ppm", [-1200.0, 1700.0])
def test_a_drift_beside_a_delay(motion, imu, ppm: float) -> None:
    fast = replace(imu, time_s=imu.time_s * (1.0 + PPM * ppm))
    best = max(clock_histories(fast, 0.0, fixes(motion, 0.25)), key=lambda one: one.log_evidence)
    assert best.offset_s == pytest.approx(0.25, abs=3.0 * COARSE_S)
    assert best.clock_drift_ppm == pytest.approx(ppm, abs=4.0 * COARSE_S / SECONDS / PPM)


@pytest.mark.parametrize("late_s", [0.0, 0.5 * LINEAR_S])
def test_what_a_linear_response_describes_needs_no_start(motion, imu, late_s: float) -> None:
    assert clock_histories(imu, 0.0, fixes(motion, late_s)) == []


@pytest.mark.parametrize("seed", range(6))
def test_where_nothing_moves_no_clock_is_told(seed: int) -> None:
    """Once a second for half an hour, with speed that wanders: some pair of offsets and some instant fit best."""
    rng, n, seconds = np.random.default_rng([6, seed]), 1800, 1800.0
    time_s = np.arange(1, round(RATE_HZ * seconds) + 1) / RATE_HZ
    force = np.array([0.0, 0.0, -9.8]) + 0.05 * rng.standard_normal((time_s.size, 3))
    imu = Imu(time_s, 1e-4 * rng.standard_normal((time_s.size, 3)), force / RATE_HZ, "increment")
    drawn = 0.05 * rng.standard_normal((n, 3))
    velocity_n = np.array([20.0, 5.0, 0.0]) + drawn + np.cumsum(0.02 * rng.standard_normal((n, 3)), axis=0)
    place = np.full(n, 0.7), np.full(n, 0.3), np.full(n, 100.0)
    told = Fixes(np.linspace(1.0, seconds, n), *place, velocity_n, np.ones(n, dtype=bool))
    assert clock_histories(imu, 0.0, told) == []


@pytest.mark.parametrize("missing", [("height_m",), ("latitude_rad", "longitude_rad", "height_m")])
def test_a_receiver_that_gives_no_positions_has_a_clock_too(motion, imu, missing) -> None:
    seen = fixes(motion, 0.5)
    none = {name: np.full(seen.time_s.size, np.nan) for name in missing}
    (found,) = clock_histories(imu, 0.0, replace(seen, **none))
    assert found.offset_s == pytest.approx(0.5, abs=COARSE_S)
