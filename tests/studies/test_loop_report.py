"""``ins-eval loop-report`` from end to end, with three units: ids, figures, and what the loop gives without noise."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from ins_eval.cli import main
from ins_eval.studies.paper_b.rows import REQUIRED
from ins_eval.studies.papers import REPRODUCED, VERDICTS

KEYS = {"id", "printed", "recomputed", "ours", "interval95", "verdict", "reason", "passes", "fails", "chosen"}
FIGURES = (  # of the paper: F2 to F9 and F11 to F13
    *("loop_structure", "bridge_chain", "open_loop_chain", "scan_schedule", "excited_open_loop"),
    *("loop_with_current", "loop_with_compensation", "procedure_steps"),
    *("forward_estimation", "feedback_estimation", "static_output"),
)
SIZE = "3"


def report(folder: Path, workers: str) -> Path:
    assert main(["loop-report", "--ensemble", SIZE, "--workers", workers, "--output", str(folder), "--quiet"]) == 0
    return folder


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return report(tmp_path_factory.mktemp("loop"), "1")


@pytest.fixture(scope="module")
def metrics(folder: Path) -> dict:
    return json.loads((folder / "metrics.json").read_text(encoding="utf-8"))


def test_every_id_has_a_row_with_a_verdict(folder: Path) -> None:
    rows = json.loads((folder / "rows.json").read_text(encoding="utf-8"))
    assert {row["id"].partition("/")[0] for row in rows} == set(REQUIRED)
    for row in rows:
        assert set(row) >= KEYS
        assert row["verdict"] in VERDICTS and row["reason"] and "Not computed" not in row["reason"], row["id"]


def test_nothing_is_reproduced_that_could_not_have_failed(folder: Path) -> None:
    for row in json.loads((folder / "rows.json").read_text(encoding="utf-8")):
        if row["verdict"] != REPRODUCED:
            continue
        assert row["passes"] or row["fails"], row["id"]
        assert not row["chosen"], row["id"]
        if row["passes"]:
            (low, high), printed = row["passes"], row["printed"]
            assert not low <= 0.0 <= high, row["id"]
            assert not (low <= printed / 2.0 <= high and low <= 2.0 * printed <= high), row["id"]


def test_every_row_is_on_the_page_and_in_the_text(folder: Path) -> None:
    rows = json.loads((folder / "rows.json").read_text(encoding="utf-8"))
    page, text = ((folder / name).read_text(encoding="utf-8") for name in ("index.html", "report.txt"))
    for row in rows:
        assert f">{row['id']}<" in page
        assert f"    {row['id']} " in text


def test_every_figure_of_the_paper_is_on_the_page(folder: Path) -> None:
    drawn = {path.stem for path in (folder / "figures").glob("*.svg")}
    assert set(FIGURES) <= drawn
    page = (folder / "index.html").read_text(encoding="utf-8")
    assert page.count("<figure") == len(drawn)
    assert "Further figures" not in page  # where a figure goes that no sentence mentions


def test_two_workers_give_the_same_bytes(folder: Path, tmp_path: Path) -> None:
    again = report(tmp_path, "2")
    names = sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())
    assert names == sorted(str(path.relative_to(again)) for path in again.rglob("*") if path.is_file())
    for name in names:
        assert (folder / name).read_bytes() == (again / name).read_bytes(), name


def test_without_disturbances_the_estimates_are_exact(metrics: dict) -> None:
    exact = metrics["exact"]
    assert exact["forward_ppm"] == pytest.approx(-200.0, abs=1.0)
    assert exact["feedback_ppm"] == pytest.approx(200.0, abs=0.1)
    assert exact["output_feedback_ug"] == pytest.approx(-200.0 / 1.0002, abs=0.1)
    assert exact["output_forward_ug"] == pytest.approx(0.0, abs=0.01)
    assert exact["magnet_output_ug"] == pytest.approx(-200.0 / 1.0002, abs=0.1)
    assert exact["magnet_current_ppm"] == pytest.approx(0.0, abs=0.01)
    # 1 g takes k0 g/k_t = 1.2 mA, the constant current is that of 71 738.85 counts
    assert exact["counts_on_less_off"] == pytest.approx(-71738.85, abs=0.1)
    assert exact["counts_off"] / exact["counts_on_less_off"] == pytest.approx(-1.2e-3 / 3.4207749e-3, rel=1e-4)


def test_a_year_of_ageing_is_that_of_its_parts(metrics: dict) -> None:
    electronics, magnet, current = math.hypot(70.7, 70.7), 5.0, 5.0  # ppm a year, as the preset states them
    assert metrics["year"]["before_ug"] == pytest.approx(math.hypot(electronics, magnet), rel=0.01)
    assert metrics["year"]["after_ug"] == pytest.approx(math.hypot(magnet, current), rel=0.01)


def test_the_shift_is_additive(metrics: dict) -> None:
    for channel in ("forward", "feedback"):
        assert metrics["scaling"][f"{channel}_ratio"] == pytest.approx(1.0, abs=0.05)  # a share would give 5
    assert metrics["population"]["closure_ug"]["value"] == pytest.approx(0.0, abs=5.0)


def test_the_identified_unit_is_that_of_the_tables(metrics: dict) -> None:
    unit = metrics["unit"]
    assert sum(unit["forward_ppm"]) / 6 == pytest.approx(-180.5, abs=4.0)  # twice the error of a mean of six
    assert sum(unit["feedback_ppm"]) / 6 == pytest.approx(218.2, abs=4.0)
    assert unit["outputs_ug"]["uncompensated"] == pytest.approx(-193.0, abs=6.0)
    assert unit["outputs_ug"]["compensated"] == pytest.approx(24.0, abs=8.0)
