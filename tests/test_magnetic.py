"""A magnetometer gives the heading of the start to those who ask for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ins_eval.errors import DataRefused, UsageError
from ins_eval.initialization.magnetic import SIGMA_RAD, with_magnetic_heading
from ins_eval.recording import Imu, Recording, Start

COLUMNS = ("mag_x", "mag_y", "mag_z")
FIELD_N = 48e3 * np.array([np.cos(np.radians(65.0)), 0.0, np.sin(np.radians(65.0))])  # nT, magnetic north and down
STEP_S, SAMPLES = 0.02, 100


def standing(roll_deg: float, pitch_deg: float, heading_deg: float, declination_deg: float) -> Recording:
    turn = Rotation.from_euler("ZYX", [heading_deg, pitch_deg, roll_deg], degrees=True)
    north = Rotation.from_euler("Z", declination_deg, degrees=True)
    field_b = np.tile(turn.inv().apply(north.apply(FIELD_N)), (SAMPLES, 1))
    force_b = np.tile(turn.inv().apply([0.0, 0.0, -9.8 * STEP_S]), (SAMPLES, 1))
    further = dict(zip(COLUMNS, field_b.T, strict=True))
    time_s = STEP_S * np.arange(1, SAMPLES + 1)
    imu = Imu(time_s, np.zeros((SAMPLES, 3)), force_b, "increment", further=further)
    return Recording("standing", "drive", Start(0.0, 0.8, 0.1, 0.0), imu)


@pytest.mark.parametrize("attitude_deg", [(0.0, 0.0, 0.0), (5.0, -8.0, 130.0), (-20.0, 15.0, -77.0), (3.0, 2.0, 179.0)])
@pytest.mark.parametrize("declination_deg", [0.0, 11.7])
def test_the_attitude_of_a_tilted_unit_comes_back(attitude_deg, declination_deg) -> None:
    recording = standing(*attitude_deg, declination_deg)
    found = with_magnetic_heading(recording, COLUMNS, np.radians(declination_deg)).start
    off = (
        Rotation.from_euler("ZYX", found.attitude_rad[::-1])
        * Rotation.from_euler("ZYX", attitude_deg[::-1], degrees=True).inv()
    )
    assert off.magnitude() < 1e-9
    assert found.attitude_sigma_rad == SIGMA_RAD


def test_an_attitude_that_is_stated_stays() -> None:
    recording = standing(0.0, 0.0, 30.0, 0.0)
    stated = replace(recording, start=replace(recording.start, attitude_rad=(0.0, 0.0, 1.0)))
    assert with_magnetic_heading(stated, COLUMNS, 0.0) is stated


def test_a_column_that_is_not_there_or_holds_no_field_is_refused() -> None:
    recording = standing(0.0, 0.0, 30.0, 0.0)
    with pytest.raises(UsageError, match=r"no column 'mag_q' for a magnetometer; did you mean"):
        with_magnetic_heading(recording, ("mag_q", *COLUMNS[1:]), 0.0)
    dead = {name: np.zeros(SAMPLES) for name in COLUMNS}
    with pytest.raises(DataRefused, match="a field that is not vertical"):
        with_magnetic_heading(replace(recording, imu=replace(recording.imu, further=dead)), COLUMNS, 0.0)
