"""What is believed of a start that motion shows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmark.worlds.grades import a_recording
from ins_eval.believed import believed
from ins_eval.effects.vocabulary import VOCABULARY
from ins_eval.error_model import null
from ins_eval.recording import form

RATE_HZ, SEED = 20.0, 6
USUAL_SIZES, SIGMAS, FAR = 10.0, 3.0, 5.0  # of a lean; within which it lies, and beyond which it would without


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    folder = tmp_path_factory.mktemp("worlds") / "drive"
    a_recording(np.random.default_rng(SEED), "industrial", "drive", RATE_HZ).save(folder)
    recording = form.read(folder, doubted=True)
    return replace(recording, start=replace(recording.start, attitude_rad=None, attitude_sigma_rad=None))


def test_a_heading_that_motion_shows_covers_accelerometers_that_lean(drive) -> None:
    """Accelerometer y leans towards x: what it feels of the way ahead seems to be another heading."""
    accelerometer = drive.imu.accelerometer.copy()
    coarse = drive.belief.accelerometer.bias_sigma_ug / VOCABULARY["accelerometer.bias"].nominal
    lean = USUAL_SIZES * coarse * 1e-6 * VOCABULARY["accelerometer.misalignment"].nominal
    accelerometer[:, 1] += lean * accelerometer[:, 0]
    imu = replace(drive.imu, accelerometer=accelerometer)
    level, leaning = (null.believe(believed(one)) for one in (drive, replace(drive, imu=imu)))
    shift = abs(leaning.start.attitude_rad[2] - level.start.attitude_rad[2])
    assert shift > FAR * leaning.found.sigmas[null.ATTITUDE][2]
    assert shift < SIGMAS * leaning.attitude_sigma_n[2]
