"""The PSINS .mat reader: a motion in closed form comes back in our axes; the real drive has its documented numbers."""

from __future__ import annotations

import numpy as np
import pytest

from ins_eval.errors import DataRefused
from ins_eval.readers import FORMATS, doctor, read
from ins_eval.recording.validation import validate

ROUNDING = 1e-9
INTEGRATION = 1e-6  # of the trapezoid with steps of 1 ms, in rad and m/s over 10 ms


def written(folder, content: bytes):
    path = folder / "drive.mat"
    path.write_bytes(content)
    return path


def test_a_known_motion_comes_back_in_forward_right_down(tmp_path, made, weaving):
    recording = read("psins-mat", written(tmp_path, made.psins_mat(lasted_s=20.0)), {})
    motion = weaving(100.0, 20.0)
    assert (recording.kind, recording.name) == ("drive", "drive")
    first = 10  # the reference begins at 0.1 s
    assert recording.start.time_s == pytest.approx(0.1, abs=ROUNDING)
    middle = 0.01 * 0.5 * (motion.rate_b[1:] + motion.rate_b[:-1])[first:]
    np.testing.assert_allclose(recording.imu.gyro, middle, atol=INTEGRATION)
    felt = 0.01 * 0.5 * (motion.force_b[1:] + motion.force_b[:-1])[first:]
    np.testing.assert_allclose(recording.imu.accelerometer, felt, atol=INTEGRATION)
    np.testing.assert_allclose(recording.start.attitude_rad, motion.attitude[first], atol=ROUNDING)
    np.testing.assert_allclose(recording.start.velocity_n, motion.velocity_n[first], atol=ROUNDING)
    np.testing.assert_allclose(recording.reference.velocity_n, motion.velocity_n[first::10], atol=ROUNDING)
    np.testing.assert_allclose(recording.reference.attitude_rad[:, :2], motion.attitude[first::10, :2], atol=ROUNDING)


def test_the_authors_constants_become_beliefs_in_our_axes(tmp_path, made):
    belief = read("psins-mat", written(tmp_path, made.psins_mat(lasted_s=5.0)), {}).belief
    assert belief.gyro.bias_radps == pytest.approx((2e-3, 1e-3, -3e-3))
    assert belief.accelerometer.bias_mps2 == pytest.approx((0.2, 0.1, -0.3))
    turned = read("psins-mat", written(tmp_path, made.psins_mat(lasted_s=5.0)), {"axes": "FRD"}).belief
    assert turned.gyro.bias_radps == pytest.approx((1e-3, 2e-3, 3e-3))


def test_a_planted_clock_offset_is_found_and_applied_only_if_assumed(tmp_path, made):
    path = written(tmp_path, made.psins_mat(offset_s=0.04))
    recording = doctor.examine(read("psins-mat", path, {}), {}, FORMATS["psins-mat"].keys)
    assert recording.belief.reference.time_offset_s == 0.0
    assert "same instant are +0.0400" in "\n".join(recording.notes)
    believing = read("psins-mat", path, {"reference.time_offset_s": "0.04"})
    assert believing.belief.reference.time_offset_s == 0.04
    assert recording.start.time_s == pytest.approx(0.14, abs=ROUNDING)  # where the stamp is taken for the IMU's
    assert believing.start.time_s == pytest.approx(0.10, abs=ROUNDING)


def spoilt(made, **changes) -> bytes:
    n = 60
    mimu = np.column_stack([np.zeros((n, 5)), np.full(n, 0.098), 0.01 * np.arange(n)])
    fogavp = np.column_stack([np.zeros((5, 6)), np.full((5, 2), 0.6), np.zeros(5), 0.1 * np.arange(1, 6)])
    variables = {"mimu": mimu, "fogavp": fogavp} | changes
    return made.matlab(**{name: value for name, value in variables.items() if value is not None})


def nan_in(table: np.ndarray, row: int) -> np.ndarray:
    table = table.copy()
    table[row, 1] = np.nan
    return table


BAD = {
    "no mimu": ({"mimu": None}, "has no variable mimu"),
    "no reference": ({"fogavp": None}, "has no variable fogavp"),
    "columns": ({"mimu": np.zeros((60, 6))}, "has shape .60, 6. .*expected rows of 7 numbers"),
    "text": ({"mimu": "rubbish"}, "expected rows of 7 numbers"),
    "empty": ({"mimu": np.zeros((0, 7))}, "0 rows, expected at least three"),
    "same stamps": ({"mimu": np.zeros((60, 7))}, "row 2: time repeats"),
    "no overlap": ({"fogavp": np.column_stack([np.zeros((5, 9)), 9.0 + np.arange(5)])}, "expected an overlap"),
    "degrees": ({"fogavp": np.column_stack([np.full((5, 9), 34.0), np.arange(1, 6)])}, "it looks like degrees"),
    "unsorted": ({"fogavp": np.zeros((5, 10))}, "epoch 2: time goes from 0 to 0 s"),
    "nan": ({"fogavp": np.full((5, 10), np.nan)}, "not finite; remove these rows"),
    "bias": ({"eb0": np.zeros(2)}, "eb0 has shape .*expected three finite numbers"),
}


@pytest.mark.parametrize(("changes", "said"), BAD.values(), ids=BAD)
def test_bad_content_is_refused(tmp_path, made, changes, said):
    with pytest.raises(DataRefused, match=said):
        read("psins-mat", written(tmp_path, spoilt(made, **changes)), {})


@pytest.mark.parametrize("content", [b"rubbish" * 100, b"MATLAB 5.0 MAT-file" + bytes(200)])
def test_what_is_no_matlab_file_is_refused(tmp_path, content):
    with pytest.raises(DataRefused, match="cannot be read as a MATLAB version 5 file|has no variable mimu"):
        read("psins-mat", written(tmp_path, content), {})


@pytest.fixture(scope="module")
def recorded(real):
    path = real("fog_mems_vehicle/transfer_align_fog_mems.mat")
    return validate(doctor.examine(read("psins-mat", path, {}), {}, FORMATS["psins-mat"].keys))


class TestRealRecording:
    """Against SOURCE.md beside the file."""

    def test_rows_and_rates(self, recorded):
        assert len(recorded.imu.time_s) == 10001 - 11  # those after the reference's first epoch at 0.1 s
        assert np.median(np.diff(recorded.imu.time_s)) == pytest.approx(0.01, rel=1e-6)
        assert len(recorded.reference.time_s) == 1000
        assert np.median(np.diff(recorded.reference.time_s)) == pytest.approx(0.1, rel=1e-6)

    def test_place_and_motion(self, recorded):
        assert np.degrees(recorded.start.latitude_rad) == pytest.approx(34.43, abs=0.01)
        assert np.degrees(recorded.start.longitude_rad) == pytest.approx(111.43, abs=0.01)
        assert recorded.reference.height_m[[0, -1]] == pytest.approx([173.0, 156.0], abs=1.0)
        north = recorded.reference.velocity_n[:, 0]
        assert (north > 10.9).all() and (north < 16.1).all()
        roll = np.degrees(recorded.reference.attitude_rad[:, 0])
        assert np.abs(roll).max() == pytest.approx(33.0, abs=0.5)

    def test_believed_biases_are_the_documented_ones(self, recorded):
        assert recorded.belief.gyro.bias_radps == pytest.approx((0.000771, -0.001036, -0.000410), abs=1e-6)
        assert recorded.belief.accelerometer.bias_mps2 == pytest.approx((-0.0709, 0.0283, 0.0460), abs=1e-4)

    def test_the_believed_gyro_bias_is_the_one_that_the_reference_shows(self, recorded):
        """Heading and tilt of the reference hardly change between two instants far apart: what is left is bias."""
        found = recorded.imu.gyro.sum(axis=0) / (recorded.imu.time_s[-1] - recorded.start.time_s)
        np.testing.assert_allclose(found[0], recorded.belief.gyro.bias_radps[0], atol=5e-4)

    def test_the_clocks_differ_by_15_ms(self, recorded):
        """The MEMS clock is behind by 15 ms; 5 of them depend on whether a stamp is the start or the end of a step."""
        warning = next(note for note in recorded.notes if note.startswith("Warning"))
        assert float(warning.split("same instant are ")[1].split(" ")[0]) == pytest.approx(0.015, abs=0.005)
