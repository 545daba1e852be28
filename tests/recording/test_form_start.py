"""Where a recording in the form begins: as it is stated, or at a fix."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ins_eval.errors import DataRefused
from ins_eval.recording import form
from ins_eval.recording.belief import POSITION_SIGMA_M
from tests.recording.test_form import STEP_S, edited, flight_of, parked


def test_without_a_time_the_start_is_one_step_before_the_first_sample(tmp_path: Path) -> None:
    recording = form.read(edited(parked(tmp_path / "r"), "time_s = 99.9\n", ""))
    assert recording.start.time_s == pytest.approx(99.9)
    assert any("one step before" in note for note in recording.notes)


def test_without_a_place_a_recording_begins_at_the_nearest_fix(tmp_path: Path) -> None:
    """A start may be absent in any recording, or say its attitude alone."""
    flight = flight_of(np.random.default_rng(5))
    folder = form.write(flight, tmp_path / "flight")
    for path in folder.glob("reference.*"):
        path.unlink()
    path = folder / "recording.toml"
    before, _, rest = path.read_text().partition("[start]\n")
    after = rest[rest.index("\n[") + 1 :]
    for table in ("", "[start]\nattitude_deg = [0.1, -0.7, 60.3]\n\n"):
        path.write_text(before + table + after)
        recording = form.read(folder)
        start, fixes = recording.start, flight.gps
        assert start.time_s == pytest.approx(float(flight.imu.time_s[0]) - STEP_S)
        assert (start.latitude_rad, start.height_m) == (fixes.latitude_rad[0], fixes.height_m[0])
        assert start.velocity_n == tuple(fixes.velocity_n[0])
        assert start.position_sigma_m == POSITION_SIGMA_M  # nobody states how good a fix is
        assert (start.attitude_rad is None) == (not table)
        assert any("No place of the start is stated" in note for note in recording.notes)


def test_a_parked_unit_begins_at_rest_where_its_fixes_are(tmp_path: Path) -> None:
    at_s, stated = "time_s = 99.9\nlatitude_deg = 0.0\nlongitude_deg = 0.0\nheight_m = 0.0\n", "[start]\n"
    folder = edited(parked(tmp_path / "r"), stated + at_s, "")
    with pytest.raises(DataRefused, match=r"neither \[start\] nor a fix says where the recording begins"):
        form.read(folder)
    columns = "time_s,latitude_deg,longitude_deg,height_m,velocity_n_mps,velocity_e_mps,velocity_d_mps\n"
    folder.joinpath("gps.csv").write_text(columns + "100.1,0.0,0.0,1.5,0.1,-0.1,0.0\n100.3,0.0,0.0,1.4,0.0,0.1,0.0\n")
    start = form.read(folder).start
    assert (start.height_m, start.velocity_n, start.velocity_sigma_mps) == (1.5, (0.0, 0.0, 0.0), 0.0)
    with pytest.raises(DataRefused, match="has latitude_deg and no longitude_deg"):
        form.read(edited(folder, "[imu]", "[start]\nlatitude_deg = 0.0\n[imu]"))


def test_zeros_and_an_empty_validity_are_outages_that_are_said(tmp_path: Path) -> None:
    """Where every fix lies at 0 N 0 E it is a place."""
    folder = parked(tmp_path / "r")
    names = "time_s,latitude_deg,longitude_deg,height_m,velocity_n_mps,velocity_e_mps,velocity_d_mps,valid\n"
    zero, known = ("{},0.0,0.0,0.0,0.0,0.0,0.0,{}\n", "{},0.2,0.0,0.0,0.0,0.0,0.0,{}\n")
    rows = [zero.format(100.0, 1), known.format(100.1, ""), known.format(100.2, 1), known.format(100.3, 0)]
    for far, valid in ((False, [True, False, True, False]), (True, [False, False, True, False])):
        text = "".join(row.replace(",0.2,0.0,", ",0.2,3.0,") if far else row for row in rows)
        folder.joinpath("gps.csv").write_text(names + text)
        recording = form.read(folder, doubted=True)
        assert recording.gps.valid.tolist() == valid
        said = "\n".join(recording.notes)
        assert "Rows of gps at exactly 0° N 0° E: 1, first at 100 s; they " in said
        assert ("they count as an outage" if far else "they are taken as a place") in said
        assert (
            "Rows of gps that state nothing in the column of validity: 1, first row 3; they count as an outage" in said
        )
