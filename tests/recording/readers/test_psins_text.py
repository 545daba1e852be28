"""The PSINS text reader: closed-form axes and units, one sentence for every bad file, and the real recording."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from ins_eval import boundary
from ins_eval.errors import DataRefused, StorageError, UsageError
from ins_eval.readers.psins_text import read_imu_text

HEADER = ["% a comment", "", "0.5 0.25 -90.6 0 0 0", "34.25 108.9 380 100 10 9.780327", "0.1 0.1 0.1 125 125 125"]
FIRST_ROW = len(HEADER) + 1  # line in the file
ROW = "0 0 2 0 0 80"
ARCSEC_RAD = np.pi / 648000.0
EXACT = 1e-15  # relative; conversions are single products

SLOWEST_BESIDE_PANDAS = 40.0  # every line is kept with its number for what is said of it; it takes about 10
HANGS_S = 30.0
MUTATIONS = 300


def write(folder: Path, rows: list[str], header: list[str] = HEADER, end: str = "\n") -> Path:
    path = folder / "unit.imu"
    path.write_text("\n".join([*header, *rows]) + end)
    return path


def test_level_and_at_rest_reads_gravity_against_the_down_axis(tmp_path):
    """80 counts up in 10 ms are 80 * 125e-6 * g / 0.01 = 1.0 g upwards: -g along our down axis."""
    imu = read_imu_text(write(tmp_path, [ROW] * 5)).imu
    assert imu.accelerometer_form == "increment"
    np.testing.assert_allclose(imu.accelerometer / 0.01, [[0.0, 0.0, -9.780327]] * 5, rtol=EXACT)


def test_counts_become_increments_along_forward_right_down(tmp_path):
    """Right-forward-up (1, 2, 3) is forward-right-down (2, 1, -3), each channel with its own scale."""
    header = [*HEADER[:-1], "0.1 0.2 0.4 100 50 25"]
    imu = read_imu_text(write(tmp_path, ["10 20 30 40 50 60"], header)).imu
    np.testing.assert_allclose(imu.gyro, [np.array([4.0, 1.0, -12.0]) * ARCSEC_RAD], rtol=EXACT)
    np.testing.assert_allclose(imu.accelerometer, [np.array([2500.0, 4000.0, -1500.0]) * 1e-6 * 9.780327], rtol=EXACT)


@pytest.mark.parametrize(
    ("row", "axis", "meaning"),
    [
        ("0 0 -7 0 0 80", 2, "turning clockwise seen from above: heading grows"),
        ("7 0 0 0 0 80", 1, "about the right axis: the nose goes up, pitch grows"),
        ("0 7 0 0 0 80", 0, "about the forward axis: the right side goes down, roll grows"),
    ],
)
def test_a_turn_about_one_axis_has_the_sense_of_our_angle(tmp_path, row, axis, meaning):
    gyro = read_imu_text(write(tmp_path, [row])).imu.gyro[0]
    assert gyro[axis] == pytest.approx(0.7 * ARCSEC_RAD, rel=EXACT), meaning
    assert np.count_nonzero(gyro) == 1


def test_start_and_time(tmp_path):
    """Yaw -90.6 degrees counter-clockwise is heading 90.6 degrees; the first row ends one interval after t0."""
    recording = read_imu_text(write(tmp_path, [ROW] * 3))
    assert (recording.name, recording.kind) == ("unit", "static")
    start = recording.start
    np.testing.assert_allclose(np.degrees(start.attitude_rad), [0.25, 0.5, 90.6], rtol=EXACT)
    np.testing.assert_allclose(np.degrees([start.latitude_rad, start.longitude_rad]), [34.25, 108.9], rtol=EXACT)
    assert (start.height_m, start.time_s, start.velocity_n) == (380.0, 100.0, (0.0, 0.0, 0.0))
    np.testing.assert_allclose(recording.imu.time_s, [100.01, 100.02, 100.03], rtol=EXACT)


def test_notes_say_what_was_found_and_what_was_assumed(tmp_path):
    text = "\n".join(read_imu_text(write(tmp_path, [ROW] * 3)).notes)
    for said in ("3 samples at 100 Hz", "9.780327 m/s^2", "right-forward-up", "heading 90.6", "no temperature"):
        assert said in text


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_line_ends_of_every_system(tmp_path, end):
    path = tmp_path / "unit.imu"
    path.write_bytes(end.join([*HEADER, ROW, ROW, ""]).encode())
    assert len(read_imu_text(path).imu.time_s) == 2


def test_a_last_row_without_line_break_is_left_out_and_said(tmp_path):
    """'80' cut to '8' is still a number."""
    recording = read_imu_text(write(tmp_path, [ROW, "0 0 2 0 0 8"], end=""))
    assert len(recording.imu.time_s) == 1
    assert "left out" in recording.notes[-1]


def header_with(line: int, text: str) -> list[str]:
    return [text if k == line else old for k, old in enumerate(HEADER)]


BAD_CONTENT = {
    "empty": ([], [], ["is empty", "copy the file again"]),
    "comments only": ([], HEADER[:2], ["0 of 3 header lines", "copy the file again"]),
    "half a header": ([], HEADER[:4], ["2 of 3 header lines", "copy the file again"]),
    "header only": ([], HEADER, ["ends after the header", "copy the file again"]),
    "truncated last row": ([ROW, "0 0 2 0"], HEADER, [f"line {FIRST_ROW + 1}", "4 columns", "cut short"]),
    "a column too many": ([ROW, ROW + " 1", ROW], HEADER, [f"line {FIRST_ROW + 1}", "7 columns", "correct that line"]),
    "no number": ([ROW, ROW, "0 0 2 0 O 80"], HEADER, [f"line {FIRST_ROW + 2}, column 5", "'O'", "correct that line"]),
    "not a number": (["nan 0 2 0 0 80"], HEADER, [f"line {FIRST_ROW}, column 1", "'nan'", "whole count"]),
    "infinite": (["0 inf 2 0 0 80"], HEADER, [f"line {FIRST_ROW}, column 2", "'inf'", "whole count"]),
    "no whole count": (["0 0 2 0 0 80.5"], HEADER, [f"line {FIRST_ROW}, column 6", "'80.5'", "whole count"]),
    "too large": (["0 0 2 0 0 1e300"], HEADER, [f"line {FIRST_ROW}, column 6", "'1e300'", "whole count"]),
    "python's underscore": (["0 0 2 0 0 8_0"], HEADER, [f"line {FIRST_ROW}, column 6", "'8_0'", "whole count"]),
    "latitude": ([ROW], header_with(3, "134 108.9 380 0 10 9.78"), ["line 4", "latitude is 134", "correct the header"]),
    "interval of zero": ([ROW], header_with(3, "34 108 380 0 0 9.78"), ["line 4", "interval is 0", "0.1 to 1000 ms"]),
    "interval in s": ([ROW], header_with(3, "34 108 380 0 0.01 9.78"), ["line 4", "interval is 0.01", "1000 ms"]),
    "scale of zero": ([ROW], header_with(4, "0.1 0 0.1 125 125 125"), ["line 5", "gyro scale y is 0", "correct"]),
    "moving": ([ROW], header_with(2, "0 0 0 0 12 0"), ["line 3", "north velocity", "is 12", "correct"]),
    "word in the header": ([ROW], header_with(3, "34 E108 380 0 10 9.78"), ["line 4", "'E108'", "longitude"]),
    "header nan": ([ROW], header_with(3, "nan 108 380 0 10 9.78"), ["line 4", "'nan'", "latitude"]),
    "header of five": ([ROW], header_with(4, "0.1 0.1 0.1 125 125"), ["line 5", "5 columns in the header", "check"]),
}


@pytest.mark.parametrize(("rows", "header", "said"), BAD_CONTENT.values(), ids=BAD_CONTENT)
def test_bad_content_is_refused_in_one_sentence(tmp_path, rows, header, said):
    with pytest.raises(DataRefused) as refused:
        read_imu_text(write(tmp_path, rows, header))
    message = str(refused.value)
    assert "\n" not in message
    for words in ["unit.imu", "expected", *said]:
        assert words in message


def test_binary_rubbish_is_refused(tmp_path):
    path = tmp_path / "unit.imu"
    path.write_bytes(b"%\n\x89PNG\x00\x01\xff\xfe" * 50)
    with pytest.raises(DataRefused, match=r"unit\.imu, line 2: a zero byte, .*export the recording as text"):
        read_imu_text(path)
    path.write_bytes(bytes(range(128, 256)) * 50)
    with pytest.raises(DataRefused, match=r"unit\.imu.*expected three and then rows") as refused:
        read_imu_text(path)
    assert str(refused.value).isascii()


def test_a_path_that_names_no_file(tmp_path):
    with pytest.raises(UsageError, match=r"absent\.imu: there is no such file, expected a text file"):
        read_imu_text(tmp_path / "absent.imu")
    with pytest.raises(UsageError, match=r"is a folder, expected a text file in the PSINS format.*name the file in it"):
        read_imu_text(tmp_path)


def test_a_file_that_cannot_be_read(tmp_path, monkeypatch):
    path = write(tmp_path, [ROW])

    def denied(*_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(boundary, "open", denied, raising=False)
    with pytest.raises(StorageError, match=r"unit\.imu: cannot be read \(Permission denied\); check"):
        read_imu_text(path)


def test_mutated_files_are_accepted_or_refused_and_never_break(tmp_path):
    """Bytes flipped, cut out, doubled, replaced by awkward text: one sentence or a finite recording, quickly."""
    rng = np.random.default_rng(20140321)
    sound = ("\n".join([*HEADER, *[ROW, "-7 9 3 -4 0 80", "2 -4 7 0 2 84"] * 20]) + "\n").encode()
    awkward = [b"nan", b"-inf", b"1e999", b"%", b"\n", b"\r", b"\0", b"\xff\xfe", b"1_0", b"9" * 5000, b"\t", b"--"]
    path = tmp_path / "unit.imu"
    outcomes = {"accepted": 0, "refused": 0}
    for _ in range(MUTATIONS):
        content = bytearray(sound)
        for _ in range(rng.integers(1, 3)):
            a, b = np.sort(rng.integers(0, len(content) + 1, 2))
            kind = rng.integers(5)
            if kind == 0:
                content[a : a + 1] = bytes([rng.integers(256)])
            elif kind == 1:
                content[a : a + 1] = b"%d" % rng.integers(10)
            elif kind == 2:
                del content[a : min(b, a + 40)]
            elif kind == 3:
                content[a:a] = content[a : min(b, a + 200)]
            else:
                content[a:a] = awkward[rng.integers(len(awkward))]
        path.write_bytes(content)
        began = time.perf_counter()
        try:
            recording = read_imu_text(path)
        except DataRefused as refused:
            outcomes["refused"] += 1
            assert "unit.imu" in str(refused) and "\n" not in str(refused) and len(str(refused)) < 600
        else:
            outcomes["accepted"] += 1
            assert np.isfinite(recording.imu.gyro).all() and np.isfinite(recording.imu.accelerometer).all()
        assert time.perf_counter() - began < HANGS_S
    assert min(outcomes.values()) > MUTATIONS // 20, outcomes


class TestRealRecording:
    """Against what its documentation states: SOURCE.md beside the file."""

    DOCUMENTED_GYRO_DEG_PER_H = [0.070, -12.363, -8.365]  # 1020-1500 s, turned to forward-right-down
    DOCUMENTED_FORCE_MPS2 = 9.795501
    LAST_DIGIT = 1.0

    def test_means_of_the_documented_quiet_part(self, laser_gyro):
        imu = read_imu_text(laser_gyro).imu
        assert imu.gyro.shape == (184718, 3)
        quiet = (imu.time_s > 1020.0) & (imu.time_s <= 1500.0)
        rate = np.degrees(imu.gyro[quiet].sum(axis=0) / 480.0) * 3600.0
        force = imu.accelerometer[quiet].sum(axis=0) / 480.0
        np.testing.assert_allclose(rate, self.DOCUMENTED_GYRO_DEG_PER_H, atol=1e-3 * self.LAST_DIGIT)
        assert np.linalg.norm(force) == pytest.approx(self.DOCUMENTED_FORCE_MPS2, abs=1e-6 * self.LAST_DIGIT)

    def test_is_read_quickly(self, laser_gyro):
        began = time.process_time()
        read_imu_text(laser_gyro)
        ours_s, began = time.process_time() - began, time.process_time()
        pd.read_csv(laser_gyro, sep=r"\s+", header=None, names=range(16), comment="%")
        assert ours_s < SLOWEST_BESIDE_PANDAS * (time.process_time() - began)
