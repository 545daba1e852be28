"""Formats that cannot become a recording: sound files are refused with the reason, bad ones with their fault."""

from __future__ import annotations

import gzip

import numpy as np
import pytest

from ins_eval.errors import DataRefused
from ins_eval.readers import read

ROCKET = "ts,id,Ax,Ay,Az,Gx,Gy,Gz\n" + "".join(f"{0.01 * k - 0.05:.3f},IMU0,0,-9.8,0,1,2,3\n" for k in range(50))
CHAMBER = "".join(f"42652,12.0,17.0,{1008 + k % 3},{-18.2 + 0.01 * k:.2f}\n" for k in range(50))


def refusal(format_name: str, path, content: bytes) -> str:
    path.write_bytes(content)
    with pytest.raises(DataRefused) as refused:
        read(format_name, path, {})
    message = str(refused.value)
    assert "\n" not in message and str(path) in message and "expected" in message
    return message


@pytest.mark.parametrize("packed", [False, True])
def test_a_rocket_has_no_start_and_nothing_to_judge_by(tmp_path, packed):
    content = gzip.compress(ROCKET.encode()) if packed else ROCKET.encode()
    message = refusal("cats", tmp_path / "imu.csv", content)
    assert "50 samples at 100 Hz, only 0.05 s of them before lift-off (specific force 9.8 +- 0" in message
    assert "expected a minute at rest and the receiver's full solution" in message


@pytest.mark.parametrize("packed", [False, True])
def test_one_position_without_times_is_no_chamber_test(tmp_path, packed):
    content = gzip.compress(CHAMBER.encode()) if packed else CHAMBER.encode()
    message = refusal("mems-chamber", tmp_path / "data.csv", content)
    assert "50 rows at -18.2 to -17.7 degC in one position (mean 12, 17, 1009 milli-g)" in message
    assert "without times" in message and "four-point test" in message


@pytest.mark.parametrize(
    ("format_name", "content", "said"),
    [
        ("cats", b"ts,id,Ax\n1,2,3\n", "has no column Ay"),
        ("cats", ROCKET.encode().replace(b"-9.8", b"high", 1), "line 2, column Ay: 'high'"),
        ("cats", ROCKET.encode().replace(b",2,3\n", b"\n", 1), "line 2, column Gy: ''"),
        ("cats", ROCKET.encode()[:24], "0 samples"),
        ("cats", b"", "is empty"),
        ("mems-chamber", CHAMBER.encode()[:-8] + b"\n", "4 columns, expected 5"),
        ("mems-chamber", CHAMBER.encode().replace(b"17.0", b"nan", 1), "not finite"),
        ("mems-chamber", b"\n", "is empty"),
        ("mems-chamber", gzip.compress(CHAMBER.encode())[:-20], "cannot be unpacked"),
        ("mems-chamber", gzip.compress(np.random.default_rng(1).bytes(999))[:500], "cannot be unpacked"),
    ],
)
def test_bad_content(tmp_path, format_name, content, said):
    assert said in refusal(format_name, tmp_path / "file.csv", content)


def test_the_real_rocket(real, tmp_path):
    """SOURCE.md: 24564 rows at 100 Hz, 0.7 s before lift-off."""
    with pytest.raises(DataRefused, match="24564 samples at 100 Hz, only 0.756 s of them before lift-off"):
        read("cats", real("rocket_flight_temperature/imu.csv.gz"), {})


def test_the_real_chamber_sample(real):
    """SOURCE.md: 100 000 samples, z about +1008 milli-g, -18.2 to -13.3 degC."""
    with pytest.raises(DataRefused, match=r"100000 rows at -18\.\d to -13\.3 degC .*\(mean 1\d, 1\d, 1008 milli-g\)"):
        read("mems-chamber", real("accel_thermal_chamber/Sample_data.csv.gz"), {})
