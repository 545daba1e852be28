"""Where nothing is wrong and nothing is noisy, nothing is found: what is left is rounding."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ins_eval.diagnosis.answer.judge import judge
from ins_eval.diagnosis.unnamed.disturbance import is_sure
from ins_eval.diagnosis.unnamed.one_sensor import _by_its_level, one_sensor
from ins_eval.estimation import case as cases
from ins_eval.policy import Policy
from ins_eval.units import DEG_PER_H, STANDARD_GRAVITY, UG
from tests.ideal import RATE_HZ

MOST_LOG_BAYES_FACTOR = 1.0
SIGMAS = 2.0  # of each turn-on bias
PARKED_S = 3600.0
WAVE_UG, PERIOD_S, LONG_PERIOD_S = 40.0, 900.0, 1500.0  # less than a turn-on bias, and within what a sensor may wander
ROUNDING_NATS = 1.0
POSITION_M, VELOCITY_MPS, RADIUS_M = 3.0, 0.05, 6.37e6


OTHERS = [pytest.param(name, marks=pytest.mark.slow) for name in ("box", "wing-rock", "straight")]


@pytest.mark.parametrize("name", ["climb-cruise-landing", "oven", *OTHERS])
def test_an_ideal_recording_shows_nothing(ideal_recording, name: str) -> None:
    judgement = judge([cases.prepare(ideal_recording(name))])
    assert judgement.statistics["largest_log_bayes_factor"] < MOST_LOG_BAYES_FACTOR
    assert judgement.statistics["smallest_probability"] == 1.0
    assert judgement.mismatches == ()


def test_turn_on_biases_cost_a_parked_null_their_prior_and_no_more(recording_at_rest) -> None:
    """An hour of them makes kilometres, whose products a standstill known to a millimetre would show."""
    parked = recording_at_rest(PARKED_S, 3, np.zeros_like)
    belief, imu = parked.belief, parked.imu
    signs, interval_s = np.array([1.0, -1.0, 1.0]), np.diff(imu.time_s, prepend=0.0)[:, None]
    force = SIGMAS * belief.accelerometer.bias_sigma_ug * UG * signs
    rate = SIGMAS * belief.gyro.bias_sigma_deg_per_h * DEG_PER_H * signs
    biased = replace(imu, accelerometer=imu.accelerometer + force * interval_s, gyro=imu.gyro + rate * interval_s)
    found = [cases.prepare(one).fitted().log_evidence for one in (parked, replace(parked, imu=biased))]
    assert 0.0 < found[0] - found[1] < 0.5 * 6 * SIGMAS**2 + ROUNDING_NATS


def test_a_wave_that_looked_like_turning_gyros_is_of_one_accelerometer(flight) -> None:
    """Across the track it leans as gyros with a large random walk do, which are no start from which it is found."""
    rng, imu, gps = np.random.default_rng(3), flight.imu, flight.gps
    count = gps.time_s.size
    force = imu.accelerometer.copy()
    force[:, 1] += 2.0 * WAVE_UG * UG / RATE_HZ * np.sin(2.0 * np.pi * imu.time_s / LONG_PERIOD_S)
    fixes = replace(
        gps,
        latitude_rad=gps.latitude_rad + POSITION_M / RADIUS_M * rng.standard_normal(count),
        longitude_rad=gps.longitude_rad + POSITION_M / RADIUS_M * rng.standard_normal(count),
        velocity_n=gps.velocity_n + VELOCITY_MPS * rng.standard_normal((count, 3)),
    )
    case = cases.prepare(replace(flight, imu=replace(imu, accelerometer=force), gps=fixes))
    found = _by_its_level(case, 0, case.fitted(hills=True), Policy())
    assert found.interval.channel.name == "accelerometer.y" and is_sure(found, Policy())


@pytest.mark.parametrize("wave_ug", [WAVE_UG, 0.0])
def test_a_wave_of_one_sensor_is_no_wander_of_all(flight, wave_ug: float) -> None:
    """No step of windows follows a wave, and a wander of all three sensors takes it up; the other two are quiet."""
    imu = flight.imu
    force = imu.accelerometer.copy()
    force[:, 2] += wave_ug * UG / RATE_HZ * np.sin(2.0 * np.pi * imu.time_s / PERIOD_S)
    case = cases.prepare(replace(flight, imu=replace(imu, accelerometer=force)))
    found = one_sensor(case, 0, case.fitted(hills=True), Policy())
    assert is_sure(found, Policy()) is (wave_ug > 0.0)
    if wave_ug:
        assert found.interval.channel.name == "accelerometer.z"


@pytest.mark.parametrize(
    ("axis", "felt"), [pytest.param("z", False, marks=pytest.mark.slow), ("x", False), ("x", True)]
)
def test_a_wave_of_a_parked_unit_is_its_own_unless_its_gyros_feel_it(recording_at_rest, axis: str, felt: bool) -> None:
    """Within windows it fits none of them; a stand that leans to and fro by so much shows in x and in the gyro of y."""
    parked = recording_at_rest(PARKED_S, 6, np.zeros_like)
    imu = parked.imu
    force, rate, interval_s = imu.accelerometer.copy(), imu.gyro.copy(), np.diff(imu.time_s, prepend=0.0)
    phase = 2.0 * np.pi * imu.time_s / PERIOD_S
    force[:, "xyz".index(axis)] += WAVE_UG * UG * interval_s * np.sin(phase)
    if felt:
        lean_rad = WAVE_UG * UG / STANDARD_GRAVITY * np.sin(phase)
        rate[:, 1] += np.diff(lean_rad, prepend=0.0)
    case = cases.prepare(replace(parked, imu=replace(imu, accelerometer=force, gyro=rate)))
    found = one_sensor(case, 0, case.fitted(hills=True), Policy())
    if felt:
        assert found is None or not is_sure(found, Policy())
    else:
        assert is_sure(found, Policy())
        assert found.interval.channel.name == f"accelerometer.{axis}"
