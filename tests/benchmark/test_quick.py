"""A fresh set of few cases, held against what the score of the whole one allows."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from benchmark.runners import crippled, quick, quick_page, run
from benchmark.runners.targets import TARGETS
from benchmark.scores.predictive import TOGETHER, allowed, shares
from benchmark.worlds.cases import DRAWN

DRAWS = 40_000
SIGMAS = 4.0  # of a share of so many draws


@pytest.fixture(scope="module")
def whole(repository: Path) -> dict:
    return quick.plain_set(json.loads((repository / quick.LOG).read_text()))


@pytest.mark.parametrize(("count", "fresh"), [(219, 12), (60, 30)])
def test_what_is_allowed_holds_as_often_as_is_said(count: int, fresh: int) -> None:
    """Worlds of any rate are seen in a whole set and in a fresh one."""
    rng = np.random.default_rng(5)
    p = rng.beta(0.5, 0.5, DRAWS)
    hits, few = rng.binomial(count, p), rng.binomial(fresh, p)
    limits = np.array([allowed(k, count, fresh, 4) for k in range(count + 1)])[hits]
    outside = np.mean((few < limits[:, 0]) | (few > limits[:, 1]))
    most = TOGETHER / 4
    assert outside < most + SIGMAS * np.sqrt(most / DRAWS)
    assert outside > 0.1 * most  # no wider than counts make it


def test_an_interval_is_that_of_the_rates_compared_together() -> None:
    alone, together = allowed(30, 60, 40), allowed(30, 60, 40, 4)
    assert together[0] < alone[0] < 20 < alone[1] < together[1]
    assert allowed(5, 9, 0) == (0, 0)  # no fresh case, nothing to hold


def test_kinds_stand_in_the_proportions_of_the_whole_set(whole: dict) -> None:
    counts = whole["cases"]
    few = shares(counts, quick.COUNT)
    assert sum(few.values()) == quick.COUNT
    exact = {kind: quick.COUNT * count / sum(counts.values()) for kind, count in counts.items()}
    assert all(abs(few[kind] - exact[kind]) < 1.0 for kind in counts)


def test_a_seed_draws_the_same_cases_and_another_one_others(whole: dict) -> None:
    drawn = quick.drawn(whole["cases"], 1)
    assert drawn == quick.drawn(whole["cases"], 1) != quick.drawn(whole["cases"], 2)
    assert all(0 <= k < whole["cases"][kind] for kind, indices in drawn.items() for k in indices)
    names = {k % len(DRAWN) for k in drawn["single"]}
    assert len(names) > len(drawn["single"]) // 2  # not the first of the vocabulary each time


def fresh(**hits: tuple[int, int]) -> dict:
    """Scored targets of a quick set in which all is well but `hits`, by the first word of the target."""
    well = {"detected": (12, 12), "of": (11, 11), "confidently": (0, 12), "false": (0, 7)} | hits
    return {
        f"{one.line} {one.words}": {"found": list(well.get(one.words.split()[0].strip(","), (1, 1)))} for one in TARGETS
    }


def test_a_score_like_that_of_the_whole_set_is_within(whole: dict) -> None:
    found = quick.compared(fresh(), whole["found"])
    assert [one.name for one in found] == list(quick.RATES)
    assert all(one.inside for one in found)
    assert found[-1].fresh == (0, 14) and found[-1].whole == (7, 300)  # plain and adversarial nulls
    assert quick.verdict(found, 40, 0, 1, None).endswith("is within the range that the last whole set allows.")
    assert "2 of the cases ended with an error" in quick.verdict(found, 40, 2, 1, None)


@pytest.mark.parametrize(
    ("word", "hits", "name"),
    [
        ("detected", (10, 12), "detected, D of at least 16"), ("of", (6, 11), "truth named or listed, of the detected"),
        ("confidently", (1, 12), "confidently wrong"), ("false", (3, 7), "false alarms"),
    ],
)  # fmt: skip
def test_a_worse_score_is_outside_and_says_which(word: str, hits: tuple, name: str, whole: dict) -> None:
    found = quick.compared(fresh(**{word: hits}), whole["found"])
    assert [one.name for one in found if not one.inside] == [name]
    said = quick.verdict(found, 40, 0, 1, "gyro")
    assert name in said and "gyro left out" in said and "where" in said
    first, *_ = quick_page.sections({"records": [], "failures": {}}, found, [], {"cases": {"null": 1}, "seeds": [1]})
    assert first.blocks[0].items[0].what.startswith(name)  # the first screen shows what lies outside first


def record(case: str, kind: str, **more) -> dict:
    return {"case": case, "kind": kind, "d": 20.0, "wrong": False, "false alarm": False, "inside": kind == "single",
            "band": "D >= 16", "heard": True, "verdict": "explained"} | more  # fmt: skip


def test_cases_that_went_wrong_come_first_and_each_case_once() -> None:
    records = [
        record("a", "single", first=True, d=9.0), record("b", "single", first=True, d=400.0),
        record("c", "single", heard=False), record("d", "null", **{"false alarm": True, "d": 0.0}),
        record("e", "outside"), record("f", "adversarial", d=0.0, heard=False, verdict="no mismatch"),
        record("g", "single", found=False, d=50.0), record("h", "pair"),
    ]  # fmt: skip
    chosen = quick_page.telling(records)
    assert [one["case"] for _, one in chosen] == ["d", "c", "g", "a", "e"]


def test_a_crippled_search_knows_no_effect_of_the_sensor(tmp_path: Path) -> None:
    from ins_eval.effects import VOCABULARY
    from ins_eval.error_model import library

    possible = library.possible
    with crippled.effects_left_out("gyro"):
        assert not library.possible(VOCABULARY["gyro.bias"], None)
    assert library.possible is possible


def test_the_runner_takes_the_search_that_it_is_given(tmp_path: Path) -> None:
    def search(folders: list[str], answer: str, limit_s: float) -> tuple[int, str, float, float]:
        Path(answer).write_text(json.dumps({"format": "ins-diagnosis/1", "verdict": "no mismatch"}))
        return 0, "", 1.0, 1.0

    assert run.run({"case-1": [tmp_path]}, tmp_path / "answers", work=search) == []
    assert run.whole(tmp_path / "answers", "case-1", run.read_runs(tmp_path / "answers"), run.package_hash())


@pytest.mark.slow
def test_a_set_is_made_answered_scored_and_drawn(tmp_path: Path) -> None:
    """With as many cases as the default suite would not have time for."""
    arguments = ["--count", "16", "--seed", "7", "--quiet", "--cases", str(tmp_path / "cases")]
    assert quick.main([*arguments, "-o", str(tmp_path / "page")]) == 0
    page = (tmp_path / "page" / "index.html").read_text()
    assert "is within the range" in page and len(re.findall(r'id="figure-case-', page)) == quick_page.MOST


@pytest.mark.slow
def test_the_score_of_a_crippled_search_is_outside_and_says_so(tmp_path: Path, capsys) -> None:
    """All 40 cases of the default seed: of those detected fewer are named than the whole set allows."""
    arguments = ["--quiet", "--cases", str(tmp_path / "cases"), "-o", str(tmp_path / "page")]
    assert quick.main([*arguments, "--without", "accelerometer"]) == 1
    said = capsys.readouterr().err.splitlines()[-1]
    assert "the effects of the accelerometer left out of the search: the score is outside" in said
    assert "truth named or listed, of the detected" in said
    assert said in (tmp_path / "page" / "index.html").read_text().replace("\u00a0", " ")
