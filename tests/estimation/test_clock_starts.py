"""An agile flight whose fixes are late by more than a linear response describes: the search begins at the clock."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ins_eval.believed import believed
from ins_eval.diagnosis.answer.judge import judge
from ins_eval.diagnosis.answer.verdict import Diagnosis
from ins_eval.estimation.case import prepare
from ins_eval.estimation.clock_starts import clock_beliefs
from ins_eval.recording import Fixes, Imu, Recording, Start

RATE_HZ, FINE, FIX_HZ = 50.0, 10, 5.0
STANDS_S, TAKES_OFF_S, LASTS_S = 60.0, 4.0, 110.0
LATITUDE, LONGITUDE, HEIGHT = 0.7, 0.3, 100.0  # rad, rad, m
RADIUS_M, GRAVITY = 6.38e6, 9.8016
SHAKE_MPS2, SCALE = 2.0, 0.03  # of accelerometers beside an engine; of consumer sheets
SIGMAS = 4.0
NOISE, SMOOTH = (1.0, 0.07), (0.1, 1.0)  # m and m/s of a fix; of one whose positions are filtered


def motion(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Attitude (n, 3) and velocity NED (n, 3) of a model aeroplane that is carried to and fro and takes off."""
    share = np.clip((t - STANDS_S) / TAKES_OFF_S, 0.0, 1.0)
    flies = share**2 * (3.0 - 2.0 * share)
    swing = 1.2 * np.sin(0.9 * t) + 0.5 * np.sin(1.7 * t + 1.0)
    roll = 0.6 * np.sin(0.9 * t + 1.2) + 0.2 * np.sin(2.3 * t)
    pitch, climb = 0.25 * np.sin(1.1 * t + 0.4), 3.0 * np.sin(1.1 * t + 0.2)
    carried = 0.75 * (t > 0.2 * STANDS_S) * (1.0 - np.cos(0.5 * np.pi * (t - 0.2 * STANDS_S)))
    speed = flies * (20.0 + 5.0 * np.sin(0.5 * t)) + (1.0 - flies) * carried
    heading = 0.5 + flies * swing
    velocity_n = np.column_stack([speed * np.cos(heading), speed * np.sin(heading), -flies * climb])
    return np.column_stack([flies * roll, flies * pitch, heading]), velocity_n


def flight(
    seconds: float,
    late_s: float,
    drift_ppm: float = 0.0,
    shakes_mps2: float = SHAKE_MPS2,
    older_s: float = 0.0,
    fix: tuple[float, float] = NOISE,
) -> Recording:
    """A consumer unit with scale factors off by three hundredths; its clock is fast, its fixes are late.

    Positions are older than the velocities of the same fix by `older_s`.
    """
    rng, step_s = np.random.default_rng(1), 1.0 / (RATE_HZ * FINE)
    t = step_s * np.arange(round(seconds / step_s) + 1)
    attitude, velocity_n = motion(t)
    mat = Rotation.from_euler("ZYX", attitude[:, ::-1])
    turned = (mat[:-1].inv() * mat[1:]).as_rotvec()
    middle = mat[:-1] * Rotation.from_rotvec(0.5 * turned)
    felt = middle.inv().apply(np.diff(velocity_n, axis=0) - [0.0, 0.0, GRAVITY * step_s])
    gyro, force = (one.reshape(-1, FINE, 3).sum(axis=1) for one in (turned, felt))
    gyro = gyro + (np.array([2e-3, -1e-3, 1e-3]) + 5e-3 * rng.standard_normal(gyro.shape)) / RATE_HZ
    gyro = gyro * (1.0 + SCALE * np.array([0.3, -0.3, 1.0]))
    time_s = t[FINE::FINE]
    shakes = 0.1 + shakes_mps2 * (time_s[:, None] > STANDS_S)
    force = force * (1.0 + SCALE * np.array([1.0, -1.0, 1.0]))
    force = force + (np.array([0.05, -0.1, 0.1]) + shakes * rng.standard_normal(force.shape)) / RATE_HZ
    way = np.vstack([np.zeros(3), np.cumsum(0.5 * (velocity_n[1:] + velocity_n[:-1]) * step_s, axis=0)])
    every = slice(round(RATE_HZ * FINE / FIX_HZ), None, round(RATE_HZ * FINE / FIX_HZ))
    was = np.clip(t[every] - older_s, 0.0, None)
    place = np.column_stack([np.interp(was, t, along) for along in way.T])
    place = place + fix[0] * rng.standard_normal(place.shape)
    fixes = Fixes(
        t[every] + late_s,
        LATITUDE + place[:, 0] / RADIUS_M,
        LONGITUDE + place[:, 1] / (RADIUS_M * np.cos(LATITUDE)),
        HEIGHT - place[:, 2],
        velocity_n[every] + fix[1] * rng.standard_normal(place.shape),
        np.ones(len(place), dtype=bool),
    )
    imu = Imu(time_s * (1.0 + 1e-6 * drift_ppm), gyro, force, "increment")
    start = Start(0.0, LATITUDE, LONGITUDE, HEIGHT, tuple(velocity_n[0]), tuple(attitude[0]))
    return Recording("model aeroplane", "flight", start, imu, gps=fixes)


def named(found: Diagnosis) -> dict[str, tuple[float, float]]:
    """Value and sigma of every effect on clocks."""
    effects = ((one.hypothesis.candidate.name, one) for one in found.effects)
    return {name: (one.value, one.sigma) for name, one in effects if "clock" in name or "time_offset" in name}


@pytest.mark.parametrize("late_s", [pytest.param(0.45, marks=pytest.mark.slow), 1.5])
def test_fixes_that_are_very_late_are_named_as_such(late_s: float) -> None:
    """A search around the belief ended without a name here: 0.45 s are a quarter of a swing.

    Of clocks that were tried up to 1 s the rest of 1.5 s was an axis of the other sign.
    """
    case = prepare(believed(flight(LASTS_S, late_s)))
    (beliefs,) = [one for one in clock_beliefs(case) if len(one) == 1]
    assert beliefs[0].value == pytest.approx(late_s, abs=0.03)
    clocks = named(judge([case]))
    assert set(clocks) == {"gps.time_offset"}
    value, sigma = clocks["gps.time_offset"]
    assert value == pytest.approx(late_s, abs=SIGMAS * sigma)


def test_a_receiver_whose_positions_are_younger_than_its_velocities_is_late_by_its_velocities() -> None:
    """One delay for both lay between them: 0.168 +- 0.003 s."""
    late_s = 0.2
    case = prepare(believed(flight(LASTS_S, late_s, older_s=-0.08, fix=SMOOTH)))
    clocks = named(judge([case]))
    assert set(clocks) == {"gps.time_offset"}
    value, sigma = clocks["gps.time_offset"]
    assert value == pytest.approx(late_s, abs=SIGMAS * sigma)


@pytest.mark.slow
def test_a_clock_that_drifts_far_is_no_antenna_and_no_jump() -> None:
    """Over a turn's worth of delay a search around the belief put the antenna 1.6 m away, and the clock jumped."""
    found = judge([prepare(believed(flight(300.0, 0.25, drift_ppm=2000.0, shakes_mps2=2.0 * SHAKE_MPS2)))])
    clocks = named(found)
    assert set(clocks) == {"gps.time_offset", "recording.clock_drift"}
    for name, true in (("gps.time_offset", 0.25), ("recording.clock_drift", 2000.0)):
        value, sigma = clocks[name]
        assert value == pytest.approx(true, abs=SIGMAS * sigma)
    assert "gps.lever_arm" not in {one.hypothesis.candidate.name for one in found.effects}
