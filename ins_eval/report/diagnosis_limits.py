"""What the recordings of a diagnosis cannot show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ins_eval.effects import VOCABULARY
from ins_eval.report.content import Block, paragraphs, table
from ins_eval.report.diagnosis_words import effect_words
from ins_eval.wording import MISSING, fixed, joined, sentence, significant

INVISIBLE = 1.0  # expected log Bayes factor below which an effect of usual size does not show
FAR = 1000.0  # usual sizes, beyond which no size is said to show


def limits(tree: Mapping) -> list[Block]:
    """Effects that would not show at their usual size, the axes of each name in one row."""
    of_name: dict[str, list[Mapping]] = {}
    for one in tree["limits"]:
        if one["expected_log_bayes_factor"] < INVISIBLE:
            of_name.setdefault(one["name"], []).append(one)
    rows: list[Any] = []
    shown_by: dict[Any, Any] = {}
    for name, ones in sorted(of_name.items()):
        words = effect_words({"name": name})
        best = max(one["expected_log_bayes_factor"] for one in ones)
        usual = significant(ones[0]["usual"], 2)
        rows.append((words, _axes(ones), usual, ones[0]["unit"], fixed(best, 1), _from(ones)))
        shown_by.setdefault(VOCABULARY[name].excited_by, []).append(words)
    header = ("effect", "axes", "usual size", "unit", "expected log Bayes factor", "shows from")
    note = (
        f"Alone, at its usual size, each is expected to gain less than {INVISIBLE:g} nat: that it was not found says "
        "nothing about it. Shows from: the size from which it is expected to be found, on the axis that shows it best."
    )
    blocks: list[Block] = table("Too small to show at their usual size", header, rows, note, align="llrlrr")
    needed = [(what, ", ".join(names)) for what, names in shown_by.items()]
    blocks += table("What would show them", ("what is needed", "effects"), needed, align="ll")
    if not blocks:
        blocks += paragraphs("Every effect that was asked about would show at its usual size.")
    if tree["absent"]:
        words = joined(_absent(tree["absent"]))
        blocks += paragraphs(
            sentence(f"Not asked about, because the recording has nothing that would show it: {words}")
        )
    return blocks


def _from(ones: Sequence[Mapping]) -> str:
    """The smallest size that shows."""
    sizes = [one["shows_from"] for one in ones if one["shows_from"] is not None]
    if not sizes:
        return MISSING
    most = FAR * ones[0]["usual"]
    return f"above {significant(most, 2)}" if min(sizes) > most else significant(min(sizes), 2)


def _absent(names: Sequence[str]) -> list[str]:
    """The names that were not asked about; one word for all of a sensor."""
    words = []
    for sensor in dict.fromkeys(name.partition(".")[0] for name in VOCABULARY):
        own = [name for name in VOCABULARY if name.partition(".")[0] == sensor]
        absent = [name for name in own if name in names]
        if len(absent) == len(own) > 1:
            words.append(f"every effect of {effect_words({'name': sensor})}")
        else:
            words += [effect_words({"name": name}) for name in absent]
    return words


def _axes(ones: Sequence[Mapping]) -> str:
    """``x, y`` or, with the other axes, ``x with y/z``."""
    others: dict[str, list[str]] = {}
    for one in sorted(ones, key=lambda one: (one["axis"] or "", one["other_axis"] or "")):
        others.setdefault(one["axis"] or "", []).append(one["other_axis"] or "")
    return (
        ", ".join(f"{axis} with {'/'.join(with_)}" if any(with_) else axis for axis, with_ in others.items()) or MISSING
    )
