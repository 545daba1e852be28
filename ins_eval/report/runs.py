"""Results of several runs side by side, in words and tables."""

from __future__ import annotations

from collections.abc import Sequence

from ins_eval.analysis.results import UNITS, Change, RunComparison
from ins_eval.figures.style import label
from ins_eval.metrics import Estimate
from ins_eval.report.content import Number, Picture, Section, at_a_glance, paragraphs, table
from ins_eval.report.several import called
from ins_eval.vocabulary import measure_name
from ins_eval.wording import MISSING, change, fixed, joined, sentence

SPOKEN = ("velocity_rms_horizontal", "cep_rate_final", "radial_error_rate_final", "final_radial_error")  # first
DIGITS = {"velocity_rms": 3, "cep_rate": 3, "radial_error_rate": 3, "final_radial_error": 1}


def runs_content(found: RunComparison) -> tuple[str, list[Section]]:
    """The answer and the sections of runs that stand side by side."""
    runs, changes = [run.name for run in found.runs], found.changes
    header = ["compensation", "measure", "unit", "pairs", runs[0]]
    for run in runs[1:]:
        header += [run, "change"]
    rows = [_row(one) for one in changes]
    note = (
        f"Changes are from {runs[0]}. Over the pairs, the recordings or instruments that all runs have: velocity RMS "
        "and radial error at the end as root mean square, radial error rates as median. 95 % intervals: bootstrap over "
        "the pairs."
    )
    words = f"Not in all runs, and left out: {joined(found.lost)}." if found.lost else ""
    section = Section("Side by side", [*paragraphs(words), *table("", header, rows, note, "lll" + "r" * len(runs) * 2)])
    return _answer(runs, changes), [_glance(runs, changes), section]


def _glance(runs: Sequence[str], changes: Sequence[Change]) -> Section:
    """The first changes, the figure of all, and how to make a check of them."""
    ordered = sorted(changes, key=lambda one: SPOKEN.index(one.measure) if one.measure in SPOKEN else len(SPOKEN))
    numbers = []
    for one in ordered:
        for run, ratio in zip(runs[1:], one.ratios, strict=True):
            if ratio is not None:
                value, _, interval = _change(ratio).partition(" [")
                what = f"{measure_name(one.measure)}, {called(one.compensation)}, {run} against {runs[0]}"
                sure = f"95 %: {interval.rstrip(']').replace(', ', ' to ')} %" if interval else "one pair, no interval"
                numbers.append(Number(what, value, sure))
    picture = Picture("changes", "The change of each measure, paired; left of the dashed line the later run is better.")
    key = ordered[0].measure
    step = f"--fail-if {key}+5% ends with exit code 1 where a later run is worse by more than 5 %."
    return at_a_glance(numbers, picture, step)


def _answer(runs: Sequence[str], changes: Sequence[Change]) -> str:
    one = next((c for c in changes if c.measure == "velocity_rms_horizontal"), changes[0])
    lines, pairs = [], len(one.recordings)
    for run, ratio in zip(runs[1:], one.ratios, strict=True):
        lines.append(
            sentence(
                f"{measure_name(one.measure)}, {called(one.compensation)}, changes by {_change(ratio)} from "
                f"{runs[0]} to {run}, over {pairs} pair{'s' if pairs > 1 else ''}"
            )
        )
    return "\n".join(lines)


def _row(one: Change) -> list[str]:
    kind = next(kind for kind in UNITS if one.measure.startswith(kind))
    cells = [label(one.compensation), one.measure, UNITS[kind], str(len(one.recordings))]
    first, *others = (fixed(value, DIGITS[kind]) for value in one.values)
    for value, ratio in zip(others, one.ratios, strict=True):
        cells += [first, value, _change(ratio)] if len(cells) == 4 else [value, _change(ratio)]
    return cells


def _change(ratio: Estimate | None) -> str:
    if ratio is None:
        return MISSING
    if not ratio.known:
        percent = 100.0 * (ratio.value - 1.0)
        return f"{'+' if round(percent, 1) > 0.0 else ''}{fixed(percent, 1)} %"
    return change(ratio)
