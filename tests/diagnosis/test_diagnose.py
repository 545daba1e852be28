"""The verb: text, JSON and page of a diagnosis."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from ins_eval.commands import diagnose
from ins_eval.errors import UsageError
from ins_eval.recording import form
from ins_eval.units import DEG_PER_H

KEYS = {"format", "verdict", "mismatch", "effects", "indistinguishable", "unexplained", "fit"}


@pytest.fixture(scope="module")
def parked(ideal_recording, tmp_path_factory):
    """An hour at rest, and the same with a gyro that changes its bias for a while, as folders."""
    whole = ideal_recording("oven")
    rows = whole.imu.time_s <= 3600.0
    imu = replace(
        whole.imu,
        time_s=whole.imu.time_s[rows],
        gyro=whole.imu.gyro[rows],
        accelerometer=whole.imu.accelerometer[rows],
        height_baro_m=None,
    )
    gyro = imu.gyro.copy()
    wrong = (imu.time_s > 1200.0) & (imu.time_s <= 2400.0)
    gyro[wrong, 0] += 0.3 * DEG_PER_H / 20.0
    folder = tmp_path_factory.mktemp("parked")
    sound = form.write(replace(whole, name="sound", imu=imu), folder / "sound")
    broken = form.write(replace(whole, name="broken", imu=replace(imu, gyro=gyro)), folder / "broken")
    return sound, broken


def test_a_sound_recording_has_no_mismatch(parked, tmp_path, capsys) -> None:
    assert diagnose.run([parked[0]], json=tmp_path / "answer.json", quiet=False) == 0
    answer = json.loads((tmp_path / "answer.json").read_text())
    assert set(answer) == KEYS
    assert (answer["format"], answer["verdict"], answer["mismatch"]) == ("ins-diagnosis/1", "no mismatch", [])
    assert "no mismatch" in capsys.readouterr().out


def test_a_broken_gyro_is_located_beside_a_sound_recording(parked, tmp_path) -> None:
    diagnose.run(list(parked), json=tmp_path / "answer.json", report=tmp_path / "report", quiet=True)
    answer = json.loads((tmp_path / "answer.json").read_text())
    assert answer["verdict"] == "unexplained"
    first = answer["mismatch"][0]
    assert (first["recording"], first["channel"]) == ("broken", "gyro.x")
    assert first["interval_s"] == pytest.approx([1200.0, 2400.0], abs=60.0)
    assert answer["unexplained"]["channel"] == "gyro.x"
    words = (tmp_path / "report" / "report.txt").read_text()
    assert "Gyro x of broken" in words
    assert (tmp_path / "report" / "figures" / "whitened_residuals_2.svg").is_file()


def test_a_file_is_sent_to_import(tmp_path) -> None:
    with pytest.raises(UsageError, match="ins-eval import"):
        diagnose.run([tmp_path / "nothing.csv"])
