"""The scorer counts answers made by hand as one would by hand."""

from __future__ import annotations

import json

import pytest

from benchmark.scores.score import (
    TWINS,
    band,
    calibration,
    confidently_wrong,
    judged,
    main,
    overlap,
    quantiles,
    rate,
    rivals_of,
    score,
    text,
)

CREEP = {"name": "accelerometer.bias_creep", "axis": "x", "value": 5.0, "unit": "ug/degC", "time_constant_s": 2000.0,
         "law": "one"}  # fmt: skip


def truth(case, kind, effects=(), d=20.0, margin=8.0, **more) -> dict:
    oracle = None if kind in ("zero", "null", "adversarial") else {
        "log_bayes_factor": d, "margin": margin,
        "rivals": [{"rival": "accelerometer.bias_drift x", "margin": 1.0}, {"rival": "gyro.scale y", "margin": 4.0}],
        "twins": ["accelerometer.bias_drift x", "accelerometer.misalignment x y", "gps.time_offset"],
    }  # fmt: skip
    return {"case": case, "kind": kind, "recordings": [{"kind": "flight"}], "effects": list(effects), "outside": False,
            "channel": None, "interval_s": None, "oracle": oracle} | more  # fmt: skip


def answer(verdict, effects=(), others=(), mismatch=()) -> dict:
    return {"verdict": verdict, "effects": list(effects), "indistinguishable": list(others), "mismatch": list(mismatch)}


def named(name="accelerometer.bias_creep", axis="x", probability=0.9, low=4.0, high=6.0, **more) -> dict:
    parameters = {"value": 5.0, "interval95": [low, high]} | more
    return {"name": name, "axis": axis, "probability": probability, "parameters": parameters}


def test_exact_bounds_are_those_of_the_tables():
    """Clopper and Pearson: 0 of 10 and 5 of 10 at 95 %."""
    assert rate(0, 10)["interval95"] == pytest.approx([0.0, 0.3085], abs=1e-4)
    assert rate(5, 10)["interval95"] == pytest.approx([0.1871, 0.8129], abs=1e-4)
    assert rate(10, 10)["interval95"] == pytest.approx([0.6915, 1.0], abs=1e-4)


def test_false_alarms_are_counted_per_kind_and_a_missing_answer_is_one():
    truths = [truth("a", "null"), truth("b", "null"), truth("c", "adversarial")]
    result = score(truths, {"a": answer("no mismatch"), "c": answer("unexplained")})
    assert (result["false alarms"]["null"]["hits"], result["false alarms"]["null"]["count"]) == (1, 2)
    assert result["false alarms"]["adversarial, flight"]["hits"] == 1
    assert result["missing"] == ["b"]


def test_a_named_truth_counts_in_its_band():
    truths = [truth("a", "single", [CREEP]), truth("b", "single", [CREEP], d=10.0), truth("c", "single", [CREEP])]
    drift = named("accelerometer.bias_drift", probability=0.3)
    answers = {
        "a": answer("explained", [named()]),
        "b": answer("no mismatch"),
        "c": answer("not identifiable", [drift], [named(probability=0.6)]),
    }
    result = score(truths, answers)
    assert result["detection"]["single, D >= 16"]["hits"] == 2
    assert result["detection"]["single, 8 <= D < 16"]["hits"] == 0
    assert result["naming"]["named first where separable, one recording"]["hits"] == 1
    assert result["naming"]["named first where separable, one recording"]["count"] == 3
    assert result["naming"]["named or listed, of the detected"]["hits"] == 2
    assert result["set size"]["mean"] == 1.5
    assert result["probability of the truth"]["mean"] == pytest.approx(0.75)
    assert result["naming"]["inseparable rival listed"]["hits"] == 1
    assert result["naming"]["inseparable rival listed, D >= 8"] == result["naming"]["inseparable rival listed"]
    assert (result["naming"][TWINS]["hits"], result["naming"][TWINS]["count"]) == (1, 6)
    known = truth("a", "single", [CREEP], d=20.0)
    known["oracle"]["noise_known"] = 8.0  # twins are told with the noise known, and so is what is clear beside them
    assert TWINS not in score([known], {"a": answers["a"]})["naming"]
    faint = score([truth("a", "single", [CREEP], d=3.0)], {"a": answers["a"]})["naming"]
    assert faint["inseparable rival listed"]["count"] == 1
    assert "inseparable rival listed, D >= 8" not in faint
    assert result["by effect"]["accelerometer.bias_creep: named, D >= 16"]["count"] == 2
    assert result["confidently wrong"]["inside, single"]["hits"] == 0


def test_confidently_wrong_is_as_the_form_defines_it():
    target = {("accelerometer.bias_creep", "x")}
    other = named("gyro.scale", "y")
    assert confidently_wrong(answer("explained", [other]), target)
    assert not confidently_wrong(answer("explained", [other], [named()]), target)
    assert not confidently_wrong(answer("explained", [other], [named("gyro.bias", "z")]), target)
    assert not confidently_wrong(answer("partly explained", [other]), target)
    assert confidently_wrong(answer("explained", [named(axis="y")]), target)
    composed = {"name": "composed", "axis": "x", "driver": "supply_v"}
    assert not confidently_wrong(answer("explained", [composed]), {("outside.supply_bias", "x")}, "supply_v")
    assert confidently_wrong(answer("explained", [composed]), {("outside.supply_bias", "x")}, None)


def test_outside_wants_unexplained_or_the_driving_column():
    hidden = {"name": "outside.supply_bias", "axis": "z", "value": 1.0, "driver": "supply_v"}
    truths = [truth(case, "outside", [hidden], outside=True) for case in "abc"]
    answers = {
        "a": answer("unexplained"),
        "b": answer("explained", [{"name": "composed", "axis": "z", "parameters": {"driver": "supply_v"}}]),
        "c": answer("explained", [named("accelerometer.bias_step", "z")]),
    }
    result = score(truths, answers)
    assert result["outside"]["unexplained or the driving column, D >= 8"]["hits"] == 2
    separable = "unexplained or the driving column where separable, D >= 8"
    assert (result["outside"][separable]["hits"], result["outside"][separable]["count"]) == (2, 3)
    for one in truths[:2]:
        one["oracle"]["margin"] = 0.0  # then its law and a named one are as likely to the oracle
    assert score(truths, answers)["outside"][separable]["count"] == 1
    assert result["outside"]["confidently wrong"]["hits"] == 1


def test_intervals_cover_or_not():
    truths = [truth("a", "single", [CREEP]), truth("b", "single", [CREEP | {"law": "power"}])]
    tau = {"time_constant_s_interval95": [2100.0, 3000.0]}
    answers = {"a": answer("explained", [named(**tau)]), "b": answer("explained", [named(low=5.1, **tau)])}
    covered = score(truths, answers)["coverage"]
    assert (covered["value"]["hits"], covered["value"]["count"]) == (1, 1)
    other = covered["value, creep of another law"]
    assert (other["hits"], other["count"]) == (0, 1)
    assert (covered["time_constant_s"]["hits"], covered["time_constant_s"]["count"]) == (0, 1)
    assert (covered["all"]["hits"], covered["all"]["count"]) == (1, 3)
    assert covered["all"]["interval95"] == rate(1, 3)["interval95"]


def test_the_fit_must_take_most_of_the_excess_and_beat_the_placebo():
    truths = [truth(case, "single", [CREEP]) for case in "abc"]
    answers = {
        "a": answer("explained", [named()]) | {"fit": {"held_out": {"before": 11.0, "after": 2.5, "placebo": 10.0}}},
        "b": answer("explained", [named()]) | {"fit": {"held_out": {"before": 11.0, "after": 4.0, "placebo": 3.9}}},
        "c": answer("explained", [named()]),
    }
    result = score(truths, answers)
    rows = result["held out"]
    assert (result["removed"]["count"], result["removed"]["quantiles"]["0.5"]) == (2, pytest.approx(0.775))
    assert (rows["80 % of the excess removed"]["hits"], rows["80 % of the excess removed"]["count"]) == (1, 3)
    assert (rows["better than the placebo"]["hits"], rows["better than the placebo"]["count"]) == (1, 3)


def test_places_and_intervals():
    assert overlap([0.0, 10.0], [5.0, 15.0]) == pytest.approx(1.0 / 3.0)
    assert overlap([0.0, 1.0], [2.0, 3.0]) == 0.0
    assert overlap(None, [2.0, 3.0]) == 0.0
    step = {"name": "gyro.bias_step", "axis": "y", "value": 0.05, "at_s": 100.0}
    case = truth("a", "limited", [step], channel="gyro.y", interval_s=[100.0, 1100.0])
    place = {"channel": "gyro.y", "interval_s": [200.0, 1100.0]}
    result = score([case], {"a": answer("explained", [named("gyro.bias_step", "y")], mismatch=[place])})
    assert result["location"]["channel, D >= 16"]["hits"] == 1
    assert result["overlap"]["D >= 16"]["quantiles"]["0.5"] == pytest.approx(0.9)


def test_what_cannot_be_told_apart_must_be_said():
    bias = {"name": "accelerometer.bias_temperature", "axis": "z", "value": 5.0}
    alike = [{"name": "accelerometer.scale_temperature", "axis": "z"}]
    truths = [truth(case, "unidentifiable", [bias], margin=0.1, alike=alike) for case in "ab"]
    both = [named("accelerometer.scale_temperature", "z")], [named("accelerometer.bias_temperature", "z")]
    answers = {"a": answer("not identifiable", *both), "b": answer("explained", both[1])}
    row = score(truths, answers)["not identifiable"]["said so, with the truth and a true rival"]
    assert (row["hits"], row["count"]) == (1, 2)


def test_probabilities_are_held_against_what_came_true():
    said = [(0.02, False), (0.9, True), (0.95, False), (1.0, True)]
    low, high, top = calibration(said)
    assert (low["hits"], low["count"]) == (0, 1)
    assert (high["hits"], high["count"], high["stated"]) == (1, 2, pytest.approx(0.925))
    assert (top["from"], top["hits"]) == (0.97, 1)


def test_quantiles_leave_out_what_is_missing():
    assert quantiles([1.0, None, 3.0, float("nan")])["mean"] == 2.0
    assert quantiles([])["quantiles"] is None


def test_a_case_becomes_one_record_of_plain_values():
    record = judged(truth("a", "single", [CREEP]), answer("explained", [named()]), 7.5)
    assert record["truth"] == record["named"] == record["listed"] == ["accelerometer.bias_creep x"]
    assert record["first"] and record["found"] and not record["wrong"]
    assert record["said"] == [(0.9, True)] and record["seconds"] == 7.5
    json.dumps(record, allow_nan=False)
    json.dumps(judged(truth("b", "null"), None), allow_nan=False)


def test_sets_need_all_and_nothing_else():
    two = [CREEP, {"name": "gyro.scale", "axis": "y", "value": 50.0}]
    truths = [truth(case, "pair", two) for case in "ab"]
    right = [named(), named("gyro.scale", "y")]
    answers = {"a": answer("explained", right), "b": answer("explained", [*right, named("gyro.bias", "x")])}
    sets = score(truths, answers)["sets"]
    assert sets["pair: all named, D >= 16"]["hits"] == 2
    assert sets["pair: nothing else named, D >= 16"]["hits"] == 1
    assert sets["something named that is not there"]["hits"] == 1


def test_each_of_several_counts_by_how_clear_it_is_beside_the_others():
    """One of 11.9 sigma is not asked for; a rival that the oracle cannot separate is as good as the truth."""
    three = [CREEP, {"name": "gyro.scale", "axis": "y", "value": 50.0},
             {"name": "gyro.bias", "axis": "x", "value": 0.1}]  # fmt: skip
    creep = {"sigma": 30.0, "rivals": [{"rival": "accelerometer.bias_drift x", "margin": 2.9}]}
    beside = [creep, {"sigma": 12.1, "rivals": [{"rival": "gyro.asymmetry y", "margin": 3.1}]},
              {"sigma": 11.9, "rivals": []}]  # fmt: skip
    cases = {
        "a": ("explained", [named("accelerometer.bias_drift"), named("gyro.scale", "y")]),
        "b": ("explained", [named(), named("gyro.asymmetry", "y")]),
        "c": ("partly explained", [named("gyro.bias", "x")]),
    }
    truths = [truth(case, "triple", three) for case in cases]
    for one in truths:
        one["oracle"]["beside"] = beside
    sets = score(truths, {case: answer(*said) for case, said in cases.items()})["sets"]
    found = {name: (one["hits"], one["count"]) for name, one in sets.items()}
    assert found["each of at least 12 sigma named or listed"] == (3, 6)
    assert found["triple: all of at least 12 sigma named or listed"] == (1, 3)
    assert found["explained, with one of at least 12 sigma missing"] == (1, 2)
    assert found["something named that is not there"] == (1, 3)


def test_bands_and_rivals():
    assert [band(d) for d in (-1.0, 4.0, 15.9, 16.0)] == ["D < 4", "4 <= D < 8", "8 <= D < 16", "D >= 16"]
    assert rivals_of(truth("a", "single", [CREEP])) == {("accelerometer.bias_drift", "x")}


def test_the_command_reads_folders(tmp_path, capsys):
    for folder, one in (("truth", truth("case-1", "null")), ("answers", answer("no mismatch"))):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "case-1.json").write_text(json.dumps(one))
    assert main([str(tmp_path / "truth"), str(tmp_path / "answers"), "--json", str(tmp_path / "result.json")]) == 0
    assert "0 of    1" in capsys.readouterr().out
    assert json.loads((tmp_path / "result.json").read_text())["false alarms"]["null"]["hits"] == 0
    assert "null" in text(json.loads((tmp_path / "result.json").read_text()))
