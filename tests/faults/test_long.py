"""A day of a recording at 200 Hz is evaluated and diagnosed in the memory of a small machine."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from ins_eval.earth import EARTH_RATE, gravity
from ins_eval.recording import Fixes, Imu, Recording, Start, form

DAY_S, RATE_HZ = 86400, 200
LARGEST_GB = 6.0
LATITUDE_RAD, HEIGHT_M = 0.6, 400.0
TIMEOUT_S = 1800.0
MEASURED = """
import resource, sys
from ins_eval.cli import main
code = main(sys.argv[1:])
print(code, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""
MOVING = """
name = "a day aloft"
kind = "flight"
duration_s = 85500.0
thermal.ground_c = 8.0
thermal.time_constant_s = 4500.0
thermal.recovery_factor = 0.85
thermal.anchor = { time_s = 7200.0, temperature_c = -11.0 }
start = { latitude_deg = 34.65, longitude_deg = 108.9, height_m = 400.0, heading_deg = 60.0, stand_s = 900.0 }
speed = [{ from_s = 0.0, to_s = 50.0, to_mps = 85.0 }]
height = [{ from_s = 50.0, to_s = 1800.0, to_m = 3000.0, edge_s = 60.0 }]
"""
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def days(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A parked unit of navigation grade with a fix each second, and one that flies up and down a course."""
    folder = tmp_path_factory.mktemp("day")
    return {"parked": parked(folder / "parked"), "moving": moving(folder / "moving")}


def moving(folder: Path) -> Path:
    """The simulator's flight of a day."""
    profile = folder.with_suffix(".toml")
    turns = (f"[[turn]]\nat_s = {2400 * k}.0\nby_deg = {180 * (-1) ** k}.0\nbank_deg = 25.0\n" for k in range(1, 35))
    profile.write_text(MOVING + "".join(turns))
    words = ["simulate", "flight", "--profile", f"{profile}", "--rate", f"{RATE_HZ}", "-o", f"{folder}", "--quiet"]
    subprocess.run([sys.executable, "-c", MEASURED, *words], check=True, timeout=TIMEOUT_S)
    return folder


def parked(folder: Path) -> Path:
    """Level, heading north, with white noise and receivers of a navigation grade."""
    rng, n, m = np.random.default_rng(1), DAY_S * RATE_HZ, DAY_S - 1
    rate = EARTH_RATE * np.array([np.cos(LATITUDE_RAD), 0.0, -np.sin(LATITUDE_RAD)])
    force = np.array([0.0, 0.0, -float(gravity(LATITUDE_RAD, HEIGHT_M))])
    time_s = np.arange(1, n + 1) / RATE_HZ
    imu = Imu(
        time_s=time_s,
        gyro=rate / RATE_HZ + 1e-7 * rng.standard_normal((n, 3)),
        accelerometer=force / RATE_HZ + 1e-5 * rng.standard_normal((n, 3)),
        accelerometer_form="increment",
        temperature_c=20.0 + 1e-4 * time_s,
    )
    fixes = Fixes(
        time_s=np.arange(1.0, m + 1.0),
        latitude_rad=LATITUDE_RAD + 1e-7 * rng.standard_normal(m),
        longitude_rad=1.9 + 1e-7 * rng.standard_normal(m),
        height_m=HEIGHT_M + rng.standard_normal(m),
        velocity_n=0.02 * rng.standard_normal((m, 3)),
        valid=np.ones(m, dtype=bool),
    )
    start = Start(0.0, LATITUDE_RAD, 1.9, HEIGHT_M, attitude_rad=(0.0, 0.0, 0.0), still_until_s=600.0)
    form.write(Recording("day", "static", start, imu, gps=fixes), folder)
    return folder


@pytest.mark.parametrize("verb", ["evaluate", "diagnose"])
@pytest.mark.parametrize("kind", ["parked", "moving"])
def test_a_day_at_200_hz(days: dict[str, Path], tmp_path: Path, record_property, kind: str, verb: str) -> None:
    written = ["--output", f"{tmp_path}"] if verb == "evaluate" else ["--json", f"{tmp_path / 'answer.json'}"]
    words = [sys.executable, "-c", MEASURED, verb, f"{days[kind]}", *written, "--quiet"]
    ended = subprocess.run(words, capture_output=True, text=True, timeout=TIMEOUT_S)
    code, peak_kib = ended.stdout.split()
    record_property("peak_gb", 1024e-9 * int(peak_kib))
    assert code == "0", ended.stderr
    assert 1024e-9 * int(peak_kib) < LARGEST_GB
    if verb == "diagnose" and kind == "parked":  # the other has the errors of an instrument
        assert json.loads((tmp_path / "answer.json").read_text())["verdict"] == "no mismatch"
