"""A start that is stated far from the truth: by what it is turned, against the truth of the simulation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmark.worlds.cases import a_recording as of_navigation_grade
from benchmark.worlds.cases import a_unit
from benchmark.worlds.grades import a_recording as of_grade
from benchmark.worlds.grades import cut
from benchmark.worlds.record import Made
from ins_eval.believed import believed
from ins_eval.effects.start import ROTATIONS
from ins_eval.error_model import geometry
from ins_eval.estimation.case import prepare
from ins_eval.estimation.description import wrong_descriptions
from ins_eval.estimation.stated_start import _of_further_turn, wrong_start
from ins_eval.interface.diagnose import diagnose
from ins_eval.recording import form
from ins_eval.units import ARCSEC, DEG_PER_H

RATE_HZ = 20.0
GRADES = ("navigation", "industrial")
STATED_SIGMA_DEG, SIGMAS = 0.1, 4.0  # of a start; of what is found
STOOD_S, PITCH_DEG = 300.0, -20.0
STEPS_AT_S, STEP_DEG_PER_H, STEP_ENDS_S = 200.0, 3000.0, 500.0
SIGN, EXCHANGED = "recording.axis_sign", "recording.axes_exchanged"
X_WITH_Y = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
RIGHT_FORWARD_UP = np.diag([1.0, 1.0, -1.0]) @ X_WITH_Y
SMALL_RAD = 1e-6  # of a numerical derivative


def made(grade: str, trajectory: str = "drive", seed: int = 5) -> Made:
    rng = np.random.default_rng(seed)
    if grade != "navigation":
        return of_grade(rng, grade, trajectory, RATE_HZ)
    return of_navigation_grade(rng, a_unit(rng, "plain", pulses=False), trajectory, RATE_HZ, (), False, ())


@pytest.mark.parametrize(
    ("grade", "off_deg"),
    [
        ("navigation", (0.0, 0.0, 0.0)),
        ("navigation", (0.0, 15.0, 20.0)),
        ("industrial", (0.0, 0.0, 0.0)),
        pytest.param("industrial", (-25.0, 0.0, 0.0), marks=pytest.mark.slow),
        ("industrial", (0.0, 0.0, 9.0)),
        pytest.param("industrial", (0.0, 4.0, 0.0), marks=pytest.mark.slow),
        *(
            pytest.param(grade, off_deg, marks=pytest.mark.slow)
            for grade in GRADES
            for off_deg in [(170.0, 0.0, 0.0), (0.0, -12.0, 0.0), (0.0, 0.0, 170.0), (60.0, 0.0, 90.0)]
        ),
    ],
)
def test_a_start_that_is_stated_far_from_the_truth(tmp_path, grade: str, off_deg: tuple[float, ...]) -> None:
    """Nothing where the truth is stated."""
    one = made(grade)
    one.save(tmp_path / "drive")
    recording = believed(form.read(tmp_path / "drive"))
    true_rad = np.array(one.felt.truth.state(np.array([recording.start.time_s]))[2][0])
    stated_rad = tuple(true_rad + np.radians(off_deg))
    sigma_rad = np.radians(STATED_SIGMA_DEG)
    start = replace(recording.start, attitude_rad=stated_rad, attitude_sigma_rad=(sigma_rad,) * 3)
    recording = replace(recording, start=start)
    found = wrong_start(recording, prepare(recording))
    off = dict(zip(ROTATIONS, geometry.turn(stated_rad, true_rad) / ARCSEC, strict=True))
    assert {(one.effect.name, one.effect.axis) for one in found} == {key for key, phi in off.items() if abs(phi) > 1.0}
    for one in found:
        assert abs(one.effect.value - off[one.effect.name, one.effect.axis]) < SIGMAS * one.sigma


def test_a_gyro_that_steps_does_not_turn_the_start(tmp_path) -> None:
    """As with one bias the whole drive shows a start 75 degrees off; with the step that is found it is as stated."""
    one = made("industrial")
    cut(one, 0.0, STEP_ENDS_S)
    one.save(tmp_path / "read")
    recording = form.read(tmp_path / "read")
    attitude_rad = tuple(one.felt.truth.state(np.array([recording.start.time_s]))[2][0])
    sigma_rad = (np.radians(STATED_SIGMA_DEG),) * 3
    gyro = recording.imu.gyro.copy()
    gyro[recording.imu.time_s > STEPS_AT_S, 2] += STEP_DEG_PER_H * DEG_PER_H / RATE_HZ
    start = replace(recording.start, attitude_rad=attitude_rad, attitude_sigma_rad=sigma_rad)
    folder = form.write(replace(recording, start=start, imu=replace(recording.imu, gyro=gyro)), tmp_path / "steps")
    effects = diagnose([folder]).found.answer["effects"]
    assert not [each for each in effects if each["name"].startswith("alignment.")]
    low, high = next(each["parameters"]["interval95"] for each in effects if each["name"] == "gyro.bias_step")
    assert low < STEP_DEG_PER_H < high


def test_a_parked_unit_that_is_stated_to_lie_otherwise(recording_at_rest) -> None:
    """Gravity shows the level of it; its heading is believed, for no gyro of that grade shows it."""
    parked = recording_at_rest(STOOD_S, 3, np.zeros_like)
    true_rad, sigma_rad = np.zeros(3), np.radians(STATED_SIGMA_DEG)
    for pitch_deg in (0.0, PITCH_DEG):
        stated_rad = (0.0, float(np.radians(pitch_deg)), 0.0)
        start = replace(parked.start, attitude_rad=stated_rad, attitude_sigma_rad=(sigma_rad,) * 3)
        recording = replace(parked, start=start)
        found = wrong_start(recording, prepare(recording))
        if not pitch_deg:
            assert found == []
    (one,) = found
    assert (one.effect.name, one.effect.axis) == ("alignment.level", "east")
    assert abs(one.effect.value - geometry.turn(stated_rad, true_rad)[1] / ARCSEC) < SIGMAS * one.sigma


def test_a_small_turn_after_a_large_one_moves_the_rotation_vector() -> None:
    for large in ([0.3, -0.2, 0.1], [1.0, 2.0, -1.5]):
        moved = (Rotation.from_rotvec(SMALL_RAD * np.eye(3)) * Rotation.from_rotvec(large)).as_rotvec() - large
        np.testing.assert_allclose(moved.T / SMALL_RAD, _of_further_turn(np.array(large)), atol=10.0 * SMALL_RAD)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("accelerometer", "gyro", "named"),
    [
        (RIGHT_FORWARD_UP, RIGHT_FORWARD_UP, [(EXCHANGED, "x"), (SIGN, "z")] * 2),
        (X_WITH_Y, np.eye(3), [(EXCHANGED, "x")]),
    ],
)
def test_axes_are_wrong_where_the_start_would_be_turned_by_right_angles(tmp_path, accelerometer, gyro, named) -> None:
    """A start is stated to a part of a degree: it is not upside down, and another order of the axes fits as well."""
    made("navigation", "climb, cruise, landing", 3).save(tmp_path / "flight")
    read = form.read(tmp_path / "flight")
    imu = replace(read.imu, accelerometer=read.imu.accelerometer @ accelerometer.T, gyro=read.imu.gyro @ gyro.T)
    found, _ = wrong_descriptions(replace(read, imu=imu))
    assert [(one.effect.name, one.effect.axis) for one in found] == named
