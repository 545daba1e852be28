"""Folders with solutions, with groups of columns missing, and several recordings on one command line."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ins_eval.analysis.evaluation_numbers import SolutionNumbers
from ins_eval.analysis.several import summary
from ins_eval.analysis.solution import evaluate_solution
from ins_eval.cli import main
from ins_eval.earth import radii
from ins_eval.errors import DataRefused
from ins_eval.interface.evaluate import evaluate_several
from ins_eval.recording import Fixes, Recording, Start, form
from ins_eval.report.solution import solution_answer, solution_blocks
from ins_eval.units import DEG

PLACE = (45.0 * DEG, 10.0 * DEG, 100.0)
EAST_MPS, OFF_MPS = 30.0, 0.5


def eastward(seconds: float, off_mps: float = 0.0, spacing_s: float = 1.0) -> Fixes:
    """A drive along a parallel, at a speed that is off by `off_mps`."""
    time_s = np.arange(0.0, seconds + 0.5 * spacing_s, spacing_s)
    parallel_m = (radii(PLACE[0])[1] + PLACE[2]) * np.cos(PLACE[0])
    longitude = PLACE[1] + (EAST_MPS + off_mps) * time_s / parallel_m
    velocity = np.tile([0.0, EAST_MPS + off_mps, 0.0], (time_s.size, 1))
    return Fixes(
        time_s, np.full(time_s.size, PLACE[0]), longitude, np.full(time_s.size, PLACE[2]), velocity,
        np.ones(time_s.size, dtype=bool),
    )  # fmt: skip


def drive(name: str = "drive", seconds: float = 3600.0, off_mps: float = OFF_MPS) -> Recording:
    """The solution drifts away eastwards at `off_mps`."""
    return Recording(
        name, "drive", Start(0.0, *PLACE), None, gps=eastward(seconds), solution=eastward(seconds, off_mps)
    )


def without(fixes: Fixes, group: str, rows: slice = slice(None)) -> Fixes:
    """Fixes with no position or no velocity in `rows`."""
    latitude, longitude, height, velocity = (
        np.array(x) for x in (fixes.latitude_rad, fixes.longitude_rad, fixes.height_m, fixes.velocity_n)
    )
    for values in (latitude, longitude, height) if group == "position" else (velocity,):
        values[rows] = np.nan
    return replace(fixes, latitude_rad=latitude, longitude_rad=longitude, height_m=height, velocity_n=velocity)


def evaluated(recording: Recording, folder: Path) -> SolutionNumbers:
    """What is found of the solution, from disk."""
    where = form.write(recording, folder / recording.name)
    return evaluate_solution(form.read(where, solution_alone=True)).numbers


def test_a_steady_drift_has_its_rate(tmp_path):
    found = evaluated(drive(), tmp_path)
    assert found.radial_error_rate_nmi_per_h["final"] == pytest.approx(OFF_MPS * 3600.0 / 1852.0, rel=1e-6)
    assert found.velocity_mean_mps["east"].value == pytest.approx(OFF_MPS)
    assert found.final_radial_error_m == pytest.approx(OFF_MPS * 3600.0, rel=1e-6)


@pytest.mark.parametrize("group", ["position", "velocity"])
def test_a_receiver_may_lack_a_group(group, tmp_path):
    recording = drive()
    found = evaluated(replace(recording, gps=without(recording.gps, group)), tmp_path)
    assert bool(found.velocity_rms_mps) == (group == "position")
    assert (found.final_radial_error_m is not None) == (group == "velocity")
    assert any(note.startswith(f"No {group}") for note in found.notes)
    assert f"no {group}" in " ".join(str(block) for block in solution_blocks(found)).lower()
    assert "None" not in solution_answer(found)


def test_groups_may_have_rows_of_their_own(tmp_path):
    recording = drive()
    apart = without(without(recording.gps, "position", slice(1, None, 2)), "velocity", slice(0, None, 2))
    folder = form.write(replace(recording, gps=apart), tmp_path / "apart")
    back = form.read(folder, solution_alone=True).gps
    assert back.valid.all() and np.isnan(back.latitude_rad[1]) and np.isnan(back.velocity_n[0]).all()
    found = evaluated(replace(recording, gps=apart, name="again"), tmp_path)
    assert found.velocity_mean_mps["east"].value == pytest.approx(OFF_MPS)
    assert found.radial_error_rate_nmi_per_h["final"] == pytest.approx(OFF_MPS * 3600.0 / 1852.0, rel=1e-6)


def test_rows_that_the_solution_lacks_count_in_nothing(tmp_path):
    recording = drive()
    kept = np.ones(3601, dtype=bool)
    kept[1000:2000] = False
    fewer = Fixes(*(getattr(recording.solution, f)[kept] for f in (
        "time_s", "latitude_rad", "longitude_rad", "height_m", "velocity_n", "valid")))  # fmt: skip
    assert evaluated(replace(recording, solution=fewer), tmp_path).epochs == 2601


def test_half_a_position_is_refused(tmp_path, capsys):
    folder = form.write(drive(), tmp_path / "drive")
    (folder / "gps.parquet").unlink()
    (folder / "gps.csv").write_text("time_s,latitude_deg\n0,45\n1,45\n")
    assert main(["evaluate", str(folder), "--quiet"]) == 3
    assert "'longitude_deg' is missing" in capsys.readouterr().err


def test_nothing_to_compare_with_is_refused():
    with pytest.raises(DataRefused, match="expected a table gps or reference"):
        evaluate_solution(replace(drive(), gps=None))


def test_a_solution_at_rest_is_compared_with_its_start(tmp_path):
    parked = replace(drive(), kind="static", gps=None, solution=eastward(3600.0, OFF_MPS - EAST_MPS))
    found = evaluated(parked, tmp_path)
    assert found.reference == "standstill" and found.velocity_mean_mps["east"].value == pytest.approx(OFF_MPS)


@pytest.mark.parametrize("verb", ["compare", "diagnose"])
def test_verbs_that_need_an_imu_say_so(verb, tmp_path, capsys):
    folder = form.write(drive(), tmp_path / "drive")
    assert main([verb, str(folder), "--quiet"]) == 3
    assert "holds no imu" in capsys.readouterr().err


def test_the_solution_and_what_is_navigated_stand_on_one_page(tmp_path):
    from tests.test_evaluate import standstill

    parked = standstill(34.0, 20.0, 0.0, hours=0.2, rate_hz=10.0)
    still = eastward(700.0, -EAST_MPS)
    solution = replace(
        still, latitude_rad=np.full(701, 34.0 * DEG), longitude_rad=np.full(701, 20.0 * DEG), height_m=np.zeros(701)
    )
    folder = form.write(replace(parked, solution=solution), tmp_path / "parked")
    assert main(["evaluate", str(folder), "--output", str(tmp_path / "page"), "--quiet"]) == 0
    tree = json.loads((tmp_path / "page" / "metrics.json").read_text())
    assert {"compensations", "solution"} <= set(tree)
    assert "What the INS put out itself" in (tmp_path / "page" / "index.html").read_text()


# ------------------------------------------------------------------------------------------------ several


@pytest.fixture(scope="module")
def folders(tmp_path_factory) -> list[Path]:
    """Five drives of an hour whose drifts differ, one of five minutes, and one that cannot be read."""
    root = tmp_path_factory.mktemp("several")
    drives = [drive(f"drive-{k}", off_mps=0.1 * (k + 1)) for k in range(5)]
    short = drive("short", seconds=300.0)
    written = [form.write(one, root / one.name) for one in (*drives, short)]
    broken = form.write(short, root / "broken")
    (broken / "gps.parquet").write_bytes(b"rubbish")
    return [*written, broken]


@pytest.fixture(scope="module")
def together(folders, tmp_path_factory) -> tuple[int, Path]:
    """Exit code and folder of the page of all of them."""
    output = tmp_path_factory.mktemp("together")
    return main(["evaluate", *map(str, folders), "--output", str(output), "--quiet"]), output


def test_several_go_on_after_a_refused_one(folders, together):
    code, output = together
    assert code == 3
    text = (output / "report.txt").read_text()
    assert "6 of 7 recordings were evaluated, 1 refused" in text and "gps.parquet: cannot be read" in text
    tree = json.loads((output / "metrics.json").read_text())
    assert [row["name"] for row in tree["recordings"]] == [folder.name for folder in folders]
    page = (output / "index.html").read_text()
    for folder in folders[:-1]:
        assert f'href="{folder.name}/index.html"' in page and (output / folder.name / "index.html").exists()


def test_the_flights_together_have_a_cep_and_the_short_one_is_left_out(together):
    ensemble = json.loads((together[1] / "metrics.json").read_text())["ensemble"]
    assert ensemble["too_short"] == 1 and ensemble["solution"]["size"] == 5
    final = ensemble["solution"]["cep_rate_nmi_per_h"]["final"]
    assert final["value"] == pytest.approx(0.3 * 3600.0 / 1852.0, rel=1e-6)  # median of 0.1 to 0.5 m/s
    assert final["interval95"][0] < final["value"] < final["interval95"][1]


def test_few_flights_have_no_cep(folders):
    kept = [summary(one.name, evaluate_solution(form.read(one, solution_alone=True))) for one in folders[:3]]
    result = evaluate_several(kept)
    assert "A CEP needs at least 5 flights" in str(result)
    assert result.to_frame()["velocity_rms_horizontal_mps"].tolist() == pytest.approx([0.1, 0.2, 0.3])


def test_two_of_one_name_are_refused(folders, tmp_path, capsys):
    assert main(["evaluate", str(folders[0]), str(folders[0]), "--output", str(tmp_path)]) == 2
    assert "rename a folder" in capsys.readouterr().err
