"""Results of runs side by side: paired by recording or instrument, and failing on a stated regression."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from ins_eval.analysis.results import regression
from ins_eval.cli import main
from ins_eval.errors import DataRefused, UsageError
from ins_eval.interface.results import results

RUNS = 40
# of RUNS whose true change is the limit: 2.5 % on one side of the interval, 5 % where 30 recordings with large errors
# make a bootstrap interval too narrow; more than 6 come by chance in 0.3 % of such tests
MOST_BY_CHANCE = 6


def written(folder: Path, values: dict[str, float], refused: tuple[str, ...] = ()) -> Path:
    """What `evaluate` writes of several recordings, with these horizontal velocity RMS."""
    rows = [
        {"name": name, "compensation": "solution", "velocity_rms_horizontal_mps": value, "final_radial_error_m": 9.0}
        for name, value in values.items()
    ]
    rows += [{"name": name, "compensation": "", "refused": "so it was"} for name in refused]
    folder.mkdir(parents=True)
    tree = {"format": "ins-eval-evaluations/1", "recordings": rows, "ensemble": {}}
    (folder / "metrics.json").write_text(json.dumps(tree))
    return folder


def draws(rng: np.random.Generator, change: float) -> tuple[dict[str, float], dict[str, float]]:
    """Thirty recordings whose errors differ by a factor, and the same, changed by a little noise."""
    before = {f"r{k}": float(np.exp(rng.standard_normal())) for k in range(30)}
    return before, {
        name: change * value * float(np.exp(0.05 * rng.standard_normal())) for name, value in before.items()
    }


def test_a_paired_interval_holds_and_is_narrow(tmp_path):
    rng, held, width = np.random.default_rng(1), [], []
    for k in range(20):
        a, b = draws(rng, 1.1)
        found = results([written(tmp_path / f"{k}a", a), written(tmp_path / f"{k}b", b)])
        low, high = found.metrics["changes"][0]["ratios"][0]["interval95"]
        held.append(low <= 1.1 <= high)
        width.append(high - low)
    assert np.mean(held) > 0.8 and np.median(width) < 0.1  # not paired it would be about 1


def test_the_change_of_one_recording_has_no_interval(tmp_path):
    found = results([written(tmp_path / "a", {"one": 1.0}), written(tmp_path / "b", {"one": 1.25})])
    assert found.metrics["changes"][0]["ratios"] == [{"ratio": 1.25, "interval95": None}]
    assert "+25.0 %" in str(found)


@pytest.mark.parametrize(
    ("limit", "code"),
    [("velocity_rms+5%", 1), ("velocity_rms.value+5%", 1), ("velocity_rms_horizontal+30%", 0)],
)
def test_a_stated_regression_fails(limit, code, tmp_path, capsys):
    a = written(tmp_path / "a", {"one": 1.0, "two": 2.0})
    b = written(tmp_path / "b", {"one": 1.2, "two": 2.4})
    assert main(["results", str(a), str(b), "--fail-if", limit, "--output", str(tmp_path / "page"), "--quiet"]) == code
    said = capsys.readouterr().err
    assert ("expected at most 5 % more" in said) == bool(code)
    assert ("paired" in said) == (limit == "velocity_rms+5%")
    assert (tmp_path / "page" / "index.html").exists()


def test_a_change_that_chance_explains_is_no_regression(tmp_path):
    rng = np.random.default_rng(7)
    failed = {"velocity_rms+5%": 0, "velocity_rms.value+5%": 0, "velocity_rms+0%": 0}
    for k in range(RUNS):
        a, b = draws(rng, 1.05)
        found = results([written(tmp_path / f"{k}a", a), written(tmp_path / f"{k}b", b)]).found
        for limit in failed:
            failed[limit] += bool(regression(found, limit))
    assert failed["velocity_rms+5%"] <= MOST_BY_CHANCE
    assert RUNS / 4 < failed["velocity_rms.value+5%"] < 3 * RUNS / 4  # the value lies above 5 % in one half of them
    assert failed["velocity_rms+0%"] > RUNS / 2


def test_a_change_without_interval_is_held_up_by_its_value_only(tmp_path):
    found = results([written(tmp_path / "a", {"one": 1.0}), written(tmp_path / "b", {"one": 1.25})]).found
    with pytest.raises(UsageError, match=r"has no interval \(1 recordings\).*velocity_rms\.value\+5% compares"):
        regression(found, "velocity_rms+5%")
    assert "is 1.25 m/s in b" in regression(found, "velocity_rms.value+5%")
    assert not regression(found, "velocity_rms.value+30%")


def test_a_recording_that_is_refused_now_is_a_regression(tmp_path, capsys):
    a = written(tmp_path / "a", {"one": 1.0, "two": 2.0})
    b = written(tmp_path / "b", {"one": 1.0}, refused=("two",))
    arguments = ["results", str(a), str(b), "--output", str(tmp_path / "page"), "--quiet"]
    assert main(arguments) == 0
    assert main([*arguments, "--fail-if", "velocity_rms+5%"]) == 1
    assert "two was evaluated in" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("limit", "said"),
    [("velocity_rm+5%", "all are velocity_rms_horizontal, final_radial_error"), ("5%", "KEY+PERCENT%")],
)
def test_a_limit_that_cannot_be_used_is_refused(limit, said, tmp_path, capsys):
    a, b = (written(tmp_path / name, {"one": 1.0}) for name in "ab")
    assert main(["results", str(a), str(b), "--fail-if", limit, "--output", str(tmp_path / "page"), "--quiet"]) == 2
    assert said in capsys.readouterr().err


def test_three_runs_stand_beside_each_other(tmp_path):
    folders = [
        written(tmp_path / name, {"one": value, "two": value})
        for name, value in zip("abc", (1.0, 0.5, 2.0), strict=True)
    ]
    one = results(folders).metrics["changes"][0]
    assert one["values"] == [1.0, 0.5, 2.0] and [ratio["ratio"] for ratio in one["ratios"]] == [0.5, 2.0]


def test_runs_without_a_recording_in_common_are_refused(tmp_path):
    with pytest.raises(DataRefused, match="no recording with the same compensation"):
        results([written(tmp_path / "a", {"one": 1.0}), written(tmp_path / "b", {"two": 1.0})])


def test_folders_without_results_are_refused(tmp_path):
    a = written(tmp_path / "a", {"one": 1.0})
    with pytest.raises(UsageError, match="holds no metrics.json"):
        results([a, tmp_path / "nothing"])
    with pytest.raises(UsageError, match="expected two or more"):
        results([a])
    (tmp_path / "a" / "metrics.json").write_text("[")
    with pytest.raises(DataRefused, match="is no JSON"):
        results([a, a])


def test_pages_of_single_recordings_are_paired_by_their_folder(tmp_path):
    tree = {
        "format": "ins-eval-evaluation/1",
        "recording": {"name": "x", "kind": "flight"},
        "reference": {"last_s": 7200.0},
        "compensations": {"simple": {"velocity_rms_mps": {"horizontal": 0.5}, "final_radial_error_m": 100.0}},
    }
    for run in "ab":
        for name in ("one", "two"):
            (tmp_path / run / name).mkdir(parents=True)
            (tmp_path / run / name / "metrics.json").write_text(json.dumps(tree))
    found = results([tmp_path / "a", tmp_path / "b"])
    assert [one["recordings"] for one in found.metrics["changes"]] == [2, 2]


def test_flight_reports_are_paired_by_instrument(small_report, tmp_path):
    found = results([small_report, small_report])
    by = {(one["compensation"], one["measure"]): one for one in found.metrics["changes"]}
    one = by["simple", "cep_rate_final"]
    tree = json.loads((small_report / "metrics.json").read_text())
    assert one["recordings"] == 4 and one["ratios"] == [{"ratio": 1.0, "interval95": [1.0, 1.0]}]
    assert one["values"][0] == pytest.approx(tree["ensemble"]["simple"]["cep_rate_nmi_per_h"]["final"]["value"])
