"""``ins-eval compare`` from a folder on disk to numbers, words and figures."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ins_eval.commands import compare
from ins_eval.errors import DataRefused
from ins_eval.profile import HeightChange, Place, Profile, SpeedChange, Thermal, Turn
from ins_eval.recording import Fixes, Imu, Recording, Start, form
from ins_eval.recording.belief import AccelerometerBelief, GyroBelief, ReferenceBelief
from ins_eval.trajectory import Trajectory
from ins_eval.units import DEG, DEG_PER_H, UG
from tests.beliefs import navigation_grade

RATE_HZ = 50.0
BIAS_RADPS, BIAS_MPS2 = np.array([1e-3, -5e-4, 2e-4]), np.array([0.03, -0.02, 0.01])
SCALE_ERROR = 2e-3  # of gyro x
OFFSET_S = 0.025
NOISE = np.array([1e-5, 1e-5, 1e-5, 1e-3, 1e-3, 1e-3])  # of a sample
PLACE = Place(latitude_deg=34.2, longitude_deg=108.9, height_m=380.0, heading_deg=40.0, stand_s=0.0)


@pytest.fixture(scope="module")
def flight() -> Recording:
    """A flight with turns, a reference at 10 Hz whose clock is 25 ms ahead, and an IMU with known errors."""
    trajectory = Trajectory(
        Profile(
            name="turns",
            duration_s=200.0,
            start=PLACE,
            speed=(SpeedChange(from_s=0.0, to_s=40.0, to_mps=80.0, edge_s=10.0),),
            height=(HeightChange(from_s=20.0, to_s=180.0, to_m=900.0, edge_s=30.0),),
            turn=tuple(
                Turn(at_s=45.0 + 30.0 * k, by_deg=40.0 * (-1) ** k, bank_deg=35.0, edge_s=6.0) for k in range(5)
            ),
            thermal=Thermal(self_heating_c=0.0),
        )
    )
    true, rng = trajectory.increments(RATE_HZ), np.random.default_rng(1)
    gyro = true.dtheta_b * [1.0 + SCALE_ERROR, 1.0, 1.0] + BIAS_RADPS / RATE_HZ
    velocity = true.dv_b + BIAS_MPS2 / RATE_HZ
    noise = NOISE * rng.standard_normal((true.time_s.size, 6))
    epochs = trajectory.truth(np.arange(0.0, 200.05, 0.1))
    reference = Fixes(
        epochs.time_s + OFFSET_S,
        epochs.latitude_rad,
        epochs.longitude_rad,
        epochs.height_m,
        epochs.velocity_n,
        np.ones(epochs.time_s.size, dtype=bool),
        epochs.attitude_rad,
    )
    return Recording(
        name="turns",
        kind="flight",
        start=start(attitude_rad=(0.0, 0.0, 40.0 * DEG)),
        imu=Imu(true.time_s, gyro + noise[:, :3], velocity + noise[:, 3:], "increment"),
        reference=reference,
    )


@pytest.fixture(scope="module")
def parked() -> Recording:
    """Ten minutes at rest of a navigation-grade unit: 0.05 deg/h and 100 ug off on z."""
    profile = Profile(name="parked", kind="static", duration_s=600.0, start=PLACE, thermal=Thermal(self_heating_c=0.0))
    true, rng = Trajectory(profile).increments(RATE_HZ), np.random.default_rng(2)
    noise = 1e-8 * rng.standard_normal(true.dtheta_b.shape)
    gyro = true.dtheta_b + np.array([0.0, 0.0, 0.05 * DEG_PER_H]) / RATE_HZ + noise
    velocity = true.dv_b + np.array([0.0, 0.0, 100.0 * UG]) / RATE_HZ
    velocity = velocity + 1e-6 * rng.standard_normal(velocity.shape)
    return Recording("parked", "static", start(), Imu(true.time_s, gyro, velocity, "increment"))


def start(**more) -> Start:
    return Start(0.0, PLACE.latitude_deg * DEG, PLACE.longitude_deg * DEG, PLACE.height_m, **more)


def compared(recording: Recording, folder: Path, **options) -> dict:
    """Write, compare, and give the metrics; the answer is under ``"answer"``."""
    form.write(recording, folder / "recording")
    assert compare.run(folder / "recording", folder / "report", True, **options) == 0
    assert (folder / "report" / "index.html").is_file()
    metrics = json.loads((folder / "report" / "metrics.json").read_text())
    words = " ".join((folder / "report" / "report.txt").read_text().split())
    return metrics | {"answer": words.split(" Comparison: ")[0], "words": words}


def holds(estimate: dict, value: float) -> bool:
    low, high = estimate["interval95"]
    margin = 0.5 * (high - low)  # 24 intervals are looked at, so that some miss by a little
    return low - margin <= value <= high + margin


def test_flight_with_the_clock_found(flight, tmp_path):
    result = compared(flight, tmp_path, use_found_offset=True)
    assert result["clock"]["found_s"] == pytest.approx(OFFSET_S, abs=1e-3)
    assert result["clock"]["used_s"] == result["clock"]["found_s"] and result["clock"]["believed_s"] == 0.0
    for k, axis in enumerate("xyz"):
        assert holds(result["gyro"][axis]["bias"] or result["gyro"][axis]["mean_difference"], BIAS_RADPS[k])
    assert holds(result["gyro"]["x"]["scale_error"], SCALE_ERROR)
    assert result["accelerometer"]["x"]["mean_difference"]["value"] == pytest.approx(BIAS_MPS2[0], abs=2e-3)
    assert result["reference"]["window_s"] == pytest.approx(1.0)
    assert result["reference"]["epoch_spacing_s"] == pytest.approx(0.1)
    assert "°/s high on x" in result["answer"] and "The offset found was used" in result["words"]
    drawn = {path.stem for path in (tmp_path / "report" / "figures").iterdir()}
    assert drawn == {"sensor_signals", "sensor_residuals", "sensor_scatter"}


def test_an_offset_found_is_only_reported_unless_asked_for(flight, tmp_path):
    result = compared(flight, tmp_path)
    assert result["clock"]["used_s"] == 0.0
    assert "the two clocks differ by 2" in result["answer"] and "with the clock set right" in result["answer"]
    assert "set time_offset_s = 0.02" in result["words"]
    rms = result["gyro"]["x"]["rms"]
    assert rms["after_fit_found_clock"] < 0.5 * rms["after_fit"]


def test_beliefs_are_used_and_held_against_what_is_found(flight, tmp_path):
    belief = navigation_grade(
        reference=ReferenceBelief(time_offset_s=OFFSET_S),
        gyro=GyroBelief(bias_radps=(8e-4, 0.0, 0.0)),
        accelerometer=AccelerometerBelief(bias_mps2=(0.0, -0.02, 0.0)),
    )
    result = compared(replace(flight, belief=belief), tmp_path)
    assert result["clock"]["used_s"] == OFFSET_S
    low, high = result["clock"]["interval95_s"]
    assert low <= OFFSET_S <= high and "which agrees" in result["words"]
    assert result["gyro"]["x"]["found_minus_believed"]["value"] == pytest.approx(2e-4, abs=2e-5)
    assert holds(result["accelerometer"]["y"]["found_minus_believed"], 0.0)
    assert "found_minus_believed" not in result["gyro"]["y"]
    assert "found minus believed" in result["words"]


def test_standstill_is_aligned_and_gives_no_scale_factor(parked, tmp_path):
    result = compared(parked, tmp_path)
    assert result["reference"]["kind"] == "standstill" and result["reference"]["attitude"] == "aligned"
    assert result["clock"]["found_s"] is None
    assert result["accelerometer"]["z"]["mean_difference"]["value"] == pytest.approx(100.0 * UG, abs=2.0 * UG)
    for sensor in ("gyro", "accelerometer"):
        for channel in result[sensor].values():
            assert channel["scale_error"] is None and channel["bias"] is None
    assert "No scale factor of any channel is given" in result["answer"]
    assert "went into it" in result["words"]
    assert not (tmp_path / "report" / "figures" / "sensor_scatter.svg").exists()


def test_a_given_attitude_with_its_sigma_is_taken(parked, tmp_path):
    attitude = start(attitude_rad=(0.0, 0.0, 40.0 * DEG), attitude_sigma_rad=(1e-4, 1e-4, 1e-3))
    result = compared(replace(parked, start=attitude), tmp_path)
    assert result["reference"]["attitude"] == "given"
    assert result["gyro"]["z"]["mean_difference"]["value"] == pytest.approx(0.05 * DEG_PER_H, abs=0.01 * DEG_PER_H)
    assert "below 100 µg" in result["words"]  # 1e-4 rad of gravity


def test_what_is_not_known_to_move_somehow_is_refused(flight, parked, tmp_path):
    refused = {
        "position only": replace(flight, reference=None, gps=replace(flight.reference, attitude_rad=None)),
        "nothing": replace(flight, reference=None),
    }
    for name, recording in refused.items():
        form.write(recording, tmp_path / name)
        with pytest.raises(DataRefused, match="has no reference with attitude"):
            compare.run(tmp_path / name, tmp_path / "report", True)
    counts = replace(parked.imu, accelerometer=np.round(parked.imu.accelerometer * 1e4), accelerometer_form="pulse")
    form.write(replace(parked, imu=counts), tmp_path / "pulses")
    with pytest.raises(DataRefused, match="does not say what one is worth"):
        compare.run(tmp_path / "pulses", tmp_path / "report", True)
    assert not (tmp_path / "report").exists()
