"""The benchmark's own world is exact: its recordings without noise are integrated again by another method."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmark.worlds import check, earth, world
from benchmark.worlds.cases import draw
from benchmark.worlds.elsewhere import ELSEWHERE
from benchmark.worlds.instruments import compensated
from benchmark.worlds.trajectories import TRAJECTORIES

AXES = "xyz"
WAYS = TRAJECTORIES | ELSEWHERE


def short(path: world.Path, seconds: float) -> world.Path:
    """The first part of a path."""
    n = round(seconds / world.KNOT_S)
    return world.Path(path.origin, path.displacement[:n], path.euler[:n], n * world.KNOT_S, path.phases)


def error_m(path, angle, velocity, rate_hz, steps):
    """Largest distance between the truth and the navigated increments."""
    lla, speed, euler, _ = path.state([0.0])
    start = earth.from_euler(*euler[0])
    height = lambda t: path.state(t)[0][:, 2]  # noqa: E731
    got, _, _ = check.navigate(angle, velocity, rate_hz, lla[0], speed[0], start, height, steps)
    truth = path.state(np.arange(1, len(angle) + 1) / rate_hz)[0]
    return float(np.linalg.norm(got - earth.ecef(*truth.T), axis=1).max())


@pytest.mark.parametrize(
    ("latitude_deg", "height_m", "gravity"),
    [(0.0, 0.0, 9.7803253359), (90.0, 0.0, 9.8321849378), (45.0, 0.0, 9.806197769)],
)
def test_normal_gravity_is_that_of_the_tables(latitude_deg, height_m, gravity):
    """WGS-84, NIMA TR8350.2: equator, pole, 45 degrees."""
    assert earth.gravity(math.radians(latitude_deg), height_m) == pytest.approx(gravity, abs=2e-9)


def test_gravity_falls_with_height_as_the_potential_says():
    """Free-air gradient at 45 degrees: -0.3086 mGal/m, and +7.2e-13 m/s^2 per m^2 (Heiskanen and Moritz, 2-125)."""
    g = [earth.gravity(math.pi / 4.0, h) for h in (0.0, 1000.0, 2000.0)]
    assert (g[1] - g[0]) / 1000.0 == pytest.approx(-3.086e-6, rel=2e-3)
    assert (g[2] - 2.0 * g[1] + g[0]) / 1e6 == pytest.approx(2.0 * 7.2e-13, rel=0.02)


def test_geodetic_undoes_ecef():
    latitude, longitude, height = 0.73, -2.1, 8123.4
    assert earth.geodetic(*earth.ecef(latitude, longitude, height)) == pytest.approx(
        (latitude, longitude, height), abs=2e-9
    )


@pytest.mark.parametrize(
    ("name", "rate_hz"),
    [("climb, cruise, landing", 20.0), ("wing rock", 50.0), ("drive", 25.0), ("rolls", 100.0), ("ship", 20.0)],
)
def test_increments_integrate_back_to_the_truth(name, rate_hz):
    """The first 1200 s (climb, wing rock, stop and go), by other equations in another frame."""
    path = short(WAYS[name][1](np.random.default_rng(5)), 1200.0)
    angle, velocity = world.increments(path, rate_hz)
    assert error_m(path, angle, velocity, rate_hz, 2) < 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("name", WAYS)
def test_increments_of_the_whole_integrate_back_to_the_truth(name):
    path = WAYS[name][1](np.random.default_rng(3))
    angle, velocity = world.increments(path, 50.0)
    assert error_m(path, angle, velocity, 50.0, 4) < 1e-3


def test_increments_of_two_rates_are_the_same_motion():
    """Ten samples at 50 Hz add to four at 20 Hz; the sums differ by the quadrature alone."""
    path = short(TRAJECTORIES["wing rock"][1](np.random.default_rng(2)), 1200.0)
    coarse, fine = world.increments(path, 20.0), world.increments(path, 50.0)
    for a, b in zip(coarse, fine, strict=True):
        assert np.abs(a.reshape(-1, 4, 3).sum(axis=1) - b.reshape(-1, 10, 3).sum(axis=1)).max() < 1e-12


def test_a_parked_unit_feels_gravity_and_the_turning_earth():
    path = short(TRAJECTORIES["static"][1](np.random.default_rng(1), seconds=100.0), 20.0)
    angle, velocity = world.increments(path, 20.0)
    lla, _, euler, _ = path.state([0.0])
    c = earth.from_euler(*euler[0])
    latitude = lla[0, 0]
    assert velocity[7] * 20.0 == pytest.approx(c.T @ (0, 0, -earth.gravity(latitude, lla[0, 2])), abs=2e-8)
    spin = earth.W * np.array((math.cos(latitude), 0.0, -math.sin(latitude)))
    assert angle[7] * 20.0 == pytest.approx(c.T @ spin, abs=1e-13)


def test_a_recording_without_noise_is_exact_to_its_pulses():
    """Drive: what the belief makes of the counts gives the truth back within what rounding to a pulse allows."""
    case = draw("development", 1, "zero", 4)
    made = case.made[0]
    assert made.trajectory == "drive"
    felt, head = made.felt, made.head["accelerometer"]
    counts = np.column_stack([made.tables["imu"][f"accel_{axis}"] for axis in AXES])
    velocity = compensated(counts, head, made.errors["reading"], felt.dt)
    pulse = earth.G0 / min(head[axis]["scale"]["gamma"] for axis in AXES)
    assert np.abs(np.cumsum(velocity - felt.velocity, axis=0)).max() < pulse
    assert error_m(felt.truth, made.errors["gyro"], velocity, made.rate_hz, 2) < 0.01
    table = made.tables.get("gps") or made.tables["reference"]
    offset = made.head.get("gps", {"time_offset_s": 0.0})["time_offset_s"]
    k = len(table["time_s"]) // 2
    lever = np.array(made.head.get("gps", {"lever_arm_m": [0.0] * 3})["lever_arm_m"])
    lla, speed, euler, turn = felt.truth.state([table["time_s"][k] - offset])
    c = earth.from_euler(*euler[0])
    assert table["velocity_n_mps"][k] == pytest.approx((speed[0] + c @ np.cross(turn[0], lever))[0], abs=1e-12)
    arm = earth.to_ned(lla[0, 0], lla[0, 1]).T @ c @ lever
    antenna = earth.geodetic(*(earth.ecef(*lla[0]) + arm))
    assert math.radians(table["latitude_deg"][k]) == pytest.approx(antenna[0], abs=1e-14)
    assert table["height_m"][k] == pytest.approx(antenna[2], abs=1e-8)
