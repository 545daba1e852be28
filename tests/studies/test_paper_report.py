"""``ins-eval paper-report`` from end to end, with ensembles of two: every id is in the rows and on the page."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from ins_eval.cli import main
from ins_eval.ensemble import chamber, oven, sensitivity
from ins_eval.studies.paper_a.rows import REQUIRED, VERDICTS
from ins_eval.studies.papers import REPRODUCED

KEYS = {"id", "printed", "recomputed", "ours", "interval95", "verdict", "reason", "passes", "fails", "chosen"}
FIGURES = (  # of the paper: F1 to F13
    *("magnet_loops", "creep_rig", "creep_elongation", "chamber_rig", "scale_factor_by_temperature"),
    *("compensated_scale_factor", "bias_by_temperature", "oven_rig", "oven_velocity_error", "oven_position_error"),
    *("flight_path", "temperature_and_rate", "east_velocity_error", "north_velocity_error"),
    *("latitude_error", "longitude_error", "position_error"),
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    output = tmp_path_factory.mktemp("paper")
    with pytest.MonkeyPatch.context() as patch:
        for experiment in (oven, chamber):
            patch.setattr(experiment, "SIZE", 2)
        cases = {name: sensitivity.CASES[name] for name in (sensitivity.BASE, "gyro/0")}
        patch.setattr(sensitivity, "CASES", cases)
        patch.setattr(sensitivity.plans, "__defaults__", (1, 2))
        assert main(["paper-report", "--ensemble", "2", "--workers", "1", "--output", str(output), "--quiet"]) == 0
    return output


def test_every_id_has_a_row_with_a_verdict(folder: Path) -> None:
    rows = json.loads((folder / "rows.json").read_text(encoding="utf-8"))
    assert {row["id"].partition("/")[0] for row in rows} == set(REQUIRED)
    for row in rows:
        assert set(row) >= KEYS
        assert row["verdict"] in VERDICTS and row["reason"]


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
        assert row["id"] in text


def test_every_figure_of_the_paper_is_on_the_page(folder: Path) -> None:
    drawn = {path.stem for path in (folder / "figures").glob("*.svg")}
    assert set(FIGURES) <= drawn
    page = (folder / "index.html").read_text(encoding="utf-8")
    assert page.count("<figure") == len(drawn)
    assert "Further figures" not in page  # where a figure goes that no sentence mentions
