"""Flights without any noise, made by the simulator, as what a perfect instrument and receiver would record."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from ins_eval.imu import Mission
from ins_eval.profile import load
from ins_eval.recording import Recording
from ins_eval.units import DEG, DEG_PER_SQRT_H, UG

RATE_HZ = 20.0
VELOCITY_RANDOM_WALK_UG = 5.0  # per sqrt(Hz)
ANGLE_RANDOM_WALK = 0.001  # deg/sqrt(h)
Signal = Callable[[np.ndarray], np.ndarray]


@cache
def mission(name: str) -> Mission:
    return Mission(load(name), RATE_HZ)


@cache
def ideal(name: str) -> Recording:
    """A recording whose increments and fixes are exact, with an attitude that is believed to a few arc seconds."""
    made = mission(name).ideal()
    parked = mission(name).profile.kind == "static"
    start = replace(made.start, attitude_sigma_rad=(0.003 * DEG, 0.003 * DEG, 0.06 * DEG))
    fixes = None if parked else replace(made.reference, attitude_rad=None)
    return replace(made, kind="static" if parked else "flight", start=start, reference=None, gps=fixes)


@pytest.fixture(scope="session")
def flight() -> Recording:
    return ideal("climb-cruise-landing")


@pytest.fixture(scope="session")
def ideal_recording():
    return ideal


def at_rest(
    end_s: float, seed: int, error_ug: Signal, temperature_c: Signal | None = None, start_s: float = 0.0
) -> Recording:
    """Level and at rest, with random walks; `error_ug` of the time since the start is that of accelerometer z."""
    whole = ideal("oven")
    rows = whole.imu.time_s <= end_s
    time_s = whole.imu.time_s[rows]
    rng = np.random.default_rng(seed)
    accelerometer = whole.imu.accelerometer[rows].copy()
    accelerometer[:, 2] += UG * error_ug(time_s) / RATE_HZ
    accelerometer += VELOCITY_RANDOM_WALK_UG * UG / np.sqrt(RATE_HZ) * rng.standard_normal((time_s.size, 3))
    gyro = whole.imu.gyro[rows].copy()
    gyro += ANGLE_RANDOM_WALK * DEG_PER_SQRT_H / np.sqrt(RATE_HZ) * rng.standard_normal((time_s.size, 3))
    imu = replace(
        whole.imu,
        time_s=start_s + time_s,
        gyro=gyro,
        accelerometer=accelerometer,
        temperature_c=None if temperature_c is None else temperature_c(time_s),
        height_baro_m=None,
    )
    return replace(whole, name="at rest", imu=imu, start=replace(whole.start, time_s=start_s))


@pytest.fixture(scope="session")
def recording_at_rest():
    return at_rest
