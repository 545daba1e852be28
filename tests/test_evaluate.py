"""`evaluate` of a standstill anywhere and for any time: its numeric floor needs no limit of the simulator."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from ins_eval.analysis.evaluate import evaluate_recording
from ins_eval.cli import main
from ins_eval.earth import gravity
from ins_eval.recording import Fixes, Imu, Recording, Start, form
from ins_eval.recording.belief import ReferenceBelief
from ins_eval.units import DEG

EARTH_RATE = 7.292115e-5  # rad/s, WGS-84
LOCAL_GRAVITY = {34.0: 9.7965, 86.0: 9.8319}  # m/s^2 at height 0, Somigliana, rounded
FLOOR_M, FLOOR_MPS = 0.2, 1e-4  # steps of 4 s over 30 h; a wrong term of the equations makes kilometres
TILT_DEG = 0.003
EAST_MPS, EAST_S = 100.0, 300.0
TURNED_DEG = 7.3e-3  # the turn of the Earth in a frame that tilts by 2 deg in 100 s: w_e b t^2 / 2
POLAR_SHARE, SMALL_M = 0.5, 0.01


def standstill(latitude_deg: float, longitude_deg: float, height_m: float, hours: float, rate_hz: float) -> Recording:
    """A level unit that heads north and whose gyros and accelerometers have only the error of the rounded gravity."""
    n = round(3600.0 * hours * rate_hz)
    rate = EARTH_RATE * np.array([np.cos(latitude_deg * DEG), 0.0, -np.sin(latitude_deg * DEG)])
    force = np.array([0.0, 0.0, -LOCAL_GRAVITY[latitude_deg]])
    start = Start(
        0.0, latitude_deg * DEG, longitude_deg * DEG, height_m,
        attitude_rad=(0.0, 0.0, 0.0), attitude_sigma_rad=(TILT_DEG * DEG,) * 3,
    )  # fmt: skip
    imu = Imu(
        np.arange(1, n + 1) / rate_hz, np.tile(rate / rate_hz, (n, 1)), np.tile(force / rate_hz, (n, 1)), "increment"
    )
    return Recording("parked", "static", start, imu)


@pytest.mark.parametrize(
    "place",
    [(34.0, 200.0, 400.0), (86.0, 20.0, 0.0), (34.0, 20.0, -600.0), (86.0, -200.0, -600.0)],
    ids=["longitude 200", "latitude 86", "below the sea", "all"],
)
def test_a_standstill_is_evaluated_anywhere(place, tmp_path):
    folder = form.write(standstill(*place, hours=0.2, rate_hz=10.0), tmp_path / "parked")
    assert main(["evaluate", str(folder), "--output", str(tmp_path / "page"), "--quiet"]) == 0
    tree = json.loads((tmp_path / "page" / "metrics.json").read_text())
    assert tree["floor"]["horizontal_m"] < FLOOR_M and tree["floor"]["velocity_mps"] < FLOOR_MPS


def test_a_standstill_of_thirty_hours_is_evaluated():
    found = evaluate_recording(standstill(34.0, 108.0, 400.0, hours=30.0, rate_hz=1.0))
    assert found.floor.horizontal_m < FLOOR_M and found.floor.velocity_mps < FLOOR_MPS
    assert found.tree["navigation"]["end_s"] == 30.0 * 3600.0


def around_the_pole(latitude_deg: float, rate_hz: float) -> Recording:
    """A level vehicle that drives east at constant speed: body rate and specific force are constant.

    w = w_ie + w_en,  f = (2 w_ie + w_en) x v - g,  w_en = v / N (1, 0, -tan L) in north, east, down
    """
    latitude, n = latitude_deg * DEG, round(EAST_S * rate_hz)
    transverse = 6378137.0 / np.sqrt(1.0 - 0.00669437999014 * np.sin(latitude) ** 2)
    earth = EARTH_RATE * np.array([np.cos(latitude), 0.0, -np.sin(latitude)])
    transport = EAST_MPS / transverse * np.array([1.0, 0.0, -np.tan(latitude)])
    force = np.cross(2.0 * earth + transport, [0.0, EAST_MPS, 0.0]) - [0.0, 0.0, float(gravity(latitude, 0.0))]
    to_body = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    gyro, accelerometer = (np.tile(to_body @ one / rate_hz, (n, 1)) for one in (earth + transport, force))
    start = Start(
        0.0, latitude, 0.0, 0.0, (0.0, EAST_MPS, 0.0), (0.0, 0.0, 90.0 * DEG), attitude_sigma_rad=(TILT_DEG * DEG,) * 3
    )
    time_s = np.arange(1, n + 1) / rate_hz
    at_s = np.arange(0.0, EAST_S + 0.5)
    radius = transverse * np.cos(latitude)
    turned = np.remainder(EAST_MPS * at_s / radius + np.pi, 2.0 * np.pi) - np.pi
    truth = Fixes(
        at_s, np.full(at_s.size, latitude), turned, np.zeros(at_s.size), np.tile([0.0, EAST_MPS, 0.0], (at_s.size, 1)),
        np.ones(at_s.size, dtype=bool),
    )  # fmt: skip
    return Recording("east", "drive", start, Imu(time_s, gyro, accelerometer, "increment"), gps=truth)


@pytest.mark.parametrize(("latitude_deg", "rate_hz"), [(89.995, 20.0), (89.99, 10.0), (89.9, 10.0), (85.0, 10.0)])
def test_what_a_pole_does_to_the_navigation_is_said_with_its_size(latitude_deg: float, rate_hz: float) -> None:
    found = evaluate_recording(around_the_pole(latitude_deg, rate_hz))
    errors = found.first.errors
    off_m = float(np.hypot(errors.north_m, errors.east_m)[-1])
    said = [note for note in found.tree["recording"]["notes"] if "north turns" in note]
    assert len(said) == (latitude_deg > 89.9)
    for note in said:
        assert float(note.split("off by ")[1].split(" m")[0]) == pytest.approx(off_m, rel=POLAR_SHARE)
    assert said or off_m < SMALL_M


def test_a_longitude_beyond_a_full_turn_is_refused_with_the_range(tmp_path, capsys):
    folder = form.write(standstill(34.0, 20.0, 0.0, hours=0.1, rate_hz=10.0), tmp_path / "parked")
    text = (folder / "recording.toml").read_text().replace("longitude_deg = 20.0", "longitude_deg = 420.0")
    (folder / "recording.toml").write_text(text)
    assert main(["evaluate", str(folder), "--quiet"]) == 3
    assert "360" in capsys.readouterr().err


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_attitude_is_compared_where_a_reference_has_nothing_else(axis, tmp_path):
    """A gyro bias turns the navigated attitude of a level unit that heads north: phi = b t."""
    bias_radps, late_s = 2.0 * DEG / 100.0, 0.5
    true = replace(standstill(34.0, 108.0, 400.0, hours=100.0 / 3600.0, rate_hz=100.0), kind="drive")
    gyro = true.imu.gyro.copy()
    gyro[:, axis] += bias_radps / 100.0
    time_s = np.arange(0.0, 99.0) + 0.503  # between the rows of the solution
    nothing = np.full(time_s.size, np.nan)
    truth = Fixes(time_s + late_s, *[nothing] * 3, np.full((time_s.size, 3), np.nan), nothing == 0.0, np.zeros((99, 3)))
    belief = true.belief.model_copy(update={"reference": ReferenceBelief(time_offset_s=late_s)})
    recording = replace(true, imu=replace(true.imu, gyro=gyro), reference=truth, belief=belief)
    folder = form.write(recording, tmp_path / "led")
    assert main(["evaluate", str(folder), "--output", str(tmp_path / "page"), "--quiet"]) == 0
    tree = json.loads((tmp_path / "page" / "metrics.json").read_text())
    assert tree["reference"]["kind"] == "attitude" and tree["reference"]["attitude_epochs"] == time_s.size
    (found,) = tree["compensations"].values()
    assert "velocity_rms_mps" not in found
    expected = np.zeros(3)
    expected[axis] = np.sqrt(np.mean((bias_radps * time_s) ** 2)) / DEG
    rms_deg = [found["attitude_rms_deg"][about] for about in ("north", "east", "down")]
    assert rms_deg == pytest.approx(expected.tolist(), abs=TURNED_DEG)
    words = (tmp_path / "page" / "report.txt").read_text()
    assert "a reference of attitude alone" in words and "Attitude error" in words
    assert (tmp_path / "page" / "figures" / "attitude_error.svg").is_file()
