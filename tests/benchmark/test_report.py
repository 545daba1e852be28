"""The report of a small set of answers made by hand: what stands where, and what is met."""

from __future__ import annotations

import json

import pytest

from benchmark.runners import bound, navigation, report, run, targets
from benchmark.runners.figures import OTHER_AXIS, outcome, short
from benchmark.runners.targets import TARGETS

BIAS = {"name": "accelerometer.bias", "axis": "z", "value": 300.0, "unit": "ug"}
FIT = {
    "held_out": {"before": 11.0, "after": 1.5, "placebo": 10.5},
    "velocity_rms_mps": {"before": {"north": 3.0, "east": 4.0}, "after": {"north": 0.0, "east": 2.0}},
    "radial_error_rate_nmi_per_h": {"before": 2.0, "after": 1.4},
}


def truth(kind, effects=(), **more) -> dict:
    oracle = {"log_bayes_factor": 40.0, "margin": 12.0, "rivals": []} if effects else None
    return {"kind": kind, "set": "sealed", "recordings": [{"kind": "flight"}], "effects": list(effects),
            "outside": kind == "outside", "channel": None, "interval_s": None, "oracle": oracle, **more}  # fmt: skip


def answer(verdict, *effects) -> dict:
    named = [
        {**one, "probability": 0.9, "log_evidence_gain": 30.0,
         "parameters": {"value": one["value"], "interval95": [one["value"] - 1.0, one["value"] + 1.0]}}
        for one in effects
    ]  # fmt: skip
    return {"format": "ins-diagnosis/1", "verdict": verdict, "mismatch": [], "effects": named, "indistinguishable": [],
            "fit": FIT if effects else {}}  # fmt: skip


@pytest.fixture
def folder(tmp_path):
    """What maker and verb leave behind: two nulls, a right name, a wrong one, one outside, one without an answer."""
    swing = {"name": "outside.swing", "axis": "x", "value": 60.0, "unit": "ug", "driver": None}
    made = {
        "case-1": (truth("null"), answer("no mismatch")),
        "case-2": (truth("adversarial"), answer("explained", BIAS)),
        "case-3": (truth("single", [BIAS]), answer("explained", BIAS)),
        "case-4": (truth("single", [BIAS]), answer("explained", {**BIAS, "name": "accelerometer.scale"})),
        "case-5": (truth("outside", [swing]), answer("unexplained")),
        "case-6": (truth("single", [BIAS]), None),
    }
    (tmp_path / "truth").mkdir()
    (tmp_path / "answers").mkdir()
    for name, (one, given) in made.items():
        (tmp_path / "truth" / f"{name}.json").write_text(json.dumps({**one, "case": name}))
        if given:
            (tmp_path / "answers" / f"{name}.json").write_text(json.dumps(given))
    runs = {name: {"seconds": 5.0, "package": "p" * 64} for name, (_, given) in made.items() if given}
    (tmp_path / "answers" / run.RUNS).write_text(json.dumps(runs))
    (tmp_path / "answers" / "case-6.error").write_text("exit code 3\nins-eval: case-6: no fixes\n")
    write_manifest(tmp_path, "sealed")
    return tmp_path


def write_manifest(folder, which) -> None:
    made = [{"set": which, "seed": 9, "kinds": ["null"], "rate_hz": 20.0, "generator_sha256": "g" * 64}]
    (folder / "truth" / "manifest.json").write_text(json.dumps({"made": made}))


def reported(folder) -> dict:
    arguments = [str(folder), str(folder / "answers"), "--output", str(folder / "page"), "--quiet"]
    assert report.main(arguments) == 0
    return json.loads((folder / "page" / "metrics.json").read_text())


def test_the_page_begins_with_what_is_outside_and_goes_on_with_the_nulls(folder):
    metrics = reported(folder)
    page = (folder / "page" / "index.html").read_text()
    places = [page.index(f"<h2>{heading}</h2>") for heading in
              ("Outside the vocabulary", "Nothing concealed", "What was named", "Detection", "Naming", "Intervals",
               "The oracle and diagnose", "Time and failures", "All runs on sealed sets")]  # fmt: skip
    assert places == sorted(places)
    assert "case-6: no fixes" in page
    for name in ("outside", "confusion", "by_effect", "by_band", "calibration", "oracle"):
        assert f'id="figure-{name}"' in page
    assert metrics["missing"] == ["case-6"]
    assert metrics["false alarms"]["adversarial"]["hits"] == 1
    assert len(metrics["records"]) == 6


def test_a_sealed_run_is_logged_once_and_another_set_not_at_all(folder):
    reported(folder)
    reported(folder)
    (entry,) = json.loads((folder / "page" / report.LOG).read_text())
    assert entry["generator_sha256"] == ["g" * 64] and entry["package_sha256"] == ["p" * 64]
    assert entry["cases"] == {"adversarial": 1, "null": 1, "outside": 1, "single": 3} and entry["seeds"] == [9]
    assert entry["found"]["6a detected, D of at least 16"] == {"found": [2, 3], "verdict": "missed"}
    write_manifest(folder, "development")
    reported(folder)
    assert len(json.loads((folder / "page" / report.LOG).read_text())) == 1


def test_answers_of_two_packages_are_refused(folder, capsys):
    path = folder / "answers" / run.RUNS
    runs = json.loads(path.read_text())
    runs["case-1"]["package"] = "q" * 64
    path.write_text(json.dumps(runs))
    with pytest.raises(SystemExit):
        report.main([str(folder), str(folder / "answers"), "--output", str(folder / "page")])
    assert "2 versions of the package" in capsys.readouterr().err


def test_a_target_is_met_from_its_bound_on():
    detected = next(one for one in TARGETS if one.line == "6a")
    group, name = detected.path
    for hits, said in ((98, targets.MET), (97, targets.MISSED)):
        row = {"hits": hits, "count": 100, "rate": hits / 100, "interval95": [0.9, 1.0]}
        assert targets.verdict(detected, {group: {name: row}}) == said
    assert targets.verdict(detected, {group: {}}) == targets.OPEN
    sets = next(one for one in TARGETS if one.path == ("set size", "mean"))
    assert [targets.verdict(sets, {"set size": {"mean": x, "count": 3}}) for x in (2.5, 2.6)] == ["met", "missed"]
    cover = next(one for one in TARGETS if one.path == ("coverage", "all"))
    assert cover.goal == "90 % to 98 %"
    too_wide = {"coverage": {"all": {"hits": 99, "count": 100, "rate": 0.99, "interval95": [0.9, 1.0]}}}
    assert targets.verdict(cover, too_wide) == targets.MISSED


def test_the_gain_in_navigation_is_held_against_that_of_the_truth():
    """5 m/s before, 2 after, 1 with the truth: three quarters; 2 nmi/h, 1.4 and 1: 0.6."""
    record = {"case": "case-3", "heard": True, "truth": ["a"], "named": ["a"], "fit": FIT}
    known = {"case-3": {"velocity_rms_mps": 1.0, "radial_error_rate_nmi_per_h": 1.0}}
    found = navigation.gains([record], known)
    assert found["velocity_rms_mps"]["mean"] == pytest.approx(0.75)
    assert found["radial_error_rate_nmi_per_h"]["mean"] == pytest.approx(0.6)
    nothing_to_gain = {"case-3": {"velocity_rms_mps": 4.9, "radial_error_rate_nmi_per_h": 1.0}}
    assert navigation.gains([record], nothing_to_gain)["velocity_rms_mps"]["count"] == 0


def test_what_an_answer_says_first_has_one_column():
    record = {"heard": True, "truth": ["gyro.bias x"], "named": ["gyro.bias x"], "verdict": "explained"}
    assert outcome(record) == "gyro.bias"
    assert outcome(record | {"named": ["gyro.bias y"]}) == OTHER_AXIS
    assert outcome(record | {"named": []}) == "unexplained"
    assert outcome(record | {"named": ["composed x"], "right": True}) == "composed, right column"
    assert outcome(record | {"heard": False, "verdict": "no mismatch"}) == "no mismatch"


def test_short_names_stay_apart():
    from benchmark.worlds.effects import VOCABULARY

    names = [short(name) for name in VOCABULARY]
    assert len(set(names)) == len(names)
    assert max(map(len, names)) <= 25


def test_bands_are_of_d_with_the_noise_estimated() -> None:
    truths = {"a": {"oracle": {"log_bayes_factor": 40.0, "margin": 3.0}}, "b": {"oracle": None}}
    found = bound.estimated(truths, {"a": {"log_bayes_factor": 9.0, "removed": None}})
    assert found["a"]["oracle"] == {"log_bayes_factor": 9.0, "margin": 3.0, "noise_known": 40.0}
    assert found["b"] == truths["b"]


def test_the_energy_that_is_removed_counts_what_was_heard_and_could_be() -> None:
    heard = {"inside": True, "heard": True, "band": "D >= 16"}
    records = [{"case": "a", **heard}, {"case": "b", **heard}, {"case": "c", **heard, "band": "D < 4"}]
    shares = {"a": 0.98, "b": None, "c": -3.0}
    found = bound.removed(records, {name: {"removed": share} for name, share in shares.items()})
    assert found["count"] == 2
    assert found["mean"] == pytest.approx(0.49)
    assert (found["at least 80 %"]["hits"], found["at least 80 %"]["count"]) == (1, 2)
