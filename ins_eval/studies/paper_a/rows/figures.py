"""Values of the rows of the figures: no curve can be read off the paper, so captions and text are judged."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ins_eval.studies.paper_a.printed import PRINTED, UNITS
from ins_eval.studies.paper_a.rows.audited import audited
from ins_eval.tables import pick

LETTERS = "abc"
CURVES = {"a": ("east", "longitude"), "b": ("north", "latitude")}
ERRORS = ("latitude", "longitude", "position")


def values(results: Mapping, ours: Mapping) -> dict[str, dict[str, Any]]:
    """All of them."""
    audit, position = audited(), pick(ours, "oven_position")
    best = min(range(len(UNITS)), key=lambda k: PRINTED[UNITS[k]]["table4"]["hysteresis"])
    found: dict[str, dict[str, Any]] = {
        "A-F6": {
            "name": UNITS[best],
            "recomputed": audit["residual_peak_to_peak_ppm"][best],
            "ours": pick(results, "chamber", "residual_rms_ppm", UNITS[best], "hysteresis"),
        }
    }
    for letter, unit, loop in zip(LETTERS, UNITS, audit["falling_minus_rising_ppm"], strict=True):
        found[f"A-F5/{letter}"] = {"name": unit, "recomputed": loop}
        found[f"A-F7/{letter}"] = {"name": unit}
    for letter, (axis, place) in CURVES.items():
        found[f"A-F9/{letter}"] = {"axis": axis, "ours": pick(results, "oven", "best_of_ten", "given", axis)}
        found[f"A-F10/{letter}"] = {
            "place": place,
            "ours": pick(position, f"best_{axis}"),
            "median": pick(position, f"median_{axis}"),
            "improved": position and 100.0 * position[f"improved_{axis}"],
        }
        found[f"A-F12/{letter}"] = {"axis": axis}
    for letter, of in zip(LETTERS, ERRORS, strict=True):
        single = pick(results, "flight", "position_improved", of)
        found[f"A-F13/{letter}"] = {
            "of": of,
            "remark": " (the caption has (b) twice)" if letter == "c" else "",
            "ours": pick(results, "flight", "position_ratio", of),
            "improved": single and 100.0 * single,
        }
    return found
