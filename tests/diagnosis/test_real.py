"""What the null says of real recordings: beside it stand numbers that need no error model. Skipped where they are not.

Sources of the recordings and what is documented of them: `SOURCE.md` beside each.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ins_eval.diagnosis import case as cases
from ins_eval.diagnosis.case import Case
from ins_eval.diagnosis.columns import Column, Drive, Measured, Missing
from ins_eval.diagnosis.evidence import log_evidence
from ins_eval.diagnosis.noise import Fitted
from ins_eval.diagnosis.whitening import Whitened
from ins_eval.errors import DataRefused
from ins_eval.recording import Recording
from ins_eval.recording.belief import EarthBelief
from ins_eval.recording.quiet import quiet_stretches
from ins_eval.recording.readers import apm_mat, psins_mat, psins_text
from ins_eval.units import DEG, DEG_PER_H

RECORDINGS = Path(__file__).parents[3] / "shared" / "recordings"
LASER = RECORDINGS / "rlg_static_vehicle" / "lasergyro.imu"
FOG_MEMS = RECORDINGS / "fog_mems_vehicle" / "transfer_align_fog_mems.mat"

# by cross-correlation of the two boxes' turn rates, without any navigation; half of the recording apart 0.3 ms
STAMPS_LATE_S, STAMPS_AGREE_S = 0.0155, 0.0005
AUTHORS_BIAS_FRD = np.array([0.00077050, -0.00103577, -0.00040954])  # rad/s
BIAS_AGREES = 1e-4
HEADING_DEG, HEADING_AGREES_DEG = 90.6, 0.6
FRACTION_AGREES = 0.015
WHITE_RMS = (0.6, 1.4)
LEVEL_SIGMA_DEG, HEADING_SIGMA_DEG = 0.02, 2.0
RIVAL_BIAS_SIGMA = 10.0 * DEG_PER_H  # of three constant gyro biases instead of the Earth


def real(path: Path) -> Path:
    if not path.is_file():
        pytest.skip(f"{path} is not here")
    return path


def solved(case: Case, centre: np.ndarray | None = None) -> tuple[Fitted, np.ndarray]:
    """Noise and nuisances at their best; the prior of the last nuisances is around `centre` instead of 0."""
    count = len(case.nuisances)
    mean = np.zeros(count)
    if centre is not None:
        mean[count - centre.size :] = centre

    def around(sums: Whitened) -> Whitened:
        a, b = sums.normal, sums.projection
        return replace(sums, projection=b - a @ mean, square=sums.square - 2.0 * mean @ b + mean @ a @ mean)

    fitted = case.fitted(gain=lambda sums: log_evidence(around(sums)))
    sums = around(fitted.whitened)
    return fitted, mean + np.linalg.solve(np.eye(count) + sums.normal, sums.projection)


def with_columns(case: Case, *columns: Column) -> Case:
    return replace(case, nuisances=(*case.nuisances, *columns))


def place(case: Case, name: str) -> int:
    return [column.name for column in case.nuisances].index(name)


# ---------------------------------------------------------------- MEMS beside a fibre-optic navigator


@pytest.fixture(scope="module")
def vehicle() -> Recording:
    return psins_mat.read(real(FOG_MEMS), {})


def moved_stamps(recording: Recording, late_s: float) -> Recording:
    reference = recording.belief.reference.model_copy(update={"time_offset_s": late_s})
    return replace(recording, belief=recording.belief.model_copy(update={"reference": reference}))


BOXES = tuple(Column(f"box {axis}", (Measured(f"mount_{axis}", 0.01),)) for axis in "xyz")
LATE = Column("late", (Measured("delay", 0.02),))


def test_the_clocks_of_two_boxes(vehicle) -> None:
    late_s = 0.0
    for _ in range(2):  # the column is linear in a delay through which the box turns
        case = with_columns(cases.prepare(moved_stamps(vehicle, late_s)), *BOXES, LATE)
        _, found = solved(case)
        late_s += 0.02 * found[-1]
    assert late_s == pytest.approx(STAMPS_LATE_S, abs=STAMPS_AGREE_S)


def test_biases_and_a_white_remainder_once_clocks_and_boxes_agree(vehicle) -> None:
    case = with_columns(cases.prepare(moved_stamps(vehicle, STAMPS_LATE_S)), *BOXES)
    fitted, found = solved(case)
    sigma = vehicle.belief.gyro.bias_sigma_deg_per_h * DEG_PER_H
    own = np.array([found[place(case, f"turn-on bias of gyro {axis}")] for axis in "xyz"]) * sigma
    bias = np.asarray(vehicle.belief.gyro.bias_radps) + own
    np.testing.assert_allclose(bias, AUTHORS_BIAS_FRD, atol=BIAS_AGREES)
    whitened = case.whitened([], fitted.position, keep=found.size + 1)
    innovations = whitened.kept[..., 0] - whitened.kept[..., 1:] @ found
    rms = np.sqrt(np.nanmean(innovations[:, 3:] ** 2, axis=0))
    assert np.all((rms > WHITE_RMS[0]) & (rms < WHITE_RMS[1])), rms


# ---------------------------------------------------------------- parked laser gyros, the Earth not believed to turn


@pytest.fixture(scope="module")
def quiet() -> Recording:
    """The longest quiet stretch, level by its accelerometers, heading as documented."""
    whole = psins_text.read(real(LASER), {})
    stretch = max(quiet_stretches(whole.imu), key=lambda s: s.duration_s)
    imu = whole.imu
    rows = (imu.time_s > stretch.start_s) & (imu.time_s <= stretch.end_s)
    x, y, z = -imu.accelerometer[rows].mean(axis=0)
    start = replace(
        whole.start,
        time_s=stretch.start_s,
        attitude_rad=(float(np.arctan2(y, z)), float(np.arctan2(-x, np.hypot(y, z))), HEADING_DEG * DEG),
        attitude_sigma_rad=(LEVEL_SIGMA_DEG * DEG, LEVEL_SIGMA_DEG * DEG, HEADING_SIGMA_DEG * DEG),
    )
    some = replace(imu, time_s=imu.time_s[rows], gyro=imu.gyro[rows], accelerometer=imu.accelerometer[rows])
    return replace(whole, imu=some, start=start)


def test_the_earth_turns_at_its_rate_and_north_is_where_it_was(quiet) -> None:
    case = with_columns(cases.prepare(quiet), Column("fraction", (Missing("rotation", 0.05),)))
    _, found = solved(case)
    assert 0.05 * found[-1] == pytest.approx(0.0, abs=FRACTION_AGREES)  # of what the equations have too little
    heading = HEADING_DEG + HEADING_SIGMA_DEG * found[place(case, "start attitude D")]  # phi = true less believed
    assert heading == pytest.approx(HEADING_DEG, abs=HEADING_AGREES_DEG)


def test_a_wrong_heading_is_turned_back(quiet) -> None:
    off_deg = 3.0
    roll, pitch, heading = quiet.start.attitude_rad
    start = replace(quiet.start, attitude_rad=(roll, pitch, heading + off_deg * DEG))
    case = cases.prepare(replace(quiet, start=start))
    _, found = solved(case)
    phi_deg = HEADING_SIGMA_DEG * found[place(case, "start attitude D")]
    assert phi_deg == pytest.approx(-off_deg, abs=HEADING_AGREES_DEG)


def test_one_rotation_is_more_probable_than_three_biases_that_fit_as_well(quiet) -> None:
    """Each by its own mechanization, on one white noise: a column of the whole Earth rate is no longer small."""
    earth = cases.prepare(quiet)
    rate = quiet.imu.gyro.mean(axis=0) * 100.0
    belief = quiet.belief.model_copy(
        update={
            "earth": EarthBelief(rotation=False),
            "gyro": quiet.belief.gyro.model_copy(update={"bias_radps": tuple(float(w) for w in rate)}),
        }
    )
    still = cases.prepare(replace(quiet, belief=belief))
    still = replace(still, noise=replace(still.noise, white=earth.noise.white))
    columns = [Column(f"bias {axis}", (Drive("gyro", axis, "1", RIVAL_BIAS_SIGMA),)) for axis in range(3)]
    with_earth, _ = solved(earth)
    with_biases, _ = solved(with_columns(still, *columns), -rate / RIVAL_BIAS_SIGMA)
    assert 5.0 < with_earth.log_evidence - with_biases.log_evidence < 20.0


# ---------------------------------------------------------------- what cannot be followed


def test_an_autopilot_that_hardly_knows_its_attitude_is_refused_in_one_sentence() -> None:
    recording = apm_mat.read(real(RECORDINGS / "plane_flight_gps_latency" / "TestLog2.mat"), {})
    with pytest.raises(DataRefused, match="the attitude may be 104 degrees off before the end"):
        cases.prepare(recording)
