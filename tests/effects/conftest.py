"""Flights of a perfect instrument whose output is in pulses, temperature and vibration recorded: no noise at all."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from ins_eval.imu import Mission
from ins_eval.profile import load
from ins_eval.recording import Recording
from ins_eval.recording.belief import AccelerometerBelief, AxisBelief, BiasBelief, ScaleBelief
from ins_eval.thermal import filtered_rate
from ins_eval.units import DEG, STANDARD_GRAVITY
from tests.beliefs import navigation_grade

RATE_HZ = 20.0
T0_C = 22.0
SCALE = {"gamma": 320000.0, "mu": -30.0, "beta": 0.1, "epsilon": 30.0, "eta": 0.3, "alpha": 20.0}
BIAS = {"k0_ug": 800.0, "omega_ug_per_c": 5.0}
BELIEF = navigation_grade(
    accelerometer=AccelerometerBelief(
        **{axis: AxisBelief(scale=ScaleBelief(**SCALE), bias=BiasBelief(**BIAS)) for axis in "xyz"}
    )
)


def scale_factor(temperature_c: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Eq. (11) written out, pulse/(g s)."""
    t, c = temperature_c - T0_C, SCALE
    return (
        c["gamma"] + c["mu"] * t + c["beta"] * t**2 + c["epsilon"] * rate + c["eta"] * t * rate + c["alpha"] * rate**2
    )


def counts(velocity: np.ndarray, interval_s, temperature_c: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Pulses (n,) of one accelerometer, not rounded: E dt = K1 (K0 1e-6 dt + dv / g0)."""
    bias = BIAS["k0_ug"] + BIAS["omega_ug_per_c"] * (temperature_c - T0_C)
    return scale_factor(temperature_c, rate) * (1e-6 * bias * interval_s + velocity / STANDARD_GRAVITY)


@cache
def made(profile: str, with_reference: bool) -> Recording:
    """A flight at `RATE_HZ`; the true trajectory stands in place of GPS, or is the reference."""
    mission = Mission(load(profile), RATE_HZ)
    ideal = mission.ideal()
    time_s = ideal.imu.time_s
    temperature = np.interp(time_s, mission.temperature.time_s, mission.temperature.temperature_c)
    rate = filtered_rate(time_s, temperature)
    pulses = np.column_stack([counts(one, 1.0 / RATE_HZ, temperature, rate) for one in ideal.imu.accelerometer.T])
    vibration = 0.05 + 0.1 * (1.0 + np.sin(2.0 * np.pi * time_s / 700.0))
    imu = replace(
        ideal.imu,
        accelerometer=pulses,
        accelerometer_form="pulse",
        temperature_c=temperature,
        further={"vibration_rms_g": vibration, "supply_v": 28.0 + np.sin(2.0 * np.pi * time_s / 1900.0)},
    )
    start = replace(ideal.start, attitude_sigma_rad=(0.003 * DEG, 0.003 * DEG, 0.06 * DEG))
    fixes = ideal.reference
    return replace(
        ideal,
        imu=imu,
        start=start,
        belief=BELIEF,
        reference=fixes if with_reference else None,
        gps=None if with_reference else replace(fixes, attitude_rad=None),
    )


@pytest.fixture(scope="session")
def flight() -> Recording:
    return made("climb-cruise-landing", False)


@pytest.fixture(scope="session")
def beside_a_reference() -> Recording:
    return made("climb-cruise-landing", True)
