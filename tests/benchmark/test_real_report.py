"""What real recordings say without an error model, found again where the truth is known; the page of the studies."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from benchmark.runners import imported, real_report, real_studies, run
from benchmark.runners.real_studies import STUDIES, Said, Study
from benchmark.scores import independent
from benchmark.worlds.earth import W
from benchmark.worlds.into_data import Applied, apply
from benchmark.worlds.real import SOURCES
from benchmark.worlds.recorded import Recorded
from tests.benchmark.test_real import driven, parked

DELAY_S, DELAY_AGREES_S = 0.2, 0.02  # a sample is 0.02 s
SLOPE_UG_PER_C = 300.0


def test_a_scan_finds_the_delay_of_fixes() -> None:
    scan = independent.velocity_scan(driven(delay_s=DELAY_S))
    assert scan.best_s == pytest.approx(DELAY_S, abs=DELAY_AGREES_S)
    assert scan.sigma_s < DELAY_AGREES_S


def test_a_scan_finds_the_delay_of_another_navigator() -> None:
    recorded = driven()
    table = recorded.tables["reference"]
    late = {name: values[::5] for name, values in table.items()}
    late["time_s"] = late["time_s"] + DELAY_S
    recorded.tables["reference"] = late
    assert independent.rate_scan(recorded).best_s == pytest.approx(DELAY_S, abs=DELAY_AGREES_S)


def test_a_line_through_means_finds_a_law_of_temperature() -> None:
    effect = Applied("accelerometer.bias_temperature", "z", SLOPE_UG_PER_C, "ug/degC", {})
    lines = {(one.name, one.axis): one for one in independent.temperature_lines(apply(parked(), effect), 0.0)}
    z, x = lines["accelerometer", "z"], lines["accelerometer", "x"]
    assert z.slope == pytest.approx(SLOPE_UG_PER_C, abs=5.0 * z.sigma)
    assert z.sigma < 0.2 * SLOPE_UG_PER_C
    assert abs(x.slope) < 5.0 * x.sigma


def test_gyros_at_rest_feel_the_earth() -> None:
    recorded = parked()
    span = independent.longest_quiet(recorded, 300.0)
    assert span[1] - span[0] == pytest.approx(300.0, abs=1.0)
    assert independent.earth_rate(recorded, *span) == pytest.approx(W, rel=0.02)


def test_every_study_is_of_a_recording_and_changes_only_a_copy() -> None:
    assert {one.source for one in STUDIES} == {one.name for one in SOURCES}
    recorded = parked()
    before = json.dumps(recorded.head, sort_keys=True)
    recorded.head["earth"] = {"rotation": True}
    for change in {one.change for one in STUDIES}:
        change(recorded)
    del recorded.head["earth"]
    assert json.dumps(recorded.head, sort_keys=True) == before


def warmed() -> Recorded:
    """Readings of one accelerometer on a ramp of temperature that its output follows."""
    rng, n = np.random.default_rng(1), 200
    temperature = np.linspace(-18.0, -13.0, n)
    output = 1000.0 + 1e-3 * SLOPE_UG_PER_C * (temperature + 18.0) + 0.04 * rng.standard_normal(n)
    table = {
        "time_s": np.arange(float(n)), "run": np.zeros(n, dtype=np.int64), "input_g": np.ones(n),
        "rate_c_per_min": np.zeros(n), "temperature_c": temperature, "output": output,
    }  # fmt: skip
    believed = {"reference_temperature_c": -18.0, "z": {"scale": {"gamma": 1000.0}, "bias": {"k0_ug": 0.0}}}
    head = {"format": "ins-recording/1", "kind": "chamber", "name": "ramp", "accelerometer": believed}
    return Recorded(head, {"chamber": table})


def test_a_page_says_what_was_named_and_who_agrees(tmp_path, monkeypatch) -> None:
    """A law that the study knows, under both names that one position cannot tell apart; and a control without any."""
    monkeypatch.setattr(imported, "recorded", lambda one, *_: warmed() if one.name == "chamber" else None)
    names = (("accelerometer.bias_temperature", "ug/degC"), ("accelerometer.scale_temperature", "ppm/degC"))
    known = [Said(name, "z", SLOPE_UG_PER_C, 10.0, unit, "put in by this test") for name, unit in names]
    studies = (
        Study("chamber", "as it is", "A ramp.", said=lambda recorded: known),
        Study("chamber", "control", "The same.", real_studies.another_time, silent_about="gyro"),
    )
    monkeypatch.setattr(real_report, "STUDIES", studies)
    output = tmp_path / "real"
    assert real_report.main(["--recordings", str(tmp_path), "--output", str(output), "--quiet"]) == 0
    first, control = json.loads((output / "metrics.json").read_text())["studies"]
    assert first["answer"]["verdict"] == "not identifiable"
    assert [said["agrees"] for said in first["sources"]].count(True) == 1
    assert control["alarm"] == []
    assert (output / first["page"]).exists()
    text = (output / "index.html").read_text()
    assert "of 2 values known from other sources, 1 are named and agree" in " ".join(text.split())
    assert "put in by this test" in text
    assert "Laser gyros" in text  # among what is absent
    kept = (output / "answers" / run.RUNS).read_text()
    assert real_report.main(["--recordings", str(tmp_path), "--output", str(output), "--quiet"]) == 0
    assert (output / "answers" / run.RUNS).read_text() == kept


def test_without_any_recording_there_is_nothing_to_report(tmp_path, capsys) -> None:
    assert real_report.main(["--recordings", str(tmp_path), "--output", str(tmp_path / "real")]) == 1
    assert "no real recording is here" in capsys.readouterr().err


def test_values_apart_from_a_source_are_said_to_be_apart() -> None:
    given = {"effects": [{"name": "gps.time_offset", "axis": None,
                          "parameters": {"value": 0.2, "interval95": [0.19, 0.21]}}]}  # fmt: skip
    near = Said("gps.time_offset", None, 0.23, 0.02, "s", "")
    assert real_report.agrees(given, near) is True
    assert real_report.agrees(given, replace(near, sigma=0.001)) is False
    assert real_report.agrees(given, replace(near, name="gps.lever_arm")) is None
