"""What a model expects of a flight, in words."""

from __future__ import annotations

from collections.abc import Mapping

from ins_eval.analysis.evaluation_numbers import LOST_MPS
from ins_eval.report.content import Number, Picture, Section, at_a_glance, table
from ins_eval.vocabulary import PREDICTED
from ins_eval.wording import significant


def prediction_content(metrics: Mapping, model: str) -> tuple[str, list[Section]]:
    """The answer and the sections of a prediction of the file `model`."""
    of = metrics["velocity_rms"]
    before, after, share = (of[name] for name in ("own_before", "own_after", "share"))
    answer = (
        "Of the horizontal velocity RMS that the sensors' own errors cause on this flight, "
        f"{significant(before['median'])} m/s, the model is expected to leave {significant(after['median'])} m/s: "
        f"{100.0 * share['median']:.0f} % (95 % interval {100.0 * share['low']:.0f} to {100.0 * share['high']:.0f} %)."
    )
    if before["median"] > LOST_MPS:
        answer += (
            f"\nAn INS that is off by more than {LOST_MPS:g} m/s is lost, and its errors no longer add up as the "
            "prediction takes them to: take a shorter flight, or one with fixes."
        )
    rows = [(words, *(significant(of[name][end]) for end in ("median", "low", "high"))) for name, words in PREDICTED]
    note = (
        "Medians and 95 % intervals over instruments that the model holds possible. Own errors are those that stay "
        "with the instrument from day to day; a switch-on draws the biases of all sensors anew, and no model of other "
        "days takes them off."
    )
    header = ("horizontal velocity RMS", "median", "low", "high")
    numbers = [
        Number(
            words.removesuffix(" [m/s]"),
            f"{shown(factor * of[name]['median'])} {unit}",
            f"95 %: {shown(factor * of[name]['low'])} to {shown(factor * of[name]['high'])} {unit}",
        )
        for name, words, factor, shown, unit in (
            (*PREDICTED[2], 100.0, "{:.0f}".format, "%"),
            (*PREDICTED[0], 1.0, significant, "m/s"),
            (*PREDICTED[1], 1.0, significant, "m/s"),
        )
    ]
    picture = Picture(
        "expected_velocity_rms", "Horizontal velocity RMS that the model expects, without it and with it."
    )
    step = f"Fly it, and hold ins-eval evaluate DIR --belief {model} of that flight against these intervals."
    expected = Section("What is expected", table("Velocity RMS", header, rows, note, align="lrrr"))
    return answer, [at_a_glance(numbers, picture, step), expected]
