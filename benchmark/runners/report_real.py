"""`python -m benchmark.runners.report_real FOLDER ANSWERS [--output DIR]`: what was found of what hid.

FOLDER is what `benchmark.runners.make_real` or `make_mems` wrote, ANSWERS what `benchmark.runners.run` made of it.
Writes the page, ``metrics.json`` (each rate, and the record of each case) and ``manifest.json``.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from benchmark.runners import run
from benchmark.runners.figures import BAD, GOOD, NAMED, ODD, short
from benchmark.runners.pages import number
from benchmark.runners.targets import MET, MISSED, OPEN, TONES, spoken
from benchmark.scores.against import ENDED, FAULT, REFUSED, judged, summary, targets
from benchmark.scores.score import CLEAR, read
from ins_eval.figures.style import FAINT, QUIET, legend_below, sheet, styled
from ins_eval.files import write_whole
from ins_eval.report.content import Block, Picture, Section, Table, at_a_glance, paragraphs, table
from ins_eval.report.json_file import as_json
from ins_eval.report.results import write_results
from ins_eval.wording import MISSING, fixed

SETS = {"real": "real recordings", "mems": "simulated drives and flights of MEMS units"}
WHAT = ("detected", "right channel", "named first or listed")
RATE = ("", "cases", "share", "95 % interval")


def result_of(folder: Path, answers: Path) -> dict:
    """All numbers of a run."""
    truths, given, runs = read(folder / "truth"), read(answers), run.read_runs(answers)
    errors = {path.stem: path.read_text().strip() for path in answers.glob("*.error")}
    given = {name: one for name, one in given.items() if name in runs and name not in errors}
    records = [
        judged(one, given.get(name), given.get(f"case-{one['source']}-unmodified"), runs.get(name, {}),
               errors.get(name, ""))
        for name, one in sorted(truths.items())
    ]  # fmt: skip
    result = summary(records)
    made = json.loads((folder / "manifest.json").read_text())
    return {"concealed_in": SETS[made["set"]]} | result | {"targets": targets(result)}


def manifest(folder: Path, answers: Path) -> dict:
    """What the numbers were made from."""
    packages = sorted({one["package"] for one in run.read_runs(answers).values()})
    made = json.loads((folder / "manifest.json").read_text())
    return made | {"package": f"ins-eval {version('ins-eval')}", "package_sha256": packages}


# ------------------------------------------------------------------------------------------------ the page


def content(result: dict) -> tuple[str, list[Section]]:
    """The answer and the sections, worst first."""
    hidden = [one for one in result["records"] if one["kind"] == "single"]
    nulls = [one for one in result["records"] if one["kind"] == "null"]
    sections = [
        _glance(result),
        Section("Targets", [_targets(result)]),
        Section("Not answered", _refused(result)),
        Section("Where it fails", _failing(hidden)),
        Section("By recording", _by_recording(result)),
        Section("By effect", _three("Effects, D of at least 16", result["by effect"])),
        Section("Nothing concealed", _nulls(result, nulls)),
        Section("As they are", _unmodified(result)),
        Section("Every case", _every(hidden)),
        Section("How it was made", _how()),
        Section("Time", _time(result)),
    ]
    return _answer(result), [section for section in sections if section.blocks]


def _answer(result: dict) -> str:
    said = result["targets"]
    met, open_ = sum(one["met"] is True for one in said), sum(one["met"] is None for one in said)
    missed = [one["words"] for one in said if one["met"] is False]
    count = sum(one["kind"] == "single" for one in result["records"])
    unanswered = sum(not one["answered"] for one in result["records"])
    lines = [
        f"{count} effects concealed in {result['concealed_in']}, {result['cases']} cases with the recordings as they "
        f"are and nulls: {met} of {len(said) - open_} targets met."
    ]
    if missed:
        lines.append(f"Missed: {'; '.join(missed)}.")
    if unanswered:
        lines.append(f"{unanswered} cases have no answer; they count as not detected.")
    return "\n".join(lines)


def _glance(result: dict) -> Section:
    """The first targets with their rates, the figure of all, and where to look next."""
    numbers = [number(one["words"], one["found"]) for one in result["targets"] if one["met"] is not None]
    return at_a_glance(numbers, FIGURE, "Read first where it fails.")


def _targets(result: dict) -> Table:
    rows, tones = [], []
    for one in result["targets"]:
        word = OPEN if one["met"] is None else MET if one["met"] else MISSED
        goal = f"at least {100 * one['least']:g} %" if one["least"] else f"at most {100 * one['most']:g} %"
        rows.append((one["line"], one["words"], goal, *spoken(one["found"] if one["met"] is not None else None), word))
        tones.append(TONES[word])
    return Table("Targets", ("line", "what", "target", *RATE[1:], "verdict"), rows, align="lllrrrl", tones=tones)


def _rates(title: str, group: dict, note: str = "") -> list[Table]:
    rows = [(name, *spoken(one)) for name, one in group.items()]
    return table(title, RATE, rows, note)


def _three(title: str, group: dict) -> list[Table]:
    """Rows `NAME: WHAT` of a group, one line a name, each rate with its interval in per cent."""
    names = dict.fromkeys(name.partition(": ")[0] for name in group)
    rows = []
    for name in names:
        here = [group[f"{name}: {what}"] for what in WHAT]
        rows.append((name, str(here[0]["count"]), *map(_with_interval, here)))
    return table(title, ("", "cases", *WHAT), rows, "In per cent, with exact 95 % intervals.")


def _with_interval(one: dict) -> str:
    low, high = one["interval95"]
    return f"{100 * one['rate']:.0f} [{100 * low:.0f}, {100 * high:.0f}]"


def _words(names: Sequence[str]) -> str:
    return ", ".join(short(name) for name in names) or MISSING


OPEN_LAWS = (
    "The same of effects that are clear (D of at least 16) also to one who does not know which laws of temperature a "
    "unit at rest had before: in a single warming a law of temperature repeats another one."
)
FIGURE = Picture("by_recording", "The answer for each concealed effect.")
CASE = ("case", "concealed", "D", "verdict", "named in addition to the unmodified recording")
CASE_ALIGN = "llrll"


def _case(one: dict) -> tuple[str, ...]:
    concealed = f"{_words(one['truth'])} {one['value']:.4g} {one['unit']}"
    return _number(one), concealed, _large(one["d"]), one["verdict"], _words(one["new"])


def _number(one: dict) -> str:
    return one["case"].removeprefix("case-").replace("-hidden", "")


def _large(d: float | None) -> str:
    return MISSING if d is None else fixed(d, 1) if d < 1e4 else f"{d:.0e}"


def _refused(result: dict) -> list[Block]:
    asked = [one for one in result["records"] if not one["answered"] and one["said"]]
    never = sum(not one["answered"] and not one["said"] for one in result["records"])
    rows = [(_number(one), one["verdict"], _sentence(one)) for one in asked]
    note = "Each concealed effect among them counts as not detected; nulls and unmodified recordings are not counted."
    words = f"{never} cases were never asked: run `python -m benchmark.runners.run` again." if never else ""
    return [*table("Cases without an answer", ("case", "outcome", "sentence"), rows, note, align="lll"),
            *paragraphs(words)]  # fmt: skip


def _sentence(one: dict) -> str:
    """What the command said, without the place of the folder."""
    return re.sub(r"\S*/(?=case-)", "", one["said"].splitlines()[-1])


def _failing(hidden: Sequence[dict]) -> list[Block]:
    clear = [one for one in hidden if one["band"] == CLEAR and one["answered"]]
    failed = [one for one in clear if not one["found"]]
    wrong = [one for one in hidden if one["wrong"]]
    apart = [one for one in hidden if one["holds"] is False]
    return [
        *table("Clear, answered, and not named or listed", CASE, [_case(one) for one in failed], align=CASE_ALIGN),
        *table("Confidently wrong", CASE, [_case(one) for one in wrong], align=CASE_ALIGN),
        *table(
            "The interval does not contain the concealed value", CASE, [_case(one) for one in apart], align=CASE_ALIGN
        ),
    ]


def _by_recording(result: dict) -> list[Block]:
    return [
        FIGURE,
        *_three("Recordings, D of at least 16", result["by recording"]),
        *_rates("All", result["all"], "Detected: an effect is named that is not named for the unmodified recording."),
        *_rates("All, the recording's own laws open", result["own laws open"], OPEN_LAWS),
    ]


def _nulls(result: dict, nulls: Sequence[dict]) -> list[Table]:
    rows = [(_number(one), one["what"], one["verdict"], _words(one["named"]), "alarm" if one["alarm"] else "none")
            for one in nulls]  # fmt: skip
    tones = ["bad" if one["alarm"] else "quiet" for one in nulls]
    every = [Table("Each null", ("case", "stretch", "verdict", "named", "alarm"), rows, align="lllll", tones=tones)]
    note = "False alarm: an effect is named that the whole unmodified recording neither names nor lists."
    return [*_rates("Nulls that alarm", result["nulls"], note), *(every if rows else [])]


def _unmodified(result: dict) -> list[Table]:
    rows = [(one["recording"], one["verdict"], _words(one["named"]))
            for one in result["records"] if one["kind"] == "unmodified"]  # fmt: skip
    return table("The recordings as they are", ("recording", "verdict", "named"), rows, align="lll")


def _every(hidden: Sequence[dict]) -> list[Table]:
    if not hidden:
        return []
    rows = [(*_case(one), outcome(one)) for one in hidden]
    tones = [{NAME: "good", LISTED: "good", SEEN: "weak", WRONG: "bad"}.get(outcome(one), "quiet") for one in hidden]
    return [Table("Every concealed effect", (*CASE, "outcome"), rows, align=CASE_ALIGN + "l", tones=tones)]  # fmt: skip


def _how() -> list[Block]:
    return paragraphs(
        "Effects are added to the columns of the imported recordings by formulas that share no line with ins_eval. "
        "The recordings keep their own errors, so only what an answer names in addition to the unmodified recording "
        "counts.",
        "D is half of (size / sigma) squared, in nats. An oracle that knows the concealed effect navigates arcs of "
        "5 to 10 s, each from its own start, with and without the effect, fits everything that a belief leaves "
        "open, and takes its sigma from how much the fit to the unmodified recording moves where one arc is left "
        "out; at rest it takes means over stretches and knows the laws of temperature that the unit had before. "
        "Nothing is carried from one arc to the next, so D is less than could be known.",
    )


def _time(result: dict) -> list[Table]:
    rows = []
    for name in _recordings(result["records"]):
        here = [one for one in result["records"] if one["recording"] == name and one["seconds"] is not None]
        for words, key in (("elapsed", "seconds"), ("CPU", "processor_s")):
            taken = [one[key] for one in here if one[key] is not None]
            if taken:
                at = np.quantile(taken, (0.5, 0.95, 1.0))
                rows.append((name, words, str(len(taken)), *(fixed(float(x), 1) for x in at)))
    header = ("recording", "seconds", "cases", "median", "95 %", "longest")
    return table("Seconds for a case", header, rows, align="llrrrr")


def _recordings(records: Sequence[dict]) -> list[str]:
    """Recordings of records, each once, in their order."""
    return list(dict.fromkeys(one["recording"] for one in records))


# ------------------------------------------------------------------------------------------------ the figure

NAME, LISTED, SEEN, WRONG, SILENT, NONE = (
    "named first", "named later or listed", "detected, other name", "confidently wrong", "not detected", "no answer"
)  # fmt: skip
MARKS = {NAME: (GOOD, "o"), LISTED: (ODD, "s"), SEEN: (NAMED, "^"), WRONG: (BAD, "X"), SILENT: (QUIET, "v"),
         NONE: (FAINT, "D")}  # fmt: skip


def outcome(one: dict) -> str:
    """The answer for a concealed effect, in a word."""
    if not one["answered"]:
        return one["verdict"] if one["verdict"] in (REFUSED, FAULT, ENDED) else NONE
    if one["first"]:
        return NAME
    if one["found"]:
        return LISTED
    return WRONG if one["wrong"] else SEEN if one["detected"] else SILENT


@styled
def by_recording(hidden: Sequence[dict]) -> Figure:
    """Each concealed effect at its D, a row a recording."""
    names = _recordings(hidden)
    note = (
        "One mark an effect, by the D of the oracle and the answer. Above 16 nats (line) it should be found. "
        "Diamonds: the recording was refused, or there was no answer in time."
    )
    figure, ax = sheet(1.7 + 0.62 * len(names), "Concealed effects", note)
    for label, (tone, mark) in MARKS.items():
        here = [(max(one["d"] or 0.0, 0.1), names.index(one["recording"]) + _apart(one)) for one in hidden
                if (outcome(one) if one["answered"] else NONE) == label]  # fmt: skip
        if here:
            edge = QUIET if label == NONE else tone
            ax.plot(*zip(*here, strict=True), mark, color=tone, markeredgecolor=edge, markeredgewidth=0.5,
                    markersize=4.5, linestyle="none", label=f"{label} ({len(here)})")  # fmt: skip
    ax.axvline(16.0, color=QUIET, linestyle="--", linewidth=0.8)
    ax.set_xscale("log")
    ax.set_yticks(range(len(names)), names)
    ax.set_ylim(len(names) - 0.4, -0.6)
    ax.set_xlabel("D of the oracle [nats]")
    legend_below(figure, ax, columns=3)
    return figure


def _apart(one: dict) -> float:
    """Neighbours in a row lie a little above each other, by the number of the case."""
    return 0.11 * (int(one["case"].rsplit("-", 1)[1]) % 5 - 2)


def main(arguments: list[str] | None = None) -> int:
    words = __doc__.splitlines()[0]
    parser = argparse.ArgumentParser(prog="python -m benchmark.runners.report_real", description=words)
    parser.add_argument("folder", type=Path, help="what the maker wrote: recordings and truth")
    parser.add_argument("answers", type=Path)
    parser.add_argument("--output", type=Path, default=Path("reports/concealed-real"))
    parser.add_argument("--quiet", action="store_true")
    chosen = parser.parse_args(arguments)
    if not any((chosen.folder / "truth").glob("*.json")):
        parser.error(f"{chosen.folder}: has no cases, expected those of `python -m benchmark.runners.make_real`")
    made = manifest(chosen.folder, chosen.answers)
    if len(made["package_sha256"]) > 1:
        parser.error(
            f"{chosen.answers}: answers of {len(made['package_sha256'])} versions of the package, expected one; run "
            "`python -m benchmark.runners.run` again, it makes those anew that are old"
        )
    result = result_of(chosen.folder, chosen.answers)
    answer, sections = content(result)
    hidden = [one for one in result["records"] if one["kind"] == "single"]
    write_whole(chosen.output / "manifest.json", as_json(made))
    drawn = {"by_recording": by_recording(hidden)} if hidden else {}
    title = f"Effects concealed in {result['concealed_in']}"
    write_results(chosen.output, title, answer, sections, result, drawn, chosen.quiet)
    return 0


if __name__ == "__main__":
    sys.exit(main())
