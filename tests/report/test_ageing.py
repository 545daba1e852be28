"""The words on storage follow its numbers, and missing keys leave things out."""

from __future__ import annotations

import copy

import pytest

from ins_eval.report.ageing import ageing_blocks
from ins_eval.report.content import Paragraph, Table

MEASURES = ("velocity_rms_horizontal", "velocity_rms_down", "cep_rate_final")
STATES = ("fresh", "drifted", "self_calibrated")


def ratio(value: float, low: float, high: float) -> dict:
    return {"ratio": value, "interval95": [low, high]}


def both(drifted: float, self_calibrated: float) -> dict:
    return {"drifted": drifted, "self_calibrated": self_calibrated}


@pytest.fixture
def storage() -> dict:
    """Invented but plausible; no number here is a result."""
    open_ratio = dict.fromkeys(MEASURES, ratio(1.002, 0.999, 1.004))
    estimate = dict.fromkeys(MEASURES, {"value": 1.8, "interval95": [1.6, 2.0]})
    names = ("simple", "hysteresis_refined")
    steps = ("drifted/fresh", "self_calibrated/drifted", "self_calibrated/fresh")
    felt = {"drifted_mps": 0.031, "self_calibrated_mps": 0.006}
    vertical = {"down_mps": 0.006, "height_m": 0.12, "felt_mps2": 9.5e-4, "free_height_m": 187.0}
    return {
        "years": 1.0,
        "size": 40,
        "gains": {
            "feedback_ppm": 98.3,
            "forward_ppm": 101.5,
            "torquer_ppm": 5.04,
            "current_ppm": 4.9,
            "warmer_c": 2.0,
            "estimate_error_ppm": 18.5,
            "estimate_error_ppm_per_c": 9.0,
        },
        "scale_ppm": both(95.8, 19.0),
        "compensations": {name: dict.fromkeys(STATES, estimate) for name in names},
        "change": {name: dict.fromkeys(steps, open_ratio) for name in names},
        "hysteresis": dict.fromkeys(STATES, dict.fromkeys(MEASURES, ratio(0.8, 0.7, 0.9))),
        "final_m": dict.fromkeys(names, both(41.9, 6.6)),
        "alone": {
            "whole_mps": {
                "found": both(0.0455, 0.0079),
                "given": both(0.0454, 0.0079),
                "difference": both(6e-4, 1e-4),
            },
            "phases": [{"name": "cruise", "from_s": 1800.0, "to_s": 7200.0, **felt}],
            "manoeuvres": [
                {"name": f"turn left by {k} degrees", "from_s": k, "to_s": k + 50, **felt, "axes_mps": [0.0, 0.0, 0.03]}
                for k in range(90, 170, 10)
            ],
            "vertical": both(vertical, vertical),
        },
    }


def blocks_of(storage: dict) -> tuple[str, dict[str, Table]]:
    blocks = ageing_blocks({"storage": storage})
    words = " ".join(f"{b.lead} {b.text}" for b in blocks if isinstance(b, Paragraph))
    return words, {b.title.split(":")[0]: b for b in blocks if isinstance(b, Table)}


def test_numbers_stand_in_the_words(storage: dict) -> None:
    words, tables = blocks_of(storage)
    for expected in (
        "after 1 year between",
        "drifted by 98 ppm RMS",
        "finds the first to 18 ppm RMS",
        "costs 9.0 ppm RMS",
        "makes 4.5 cm/s of horizontal velocity error, 0.8 cm/s after self-calibration",
        "+0.2 % [−0.1, +0.4], at most 0.4 % either way; added in squares to 1.80 m/s it would be +0.03 %",
        "4.55 cm/s with the attitude found on the stand and 4.54 cm/s with it given, never more than 0.06 cm/s",
        "wrong by 1.7 µg RMS",
        "as 97 µg RMS of gravity",
        "off by 187 m after 10 min",
    ):
        assert expected in words, expected
    assert len(tables) == 3
    for table in tables.values():
        assert all(len(row) == len(table.header) == len(table.alignment) for row in table.rows), table.title


def test_verdicts_follow_the_intervals(storage: dict) -> None:
    changed = copy.deepcopy(storage)
    changed["change"]["simple"]["drifted/fresh"] = dict.fromkeys(MEASURES, ratio(1.1, 1.05, 1.15))
    for of, expected in ((storage, "not established"), (changed, "worse")):
        row = blocks_of(of)[1]["What storage, self-calibration and hysteresis compensation change"].rows[0]
        assert row[:2] == ("simple", "stored against fresh") and row[3] == expected
    assert "+10 % [+5, +15], at most 15.0 % either way" in blocks_of(changed)[0]


def test_largest_manoeuvres_are_shown_with_their_axes(storage: dict) -> None:
    rows = blocks_of(storage)[1]["Where a drift of the scale factor shows"].rows
    assert rows[0][:4] == ("cruise", "1800 to 7200", "3.1", "0.6")
    assert len(rows) == 1 + 6
    assert rows[1] == ("turn left by 90°", "90 to 140", "3.1", "0.6", "0.0", "0.0", "3.0")


def test_a_large_drift_is_not_called_invisible(storage: dict) -> None:
    assert "nearly invisible" in blocks_of(storage)[0] and "neither hides nor adds" in blocks_of(storage)[0]
    storage["alone"]["whole_mps"]["found"]["drifted"] = 0.4
    storage["alone"]["whole_mps"]["difference"]["drifted"] = 0.1
    assert "not small beside" in blocks_of(storage)[0] and "neither hides nor adds" not in blocks_of(storage)[0]


def test_years_are_spelt(storage: dict) -> None:
    storage["years"] = 2.5
    assert "after 2.5 years between" in blocks_of(storage)[0]


def paths(tree: dict, before: tuple = ()) -> list[tuple]:
    found = []
    for key, value in tree.items():
        found.append((*before, key))
        if isinstance(value, dict):
            found += paths(value, (*before, key))
    return found


def test_any_missing_key_is_survived(storage: dict) -> None:
    whole = len(ageing_blocks({"storage": storage}))
    for path in paths(storage):
        cut = copy.deepcopy(storage)
        branch = cut
        for key in path[:-1]:
            branch = branch[key]
        del branch[path[-1]]
        found = ageing_blocks({"storage": cut})
        assert 0 < len(found) <= whole, path
    assert ageing_blocks({}) == []
