"""What the flight report says of missions follows the numbers, whichever way they come out."""

from __future__ import annotations

from itertools import product

import pytest

from ins_eval.report.content import Paragraph, Picture, Table
from ins_eval.report.flight import flight_content
from ins_eval.report.missions import AFTER_MODEL, EQUAL, GROUP_WORDS, MODEL, OVEN, WHO, substitutes
from ins_eval.vocabulary import CEP, HEADLINE, VELOCITY

BETTER = {"ratio": 0.8, "interval95": [0.7, 0.9]}
WORSE = {"ratio": 1.2, "interval95": [1.1, 1.3]}
OPEN = {"ratio": 0.97, "interval95": [0.9, 1.05]}
SHARE = {"value": 0.6, "interval95": [0.5, 0.7]}


@pytest.fixture
def missions() -> dict:
    """A tree of missions on which every step helps."""
    pair = {VELOCITY: BETTER, CEP: OPEN, "fraction_improved": {VELOCITY: SHARE}}
    groups = {
        condition: [{"from": 0.0, "to": 1.0, "count": 20, **BETTER, "improved": SHARE} for _ in words]
        for condition, words in GROUP_WORDS.items()
    }
    slopes = {"away_c": {**OPEN, "step": 10.0}}
    arm = {
        "velocity_rms_mps": {"horizontal": {"value": 2.0, "interval95": [1.8, 2.2]}},
        "cep_rate_nmi_per_h": {"final": {"value": 1.0, "interval95": [0.8, 1.2]}},
    }
    return {
        "population": {"name": "worldwide", "sources": ["place", "day"]},
        "range": {"warmer_c": [-25.0, 1.0, 30.0]},
        "ensemble": {
            "size": 50,
            "simple": arm,
            "hysteresis": arm,
            "improvement": {p: dict(pair) for p in (*WHO,)},
            "attribution": {
                VELOCITY: {
                    "model_first": {"model": BETTER, "refinement": OPEN},
                    "refinement_first": {"model": OPEN, "refinement": BETTER},
                    "shapley": {"model": BETTER, "refinement": BETTER},
                    "together": BETTER,
                }
            },
        },
        "conditions": {p: {"groups": groups, "slopes": slopes} for p in (MODEL, OVEN, HEADLINE)},
        "flights": {
            "climb-cruise-landing": {"words": "the flight", "size": 200, "improvement": {HEADLINE: pair}},
            "warmer": {"words": "a warmer day", "size": 50, "improvement": {HEADLINE: pair}},
        },
    }


def told(metrics: dict) -> tuple[str, str, list[Table]]:
    """Answer, paragraphs and tables of the section."""
    answer, sections = flight_content(metrics)
    blocks = next((s.blocks for s in sections if s.heading == "Over missions"), [])
    text = " ".join(b.text for b in blocks if isinstance(b, Paragraph))
    return answer, text, [b for b in blocks if isinstance(b, Table)]


def test_the_headline_speaks_of_missions_after_the_flight(flight_metrics, missions) -> None:
    first, second, *_ = told({**flight_metrics, "missions": missions})[0].splitlines()
    assert first.startswith("Hysteresis compensation lowers")
    assert second.startswith("On 50 missions of other places, courses and days")
    assert "changes by −20 % [−30, −10] with refined hysteresis against simple compensation (better)" in second
    assert "The CEP rate (final) changes by −3 % [−10, +5] in the first case (not established)." in second


def test_without_missions_nothing_is_said_of_them(flight_metrics) -> None:
    answer, text, tables = told(flight_metrics)
    assert (text, tables) == ("", [])
    assert "missions" not in answer


@pytest.mark.parametrize("measure", [VELOCITY, CEP])
@pytest.mark.parametrize("found", list(product((BETTER, WORSE, OPEN), repeat=4)))
def test_no_advice_that_the_missions_do_not_carry(flight_metrics, missions, measure, found) -> None:
    other = {VELOCITY: CEP, CEP: VELOCITY}[measure]
    for pair, ratio in zip((MODEL, OVEN, AFTER_MODEL, EQUAL), found, strict=True):
        missions["ensemble"]["improvement"][pair][measure] = ratio
        del missions["ensemble"]["improvement"][pair][other]
    missions["ensemble"]["improvement"][MODEL].setdefault(VELOCITY, OPEN)
    text = told({**flight_metrics, "missions": missions})[1]
    model, oven, oven_after, model_after = (ratio is BETTER for ratio in found)
    assert ("either step is worth having" in text) == (model and oven)
    assert ("both together are better than either" in text) == (model and oven and oven_after and model_after)
    assert ("calibrate the hysteresis model" in text) == (model and not oven)
    assert ("so leave it out unless" in text) == (model and not oven and found[2] is WORSE)
    assert ("make the oven run" in text) == (oven and not model)
    assert ("neither step by itself" in text) == (not model and not oven)


def test_advice_may_differ_between_velocity_and_cep(flight_metrics, missions) -> None:
    tree = missions["ensemble"]["improvement"]
    tree[MODEL][CEP], tree[OVEN][CEP] = OPEN, BETTER
    tree[OVEN][VELOCITY], tree[AFTER_MODEL][VELOCITY] = OPEN, WORSE
    text = told({**flight_metrics, "missions": missions})[1]
    assert "For the horizontal velocity RMS: calibrate the hysteresis model" in text
    assert "For the CEP rate (final): make the oven run" in text


def test_where_it_helps_and_where_it_hurts(flight_metrics, missions) -> None:
    cold, near, warm = (dict(g) for g in missions["conditions"][OVEN]["groups"]["warmer_c"])
    missions["conditions"][OVEN] = {
        "groups": {"warmer_c": [cold, {**near, **OPEN}, {**warm, **WORSE}]},
        "slopes": {},
    }
    for condition, words in GROUP_WORDS.items():  # too few missions of every other kind
        if condition != "warmer_c":
            missions["conditions"][OVEN]["groups"][condition] = [{"from": 0.0, "to": 1.0, "count": 3} for _ in words]
    _, text, tables = told({**flight_metrics, "missions": missions})
    assert (
        "The oven run, given to simple compensation, helps where: more than 10 °C colder than the oven run, and "
        "hurts where: more than 10 °C warmer than the oven run. Elsewhere in the table neither is established."
    ) in text
    rows = next(t.rows for t in tables if t.title.startswith("Where a compensation helps"))
    assert rows[0][3] == "−20 % [−30, −10]; 60 %"
    assert rows[3][3] == "–"


def test_other_flights_stand_in_one_table_with_the_missions(flight_metrics, missions) -> None:
    tables = told({**flight_metrics, "missions": missions})[2]
    rows = next(t.rows for t in tables if t.title.startswith("Horizontal velocity RMS: ratios"))
    assert [row[0] for row in rows] == ["the flight", "a warmer day", "missions"]
    assert rows[0][2] == "0.80 [0.70, 0.90]"


def test_what_each_brings_is_told_in_both_orders(missions) -> None:
    text = substitutes(missions)
    assert (
        "the model multiplies the velocity error by 0.80 [0.70, 0.90] without the oven run and by 0.97 [0.90, 1.05]"
        in text
    )
    assert "Shapley" in text
    assert substitutes({"ensemble": {}}) == ""


def test_each_figure_of_missions_has_a_place(flight_metrics, missions) -> None:
    sections = flight_content({**flight_metrics, "missions": missions})[1]
    shown = [b.name for s in sections for b in s.blocks if isinstance(b, Picture) and b.name.startswith("missions_")]
    assert sorted(shown) == ["missions_by_temperature", "missions_cep_over_time"]


def test_where_nearly_all_groups_are_better_the_exceptions_are_named(flight_metrics, missions) -> None:
    missions["conditions"][MODEL]["groups"]["turns"][0] |= OPEN
    text = told({**flight_metrics, "missions": missions})[1]
    assert "helps in 12 of the 13 groups of missions below. Neither is established where: at most 2 turns" in text
