"""An error that follows the motion, or how a temperature changes, is found by what it follows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ins_eval.diagnosis.unnamed.dependence import PRESSURE, WARMING, dependence, second_derivative
from ins_eval.diagnosis.unnamed.disturbance import is_sure
from ins_eval.estimation import case as cases
from ins_eval.policy import Policy
from ins_eval.recording import Recording
from ins_eval.thermal import standard_pressure
from ins_eval.units import DEG_PER_H, UG
from tests.ideal import RATE_HZ, ideal, mission

POSITION_M, VELOCITY_MPS, RADIUS_M = 3.0, 0.05, 6.37e6
PUBLISHED_HPA = {0.0: 1013.25, 5000.0: 540.20, 11000.0: 226.32, 15000.0: 120.45, 20000.0: 54.75}  # ICAO Doc 7488
OF_PUBLISHED = 2e-3
HEADING_DEG_PER_H, PRESSURE_UG, WARMING_UG = 0.03, 300.0, 40.0
LARGE_DEG_PER_H, WARM_S, OF_CURVE = 0.1, 1800.0, 1e-3
COLDER_C, BEGIN_S, END_S, HOUSING_S = 25.0, 600.0, 3000.0, 60.0  # a fall of temperature that a housing rounds


def with_fixes(recording: Recording, cooled: bool = False) -> Recording:
    """With a receiver's noise, and, where `cooled`, a temperature that falls along a ramp with rounded corners."""
    rng, imu, gps = np.random.default_rng(3), recording.imu, recording.gps
    count = gps.time_s.size
    fixes = replace(
        gps,
        latitude_rad=gps.latitude_rad + POSITION_M / RADIUS_M * rng.standard_normal(count),
        longitude_rad=gps.longitude_rad + POSITION_M / RADIUS_M * rng.standard_normal(count),
        height_m=gps.height_m + POSITION_M * rng.standard_normal(count),
        velocity_n=gps.velocity_n + VELOCITY_MPS * rng.standard_normal((count, 3)),
    )
    temperature_c = rounded(imu.time_s)[0] if cooled else None
    return replace(recording, gps=fixes, imu=replace(imu, temperature_c=temperature_c))


def rounded(time_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A ramp with corners rounded over `HOUSING_S`, in degC, and its second derivative, of unit size at a corner."""
    begin, end = ((time_s - at) / HOUSING_S for at in (BEGIN_S, END_S))
    fall = (np.logaddexp(0.0, begin) - np.logaddexp(0.0, end)) * HOUSING_S / (END_S - BEGIN_S)
    return 40.0 - COLDER_C * fall, np.cosh(0.5 * end) ** -2 - np.cosh(0.5 * begin) ** -2


def disturbed(name: str, what: str, of: float) -> tuple[Recording, str]:
    """A flight whose sensor errs by `of` times what is usual here, as it follows `what`, and that sensor."""
    recording = with_fixes(ideal(name), cooled=what == WARMING)
    imu = recording.imu
    truth = mission(name).trajectory.truth(imu.time_s)
    gyro, force = imu.gyro.copy(), imu.accelerometer.copy()
    if what == "heading":
        heading = np.arctan2(truth.velocity_n[:, 1], truth.velocity_n[:, 0])
        gyro[:, 1] += of * HEADING_DEG_PER_H * DEG_PER_H / RATE_HZ * np.sin(heading + 0.9)
    elif what == PRESSURE:
        share = np.interp(truth.height_m, list(PUBLISHED_HPA), list(PUBLISHED_HPA.values())) / 1013.25
        force[:, 2] += of * PRESSURE_UG * UG / RATE_HZ * (share - share[0])
    else:
        force[:, 1] += of * WARMING_UG * UG / RATE_HZ * rounded(imu.time_s)[1]
    sensor = {"heading": "gyro.y", PRESSURE: "accelerometer.z", WARMING: "accelerometer.y"}[what]
    return replace(recording, imu=replace(imu, gyro=gyro, accelerometer=force)), sensor


@pytest.mark.parametrize(
    ("name", "what"),
    [("box", "heading"), ("climb-cruise-landing", PRESSURE), ("climb-cruise-landing", WARMING)],
)
@pytest.mark.parametrize("of", [1.0, 0.0])
def test_what_a_sensor_follows_is_found_where_it_follows_it(name: str, what: str, of: float) -> None:
    recording, sensor = disturbed(name, what, of)
    case = cases.prepare(recording)
    found = dependence(case, 0, case.fitted(hills=True), Policy())
    sure = found is not None and is_sure(found, Policy())
    assert sure is (of > 0.0)
    if of:
        assert (found.interval.channel.name, found.follows) == (sensor, what)


def test_a_gyro_bias_on_a_straight_flight_follows_no_heading() -> None:
    """Sine and cosine of a heading that is held are constants, and constants have a name."""
    recording = with_fixes(ideal("straight"))
    gyro = recording.imu.gyro.copy()
    gyro[:, 1] += LARGE_DEG_PER_H * DEG_PER_H / RATE_HZ
    case = cases.prepare(replace(recording, imu=replace(recording.imu, gyro=gyro)))
    found = dependence(case, 0, case.fitted(hills=True), Policy())
    assert found is None or found.follows not in ("heading", "twice the heading")


@pytest.mark.parametrize(("values", "second"), [
    (lambda t: np.full_like(t, 25.0), np.zeros_like),
    (lambda t: 20.0 + 0.01 * t, np.zeros_like),
    (lambda t: 25.0 * np.exp(-t / WARM_S), lambda t: 25.0 / WARM_S**2 * np.exp(-t / WARM_S)),
])  # fmt: skip
def test_a_second_derivative(values, second) -> None:
    time_s = np.arange(3600.0)
    inner = slice(200, -200)  # at its ends a curve goes on as it was
    found, size = second_derivative(time_s, values(time_s))[inner], 25.0 / WARM_S**2
    np.testing.assert_allclose(found, second(time_s)[inner], atol=OF_CURVE * size)


def test_the_standard_atmosphere_is_the_published_one() -> None:
    share = standard_pressure(np.array(list(PUBLISHED_HPA)))
    np.testing.assert_allclose(1013.25 * share, list(PUBLISHED_HPA.values()), rtol=OF_PUBLISHED)
    assert 0.0 < standard_pressure(np.array([100e3]))[0] < 1e-5  # a rocket is above nearly all of it
