"""What a model expects of a flight, in words."""

from __future__ import annotations

from collections.abc import Mapping

from ins_eval.report.content import Section, table
from ins_eval.wording import fixed

ROWS = (
    ("own_before", "errors of the sensors, without the model [m/s]"),
    ("own_after", "the same with the model [m/s]"),
    ("share", "share that is left"),
    ("with_switch_on_before", "with what a switch-on draws anew, without the model [m/s]"),
    ("with_switch_on_after", "the same with the model [m/s]"),
)


def prediction_content(metrics: Mapping) -> tuple[str, list[Section]]:
    """The answer and the sections of a prediction."""
    of = metrics["velocity_rms"]
    before, after, share = (of[name] for name in ("own_before", "own_after", "share"))
    answer = (
        f"Of the horizontal velocity RMS that the sensors' own errors cause on this flight, {fixed(before['median'])} "
        f"m/s, the model is expected to leave {fixed(after['median'])} m/s: {100.0 * share['median']:.0f} % "
        f"(95 % interval {100.0 * share['low']:.0f} to {100.0 * share['high']:.0f} %)."
    )
    rows = [(words, *(fixed(of[name][end]) for end in ("median", "low", "high"))) for name, words in ROWS]
    note = (
        "Medians and 95 % intervals over instruments that the model holds possible. Own errors are those that stay "
        "with the instrument from day to day; a switch-on draws the biases of all sensors anew, and no model of other "
        "days takes them off."
    )
    header = ("horizontal velocity RMS", "median", "low", "high")
    return answer, [Section("What is expected", table("Velocity RMS", header, rows, note, align="lrrr"))]
