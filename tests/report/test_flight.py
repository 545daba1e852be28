"""The words of the flight report follow its numbers, and missing keys leave things out."""

from __future__ import annotations

import copy

import pytest

from ins_eval.report.content import Paragraph, Picture, Table
from ins_eval.report.flight import flight_content


def ratio(value: float, low: float, high: float) -> dict:
    return {"ratio": value, "interval95": [low, high]}


def words(metrics, heading: str | None = None) -> str:
    answer, sections = flight_content(metrics)
    chosen = [s for s in sections if heading is None or s.heading == heading]
    return " ".join(
        [
            *([answer] if heading is None else []),
            *(b.text for s in chosen for b in s.blocks if isinstance(b, Paragraph)),
        ]
    )


def put(metrics, pair: str, value: dict) -> None:
    for measure in ("velocity_rms_horizontal", "cep_rate_final"):
        metrics["ensemble"]["improvement"][pair][measure] = value


def test_answer_states_gain_interval_size_and_levels(flight_metrics):
    first, levels, terms = flight_content(flight_metrics)[0].splitlines()
    assert first.startswith(
        "Hysteresis compensation lowers the horizontal velocity RMS by 20 % (95 % interval 14 to 24 %)"
    )
    assert "against simple compensation over 200 paired instruments; the difference is real." in first
    assert "CEP rate (final) by 12 % (95 % interval 3 to 18 %); the difference is real." in first
    assert "1.87 [1.74, 2.00] m/s with simple and 1.50 [1.39, 1.60] m/s with hysteresis" in levels
    assert "chamber and refined in one oven run" in terms and "With the same oven run on both sides" in terms


def test_answer_turns_with_the_ratio(flight_metrics):
    put(flight_metrics, "hysteresis_refined/simple", ratio(1.2, 1.1, 1.3))
    first = flight_content(flight_metrics)[0].splitlines()[0]
    assert "raises the horizontal velocity RMS by 20 %" in first and "is worse" in first and "lowers" not in first


def test_answer_says_not_established_where_the_interval_holds_one(flight_metrics):
    put(flight_metrics, "hysteresis_refined/simple", ratio(0.97, 0.9, 1.04))
    first = flight_content(flight_metrics)[0].splitlines()[0]
    assert first.count("not established") == 2 and "is real" not in first


def test_refinement_paragraph_follows_the_fair_comparison(flight_metrics):
    better = words(flight_metrics, "What weakens the claim")
    assert "helps beyond what the refinement gives" in better
    put(flight_metrics, "hysteresis_refined/simple_refined", ratio(0.99, 0.95, 1.03))
    assert "not established that the hysteresis model adds anything" in words(flight_metrics, "What weakens the claim")
    put(flight_metrics, "hysteresis_refined/simple_refined", ratio(1.1, 1.05, 1.15))
    assert "the hysteresis model is worse" in words(flight_metrics, "What weakens the claim")


def test_scale_factor_ablation_is_worded_both_ways(flight_metrics):
    invisible = words(flight_metrics, "What weakens the claim")
    assert "matters for navigation is not established" in invisible and "at most 0.4 % either way" in invisible
    assert "comes from its other parts" in invisible
    put(flight_metrics, "hysteresis/simple", ratio(1.1, 1.05, 1.2))
    assert "comes from its other parts" not in words(flight_metrics)
    put(flight_metrics, "hysteresis/hysteresis_without_rate", ratio(0.9, 0.85, 0.95))
    assert "is visible in navigation." in words(flight_metrics)
    put(flight_metrics, "hysteresis/hysteresis_without_rate", ratio(0.998, 0.9965, 0.9995))
    assert "is visible in navigation, but at most 0.3 %, too little to matter." in words(flight_metrics)
    put(flight_metrics, "hysteresis/hysteresis_without_rate", ratio(1.1, 1.05, 1.15))
    assert "makes navigation worse" in words(flight_metrics)


def test_single_flight_paragraph_follows_the_share_improved(flight_metrics):
    assert "cannot establish an improvement" in words(flight_metrics)
    shares = flight_metrics["ensemble"]["improvement"]["hysteresis_refined/simple"]["fraction_improved"]
    shares["velocity_rms_horizontal"] = {"value": 1.0, "interval95": [0.98, 1.0]}
    assert "cannot establish" not in words(flight_metrics)


def test_definition_spread_is_compared_with_the_published_gain(flight_metrics):
    assert "moves the number by 0.42 nmi/h, more than the gain of 0.25 nmi/h" in words(flight_metrics)
    flight_metrics["paper"]["cep"] = {"simple": 2.0, "hysteresis": 1.0}
    assert "not more than the gain of 1.00 nmi/h" in words(flight_metrics)


def test_percentiles_follow_the_numbers(flight_metrics):
    assert "in every case below" in words(flight_metrics, "Beside the published flight")
    flight_metrics["paper"]["percentile_of_paper"]["simple"]["final"]["value"] = 99.0
    assert "in 3 of the 4 cases below" in words(flight_metrics, "Beside the published flight")


def test_budget_names_the_largest_source_and_whether_it_is_touched(flight_metrics):
    text = words(flight_metrics, "Where the error comes from")
    assert "CEP rate (final) the largest single source under simple compensation is gyros" in text
    assert "does not act on it" in text
    beside = {"simple": {"cep_rate_final": {"value": 9.0, "interval95": [8.0, 10.0]}}}
    flight_metrics["budget"]["accelerometer_cross_terms"] = beside  # not in the flight, so not its largest source
    assert "CEP rate (final) the largest single source under simple compensation is gyros" in words(flight_metrics)
    flight_metrics["budget"]["gyro"]["hysteresis_refined"]["cep_rate_final"]["value"] = 0.1
    assert "does not act on it" not in words(flight_metrics, "Where the error comes from")


def test_nearest_to_the_paper_is_stated_with_its_sign(flight_metrics):
    text = words(flight_metrics, "Beside the published flight")
    assert "at most 0.10 m/s" in text and "below the published" in text


def test_every_pair_and_a_users_model_are_in_the_tables(flight_metrics):
    _, sections = flight_content(flight_metrics)
    tables = {b.title: b for s in sections for b in s.blocks if isinstance(b, Table)}
    assert len(tables["Change from one compensation to another"].rows) == len(flight_metrics["ensemble"]["improvement"])
    assert any(row[0] == "mine" for row in tables["Velocity RMS [m/s]"].rows)
    for table in tables.values():
        assert all(len(row) == len(table.header) == len(table.alignment) for row in table.rows), table.title


def test_a_users_model_leads_the_report(flight_metrics):
    assert not any("mine" in line for line in flight_content(flight_metrics)[0].splitlines())
    flight_metrics["own_models"] = ["mine"]
    answer, sections = flight_content(flight_metrics)
    first, second, *_ = answer.splitlines()
    assert first == (
        "Over 200 paired instruments, all as the chamber left them, your model “mine” changes the horizontal velocity "
        "RMS by −10 % [−13, −6] against simple (better) and −2 % [−6, +3] against hysteresis (not established)."
    )
    assert second.startswith("Of the compensations beside it, hysteresis compensation lowers")
    numbers, step, _ = sections[0].blocks
    assert [one.value for one in numbers.items] == ["−10 %", "−2 %", "+2 %"]
    assert all("mine against" in one.what for one in numbers.items)
    own = next(b for b in sections[1].blocks if isinstance(b, Table))
    assert own.header[1:4] == ("mine", "simple", "hysteresis")
    assert own.rows[0][4:] == ("−10 % [−13, −6], better", "−2 % [−6, +3], not established")
    assert "INSTRUMENTS=" in step.text
    tables = {b.title: b for s in sections for b in s.blocks if isinstance(b, Table)}
    assert tables["CEP at fixed times [nmi]"].header[1:] == (
        "mine", "simple", "simple, refined", "hysteresis", "hysteresis, refined"
    )  # fmt: skip
    assert tables["Instruments that improve from hysteresis to mine"].rows


@pytest.mark.parametrize(
    ("against_hysteresis", "step"),
    [
        (ratio(0.9, 0.85, 0.95), "Take “mine”"),
        (ratio(1.1, 1.05, 1.15), "Keep hysteresis"),
        (ratio(0.98, 0.9604, 1.0), "about 200 instruments would show it"),  # the interval ends at 1 already
        (ratio(0.99, 0.95, 1.03), "about 3300 instruments would show it"),
        (ratio(1.0, 0.95, 1.05), "cheaper to calibrate"),
    ],
)
def test_what_to_do_with_a_users_model_follows_from_hysteresis(flight_metrics, against_hysteresis, step):
    flight_metrics["own_models"] = ["mine"]
    put(flight_metrics, "mine/hysteresis", against_hysteresis)
    assert step in words(flight_metrics, "At a glance")


def test_three_numbers_have_intervals(flight_metrics):
    numbers = flight_content(flight_metrics)[1][0].blocks[0].items
    assert [(one.value, one.interval) for one in numbers] == [
        ("−20 %", "95 %: −24 to −14 %; better"),
        ("−12 %", "95 %: −18 to −3 %; better"),
        ("74 %", "95 %: 68 to 80 %"),
    ]


def test_every_figure_of_the_report_has_a_place(flight_metrics, drawn):
    _, sections = flight_content(flight_metrics)
    shown = [b.name for s in sections for b in s.blocks if isinstance(b, Picture)]
    of_others = {
        name
        for name in drawn
        if name.startswith(
            ("activity", "allan_", "attitude", "error_gr", "sensor_", "missions_", "side_", "temperature_laws")
        )
    }
    assert set(shown) == set(drawn) - of_others and len(shown) == len(set(shown))


def paths(tree: dict, before: tuple = ()) -> list[tuple]:
    found = []
    for key, value in tree.items():
        found.append((*before, key))
        if isinstance(value, dict) and not {"value", "ratio"} & set(value):
            found += paths(value, (*before, key))
    return found


@pytest.mark.parametrize("depth", [1, 2, 3, 4])
def test_any_missing_key_is_survived(depth, flight_metrics):
    for path in (p for p in paths(flight_metrics) if len(p) == depth):
        if path[:2] == ("paper", "cep") and len(path) == 3:
            continue  # the two numbers of the paper come together
        cut = copy.deepcopy(flight_metrics)
        branch = cut
        for key in path[:-1]:
            branch = branch[key]
        del branch[path[-1]]
        answer, sections = flight_content(cut)
        assert answer and "None" not in answer + words(cut), path
        assert all(section.blocks for section in sections)


def test_empty_metrics_give_an_honest_answer():
    answer, sections = flight_content({})
    assert answer.startswith("These metrics hold no paired comparison") and sections == []
