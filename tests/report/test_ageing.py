"""The words on storage follow its numbers."""

from __future__ import annotations

from dataclasses import replace

import pytest

from ins_eval.analysis.ageing import AgeingNumbers, Alone, Felt, Gains, VerticalChannel, WholeFlight
from ins_eval.metrics import Estimate, Ratio
from ins_eval.report.ageing import ageing_blocks
from ins_eval.report.content import Paragraph, Table

MEASURES = ("velocity_rms_horizontal", "velocity_rms_down", "cep_rate_final")
STATES = ("fresh", "drifted", "self_calibrated")


def both(drifted, self_calibrated) -> dict:
    return {"drifted": drifted, "self_calibrated": self_calibrated}


@pytest.fixture
def storage() -> AgeingNumbers:
    """Invented but plausible; no number here is a result."""
    open_ratio = dict.fromkeys(MEASURES, Ratio(1.002, 0.999, 1.004, 0.001))
    estimate = dict.fromkeys(MEASURES, Estimate(1.8, 1.6, 2.0))
    names = ("simple", "hysteresis_refined")
    steps = ("drifted/fresh", "self_calibrated/drifted", "self_calibrated/fresh")
    vertical = VerticalChannel(0.006, 0.12, 9.5e-4, 187.0)
    turns = tuple(
        Felt(f"turn left by {k} degrees", k, k + 50, 0.031, 0.006, (0.0, 0.0, 0.03)) for k in range(90, 170, 10)
    )
    return AgeingNumbers(
        years=1.0,
        size=40,
        gains=Gains(98.3, 101.5, 5.04, 4.9, 2.0, 18.5, 9.0),
        scale_ppm=both(95.8, 19.0),
        compensations={name: dict.fromkeys(STATES, estimate) for name in names},
        change={name: dict.fromkeys(steps, open_ratio) for name in names},
        hysteresis=dict.fromkeys(STATES, dict.fromkeys(MEASURES, Ratio(0.8, 0.7, 0.9, 0.06))),
        final_m=dict.fromkeys(names, both(41.9, 6.6)),
        alone=Alone(
            WholeFlight(both(0.0455, 0.0079), both(0.0454, 0.0079), both(6e-4, 1e-4)),
            (Felt("cruise", 1800.0, 7200.0, 0.031, 0.006),),
            turns,
            both(vertical, vertical),
        ),
    )


def blocks_of(storage: AgeingNumbers) -> tuple[str, dict[str, Table]]:
    blocks = ageing_blocks(storage)
    words = " ".join(f"{b.lead} {b.text}" for b in blocks if isinstance(b, Paragraph))
    return words, {b.title.split(":")[0]: b for b in blocks if isinstance(b, Table)}


def test_numbers_stand_in_the_words(storage: AgeingNumbers) -> None:
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


def test_verdicts_follow_the_intervals(storage: AgeingNumbers) -> None:
    worse = {**storage.change["simple"], "drifted/fresh": dict.fromkeys(MEASURES, Ratio(1.1, 1.05, 1.15, 0.02))}
    changed = replace(storage, change={**storage.change, "simple": worse})
    for of, expected in ((storage, "not established"), (changed, "worse")):
        row = blocks_of(of)[1]["What storage, self-calibration and hysteresis compensation change"].rows[0]
        assert row[:2] == ("simple", "stored against fresh") and row[3] == expected
    assert "+10 % [+5, +15], at most 15.0 % either way" in blocks_of(changed)[0]


def test_largest_manoeuvres_are_shown_with_their_axes(storage: AgeingNumbers) -> None:
    rows = blocks_of(storage)[1]["Where a drift of the scale factor shows"].rows
    assert rows[0][:4] == ("cruise", "1800 to 7200", "3.1", "0.6")
    assert len(rows) == 1 + 6
    assert rows[1] == ("turn left by 90 degrees", "90 to 140", "3.1", "0.6", "0.0", "0.0", "3.0")


def test_a_large_drift_is_not_called_invisible(storage: AgeingNumbers) -> None:
    assert "nearly invisible" in blocks_of(storage)[0] and "neither hides nor adds" in blocks_of(storage)[0]
    whole = replace(storage.alone.whole_mps, found=both(0.4, 0.0079), difference=both(0.1, 1e-4))
    words = blocks_of(replace(storage, alone=replace(storage.alone, whole_mps=whole)))[0]
    assert "not small beside" in words and "neither hides nor adds" not in words


def test_years_are_spelt(storage: AgeingNumbers) -> None:
    assert "after 2.5 years between" in blocks_of(replace(storage, years=2.5))[0]
