"""The rows: none is missing, each has a verdict that follows the rule, with and without results."""

from __future__ import annotations

import copy
import json
import math
from dataclasses import asdict

import pytest

from ins_eval.studies.paper_b.rows import CHOSEN, GROUPS, REQUIRED, rows
from ins_eval.studies.papers import (
    COMPATIBLE,
    CONTRADICTS,
    GIVEN,
    NOT_COMPUTED,
    NOT_REPRODUCED,
    REPRODUCED,
    VERDICTS,
    Row,
    head,
)
from ins_eval.tables import pick

# everything that Paper B contains, listed apart from the code
TABLES = ["B-T1", "B-T2", "B-T3", "B-T4"]
MODULES = {  # a word that the title has to hold
    "B-M1": "k0 = m L",
    "B-M2": "1/(J s² + C s + D)",
    "B-M3": "k1 = 2 C0 l/d",
    "B-M4": "bridge",
    "B-M5": "Analog-to-digital",
    "B-M6": "Demodulator",
    "B-M7": "Controller",
    "B-M8": "DA2",
    "B-M9": "Voltage-to-current",
    "B-M10": "Torquer",
    "B-M11": "Switch M1",
    "B-M12": "Sequencer",
    "B-M13": "resistor",
    "B-M14": "Static test",
    "B-M15": "3 °C",
}
EQUATIONS = [
    *("B-E1", "B-E2", "B-E3", "B-E4", "B-E5", "B-E6", "B-E7", "B-E8", "B-E9", "B-E10", "B-E11"),
    *("B-E12", "B-E13", "B-E14", "B-E15", "B-E16", "B-E17", "B-E18", "B-E19", "B-E20", "B-E21"),
    *("B-E22", "B-E23", "B-E24", "B-E25", "B-E26", "B-E27", "B-E28", "B-E29", "B-E30", "B-E31"),
]
PROCEDURE = ["B-P1", "B-P2", "B-P3", "B-P4", "B-P5"]
FIGURES = [
    *("B-F1", "B-F2", "B-F3", "B-F4", "B-F5", "B-F6", "B-F7", "B-F8", "B-F9", "B-F10", "B-F11", "B-F12", "B-F13"),
]
STUDIES = {"B-S1": "stability", "B-S2": "5 ppm a year", "B-S3": "Sources of the residual"}
CLAIMS = {
    "B-C1": "90.26 %",
    "B-C2": "90.92 %",
    "B-C3": "87.56 %",
    "B-C4": "in a year",
    "B-C5": "turntable",
    "B-C6": "mass",
    "B-C7": "stiffness",
    "B-C8": "reference capacitors",
    "B-C9": "proportional",
    "B-C10": "stop",
    "B-C11": "undone in the controller",
    "B-C12": "Electrostatic",
    "B-C13": "drift little",
    "B-C14": "constant current",
    "B-C15": "separated",
    "B-C16": "10 ppm",
    "B-C17": "fluctuates",
    "B-C18": "magnet",
    "B-C19": "stable temperature",
    "B-C20": "static precision",
    "B-C21": "output",
    "B-C22": "long-term",
    "B-C23": "resistor",
    "B-C24": "laboratory",
}
INCONSISTENCIES = [
    *("B1", "B2", "B3", "B4", "B5", "B6", "B7", "B8", "B9", "B10", "B11"),
    *("B12", "B13", "B14", "B15", "B16", "B17", "B18", "B19", "B20", "B21", "B22"),
]
ALL = {*TABLES, *MODULES, *EQUATIONS, *PROCEDURE, *FIGURES, *STUDIES, *CLAIMS, *INCONSISTENCIES}
REPETITIONS = [f"B-T{table}/{k}" for table in (3, 4) for k in range(1, 7)]
DEPENDENT = (  # rows whose verdict rests on results of the run
    *REPETITIONS,
    "B-T3/mean",
    "B-T4/residual",
    "B-E9",
    "B-E19",
    "B-E23",
    "B-E28",
    "B-E30",
    "B-P3",
    "B-P4",
    "B-P5/value",
    "B-F12",
    "B-F13",
    "B-S1",
    "B-C1",
    "B-C3",
    "B-C11",
    "B-C12",
    "B-C15",
    "B-C22",
    "B-C24",
    "B13",
    "B14",
)


def by_id(found: list[Row]) -> dict[str, Row]:
    return {row.id: row for row in found}


@pytest.fixture
def full(results: dict) -> list[Row]:
    return rows(results)


@pytest.fixture(scope="module")
def bare() -> list[Row]:
    return rows({})


def test_nothing_is_missing_and_nothing_is_invented(full: list[Row]) -> None:
    assert set(REQUIRED) == ALL
    assert len(REQUIRED) == len(set(REQUIRED))
    assert {row.id.partition("/")[0] for row in full} == ALL
    assert set(REPETITIONS) <= set(by_id(full))


def test_the_rows_are_the_same_whatever_was_computed(full: list[Row], bare: list[Row]) -> None:
    assert [row.id for row in full] == [row.id for row in bare]
    assert len({row.id for row in full}) == len(full)


@pytest.mark.parametrize("which", ["full", "bare"])
def test_every_row_is_complete(which: str, request: pytest.FixtureRequest) -> None:
    for row in request.getfixturevalue(which):
        assert row.verdict in VERDICTS
        assert row.group in GROUPS and row.title and row.reason.endswith("."), row
        assert "None" not in row.reason and "nan" not in row.reason, row
        for value in (row.printed, row.recomputed, row.ours):
            assert value is None or isinstance(value, str) or math.isfinite(value), row
        if row.interval95 is not None:
            low, high = row.interval95
            assert low <= high and row.ours is not None, row
    json.dumps([asdict(row) for row in request.getfixturevalue(which)], allow_nan=False)


def test_rows_say_what_they_are_of(full: list[Row]) -> None:
    for id, word in (MODULES | STUDIES | CLAIMS).items():
        first = next(row for row in full if row.id.partition("/")[0] == id)
        assert word in first.title, id
    for k, id in enumerate(EQUATIONS, 1):
        assert by_id(full)[id].title.startswith(f"Eq. ({k})")


def test_without_results_ours_is_empty_and_says_so(bare: list[Row]) -> None:
    found = by_id(bare)
    for id in DEPENDENT:
        assert found[id].ours is None and found[id].interval95 is None
        assert found[id].verdict == NOT_REPRODUCED and found[id].reason == NOT_COMPUTED, id


def test_with_results_they_are_decided(full: list[Row]) -> None:
    assert not [row.id for row in full if NOT_COMPUTED in row.reason]


def test_a_contradiction_rests_on_the_paper_alone(full: list[Row], bare: list[Row]) -> None:
    contradictions = [{row.id for row in found if row.verdict == CONTRADICTS} for found in (full, bare)]
    assert contradictions[0] == contradictions[1]
    heads = {id for id in contradictions[0] if not id.startswith("B-")}
    assert heads == {"B1", "B3", "B4", "B5", "B6", "B7", "B9", "B10", "B11", "B12", "B15", "B16", "B19"}


def test_the_interval_decides(results: dict) -> None:
    inside = by_id(rows(results))["B-T4/1"]
    assert inside.verdict == COMPATIBLE and inside.printed == 223.03
    assert inside.ours == 200.0 and inside.interval95 == inside.passes == (168.0, 232.0)
    assert "holds 200, where nothing is found" in inside.reason and "about 10 %" in inside.chosen
    assert "single repetitions" in inside.reason and "chosen after this table" in inside.reason
    results["population"]["feedback_repetition_ppm"]["interval95"] = [168.0, 222.0]
    outside = by_id(rows(results))["B-T4/1"]
    assert outside.verdict == NOT_REPRODUCED and "outside" in outside.reason


def test_what_was_chosen_after_the_tables_is_never_what_decides(full: list[Row]) -> None:
    found = by_id(full)
    for id in ("B-T3/scatter", "B-T4/gain", "B-M2", "B-C10", "B-S2"):
        assert found[id].verdict == NOT_REPRODUCED and found[id].reason.startswith(GIVEN), id


def test_without_the_identified_unit_no_verdict_changes(results: dict, full: list[Row]) -> None:
    del results["unit"]["closure_ug"]
    results["unit"]["forward_ppm"], results["unit"]["feedback_ppm"] = [-20.0] * 6, [900.0] * 6
    assert [row.verdict for row in rows(results)] == [row.verdict for row in full]


def test_numbers_of_the_audit_stand_in_their_rows(full: list[Row]) -> None:
    found = by_id(full)
    assert found["B9"].recomputed == pytest.approx(-199.96, abs=0.005)
    assert "12.2 standard errors" in found["B10"].reason and "98.1 and 98.2 %" in found["B10"].reason
    assert found["B12"].recomputed == pytest.approx(804.17, abs=0.005)
    assert found["B21"].recomputed == pytest.approx(25.15, abs=0.005) and "25.2 ppm" in found["B21"].reason
    assert "-100 / -160 / -180 / -196 ppm" in found["B22"].reason
    assert found["B-C2"].recomputed == pytest.approx(109.08, abs=0.005)


@pytest.mark.parametrize(
    ("path", "value", "id"),
    [
        (("exact", "forward_ppm"), -180.0, "B-E19"),
        (("exact", "feedback_ppm"), 210.0, "B-E28"),
        (("exact", "compensated_ug"), 5.0, "B-E30"),
        (("exact", "switch_open_ug"), 0.4, "B-M11"),
        (("exact", "rejected_scatter_ppm"), 3.0, "B-E23"),
        (("exact", "forward_current_ppm"), 7.0, "B-C15"),
        (("exact", "counts_off"), 25200.0, "B-E25"),
        (("exact", "counts_on"), -46600.0, "B-E24"),
        (("exact", "counts_on_less_off"), -71700.0, "B-F7"),
        (("exact", "forward_ppm"), -180.0, "B-F5"),
        (("population", "feedback_baseline_scatter_ppm", "interval95"), [2.0, 90.0], "B-F12"),
        (("quiet", "feedback_scatter_ppm"), 4.0, "B-C17"),
        (("stability", "compensated", "crossover_hz"), 121.0, "B-C11"),
        (("year", "after_ug"), 80.0, "B-C22"),
        (("temperature", "far", "tests_and_output", "output_ug", "interval95"), [20.0, 30.0], "B-C24"),
        (("temperature", "far", "tests_and_output", "feedback_ppm", "interval95"), [9.0, 11.0], "B-C24"),
        (("temperature", "far", "other_unit", "forward_ppm", "interval95"), [5.0, 9.0], "B-C24"),
        (("population", "output_residual_percent", "interval95"), [101.0, 120.0], "B-F13"),
    ],
)
def test_a_statement_that_fails_is_not_reproduced(path: tuple[str, ...], value: object, id: str, results: dict) -> None:
    assert by_id(rows(results))[id].verdict == REPRODUCED
    changed = copy.deepcopy(results)
    pick(changed, *path[:-1])[path[-1]] = value
    assert by_id(rows(changed))[id].verdict == NOT_REPRODUCED


@pytest.mark.parametrize(
    ("path", "value"), [(("added_scatter_ppm", "held"), 12.0), (("carrier_v",), 6.0), (("excited_v",), 0.2)]
)
def test_attraction_spoils_the_rejected_test_where_it_scatters_or_pulls_in(
    path: tuple[str, ...], value: float, results: dict
) -> None:
    assert by_id(rows(results))["B-C12"].verdict == NOT_REPRODUCED
    pick(results, "attraction", *path[:-1])[path[-1]] = value
    assert by_id(rows(results))["B-C12"].verdict == REPRODUCED


def test_a_claim_that_the_interval_holds_in_part_is_compatible(results: dict) -> None:
    results["population"]["output_residual_percent"]["interval95"] = [1.0, 120.0]
    assert by_id(rows(results))["B-F13"].verdict == COMPATIBLE


def test_sizes_that_the_smallest_would_pass_prove_little(results: dict, full: list[Row]) -> None:
    found = by_id(full)
    for id in ("B-T3/mean", "B-T4/mean", "B-T3/residual", "B-P4", "B-P5/value", "B-C1", "B-C3", "B-C20", "B13", "B20"):
        assert found[id].verdict == COMPATIBLE, id
    results["population"]["compensated_ug"]["interval95"] = [0.0, 20.0]
    assert by_id(rows(results))["B-P4"].verdict == NOT_REPRODUCED


def test_what_was_chosen_with_a_table_in_view_is_marked_there_and_never_reproduced(full: list[Row]) -> None:
    for row in full:
        assert bool(row.chosen) == (head(row.id) in CHOSEN and row.ours is not None and row.verdict != CONTRADICTS)
        assert not (row.chosen and row.verdict == REPRODUCED), row.id


def test_a_definition_or_a_step_is_no_test(full: list[Row]) -> None:
    found = by_id(full)
    for id in ("B-M12", "B-E14", "B-E18", "B-E20", "B-E27", "B-E29", "B-P1", "B-P2", "B-F2", "B-F9"):
        assert found[id].verdict == NOT_REPRODUCED and found[id].reason.startswith(GIVEN), id


def test_closure_passes_only_near_the_printed_value(full: list[Row]) -> None:
    low, high = by_id(full)["B21"].passes
    assert low == pytest.approx(25.15 - 1.98, abs=0.05) and high == pytest.approx(25.15 + 1.98, abs=0.05)
