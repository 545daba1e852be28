"""A parked unit in other units, or with the other sign of a gyro, against gravity and the rate of the Earth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ins_eval.recording import Imu, Recording, Start
from ins_eval.recording.belief import Belief, GyroBelief
from ins_eval.recording.consistency.alternatives import LIKELY
from ins_eval.recording.consistency.rest import check_rest
from ins_eval.units import DEG, DEG_PER_H

LATITUDE_RAD = np.radians(35.0)
GRAVITY, EARTH_RATE = 9.7973, 7.292115e-5  # m/s^2 at 35 degrees and height 0, WGS-84, to a part in 10 000; rad/s
STEP_S, SAMPLES = 0.01, 6000
UP, NORTH = np.array([0.05, -0.03, -1.0]), np.array([0.8, 0.6, 0.0])  # in body axes: nearly level, heading 37 deg
SMALL, POOR, LARGE = 0.02 * DEG_PER_H, 100.0 * DEG_PER_H, 1000.0 * DEG_PER_H


def parked(bias: float = SMALL, rate=1.0, force=1.0, signs=(1.0, 1.0, 1.0), step_s: float = STEP_S) -> Recording:
    """A unit with a gyro bias on every axis, its columns times factors and signs."""
    rng = np.random.default_rng(1)
    up = UP / np.linalg.norm(UP)
    north = NORTH - (NORTH @ up) * up
    north /= np.linalg.norm(north)
    spin = EARTH_RATE * (np.cos(LATITUDE_RAD) * north + np.sin(LATITUDE_RAD) * up) + bias
    gyro = rate * np.array(signs) * (spin * step_s + 1e-9 * rng.standard_normal((SAMPLES, 3)))
    velocity = force * (GRAVITY * up * step_s + 1e-5 * rng.standard_normal((SAMPLES, 3)))
    imu = Imu(step_s * np.arange(1, SAMPLES + 1), gyro, velocity, "increment")
    return Recording("parked", "static", Start(0.0, LATITUDE_RAD, 0.0, 0.0), imu)


@pytest.mark.parametrize(
    ("spoilt", "key", "factor"),
    [
        ({"rate": 1.0 / DEG}, "gyro.unit", DEG),
        ({"rate": DEG}, "gyro.unit", 1.0 / DEG),
        ({"rate": 1.0 / STEP_S}, "gyro.unit", STEP_S),
        ({"force": 1.0 / 9.80665}, "accelerometer.unit", 9.80665),
        ({"force": 1.0 / STEP_S}, "accelerometer.unit", STEP_S),
        ({"force": 1.05 / 9.80665}, "accelerometer.unit", 9.80665),  # and a bias of 50 mg
    ],
)
def test_another_unit_is_named_with_its_factor(spoilt, key, factor) -> None:
    (found,) = check_rest(parked(**spoilt))
    assert (found.key, found.factor) == (key, pytest.approx(factor))
    assert found.log_odds == np.inf


@pytest.mark.parametrize(("rate", "factors"), [(1.0, []), (2.0, []), (1.0 / DEG, [DEG])])
def test_a_bias_that_is_believed_tells_the_unit_where_it_hides_the_earth(rate: float, factors: list) -> None:
    belief = Belief(gyro=GyroBelief(bias_radps=(LARGE,) * 3))
    found = [one for one in check_rest(replace(parked(LARGE, rate), belief=belief)) if one.key == "gyro.unit"]
    assert [one.factor for one in found] == pytest.approx(factors)


def test_another_sign_of_the_vertical_gyro_is_named() -> None:
    (found,) = check_rest(parked(signs=(1.0, 1.0, -1.0)))
    assert found.key == "axes" and found.decided
    ((force, rate),) = found.orders
    np.testing.assert_array_equal(force, np.eye(3))
    np.testing.assert_array_equal(rate, np.diag([1.0, 1.0, -1.0]))


@pytest.mark.parametrize("bias", [0.0, SMALL, 0.5 * DEG_PER_H, POOR, -POOR])
def test_a_sound_unit_has_nothing_wrong_whatever_its_bias(bias: float) -> None:
    assert [one for one in check_rest(parked(bias)) if one.log_odds > LIKELY] == []


@pytest.mark.parametrize("bias_of_gravity", [-0.06, 0.02, 0.047])
def test_a_bias_is_no_unit_where_two_mix_ups_come_to_nearly_one(bias_of_gravity: float) -> None:
    """At 10 Hz increments given as rates in g are 1.02 of what they should be."""
    assert list(check_rest(parked(force=1.0 + bias_of_gravity, step_s=0.1))) == []


def test_what_moves_is_not_judged_by_a_standstill() -> None:
    assert list(check_rest(replace(parked(rate=1.0 / DEG), kind="drive"))) == []
