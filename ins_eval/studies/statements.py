"""Statements of a paper with their verdicts: counted, grouped, and put beside their figures."""

from __future__ import annotations

import re
import tomllib
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import groupby
from math import ceil, log10
from pathlib import Path

from ins_eval.report.content import Block, Paragraph, Picture, Section, Table, paragraphs, table
from ins_eval.studies.papers import (
    COMPATIBLE,
    CONTRADICTS,
    GIVEN,
    NOT_COMPUTED,
    NOT_REPRODUCED,
    REPRODUCED,
    VERDICT_RULE,
    Row,
    head,
    number,
)
from ins_eval.wording import MISSING, fixed, sentence

MARK = {
    REPRODUCED: "✓ reproduced",
    COMPATIBLE: "~ compatible, little power",
    CONTRADICTS: "≠ contradicts itself",
    NOT_REPRODUCED: "✗ not reproduced",
}
UNTESTED = "– not tested"
CHOSEN = "chosen in view"
TONE = {REPRODUCED: "good", COMPATIBLE: "weak", NOT_REPRODUCED: "bad", CONTRADICTS: "odd"}
HEADER = ("statement", "printed", "recomputed", "ours", "verdict")
PRINTED_DIGITS, RECOMPUTED_DIGITS, OUR_DIGITS = 6, 4, 3

Pictures = Mapping[str, Mapping[str, str]]  # below the rows of an id: the names of its figures, what to see in each


def read_pictures(file: Path) -> Pictures:
    """The figures of a page and what to see in them, by the rows below which they stand."""
    return tomllib.loads(file.read_text(encoding="utf-8"))


def counted(rows: Sequence[Row], paper: str) -> str:
    """The verdicts in one sentence."""
    counts = Counter(row.verdict for row in rows)
    untested = sum(map(_untested, rows))
    return (
        f"Of {len(rows)} statements of {paper}, {counts[REPRODUCED]} are reproduced by a test that could have failed; "
        f"{counts[COMPATIBLE]} are compatible with ours, but the test has little power; in {counts[CONTRADICTS]} the "
        f"paper contradicts itself; {counts[NOT_REPRODUCED]} are not reproduced"
        + (f", of which {untested} could not be tested." if untested else ".")
    )


def statement_sections(rows: Sequence[Row], pictures: Pictures) -> list[Section]:
    """The rule and the count of the verdicts, then every row under its group, in the order in which it comes."""
    sections = [Section("Verdicts", _verdicts(rows))]
    for group in dict.fromkeys(row.group for row in rows):
        of_group = [row for row in rows if row.group == group]
        sections.append(Section(sentence(group)[:-1], _of_group(of_group, pictures)))
    return sections


def _verdicts(rows: Sequence[Row]) -> list[Block]:
    lines = []
    for group in [*dict.fromkeys(row.group for row in rows), "total"]:
        of_group = [row for row in rows if row.group == group or group == "total"]
        count = Counter(row.verdict for row in of_group)
        untested = sum(map(_untested, of_group))
        lines.append((group, *(str(count[v] or MISSING) for v in MARK), str(untested or MISSING), str(len(of_group))))
    header = ("subject", *MARK.values(), "of these not tested", "all")
    note = (
        "Not tested: taken as given, because the statement went into the simulation, is a definition or a step that "
        "cannot fail, or cannot be computed; or not computed in this run. Chosen in view: a number of the simulation "
        "was chosen after seeing the printed one, as the row says."
    )
    return [
        *paragraphs(*VERDICT_RULE.splitlines()),
        *table("Statements by subject", header, lines if rows else [], note),
    ]


def _of_group(rows: Sequence[Row], pictures: Pictures) -> list[Block]:
    """The rows in their order, in one table up to each figure, which stands below the rows of its id."""
    blocks: list[Block] = []
    waiting: list[Row] = []
    for base, of_base in groupby(rows, key=lambda row: head(row.id)):
        waiting += of_base
        if base in pictures:
            blocks += [_table(waiting), *(Picture(*named) for named in pictures[base].items())]
            waiting = []
    return [*blocks, *([_table(waiting)] if waiting else [])]


def _table(rows: Sequence[Row]) -> Table:
    cells = [
        (
            signed(f"{row.title} [{row.unit}]" if row.unit else row.title),
            _value(row.printed, PRINTED_DIGITS),
            _value(row.recomputed, RECOMPUTED_DIGITS),
            _ours(row),
            _verdict(row),
        )
        for row in rows
    ]
    remarks = [Paragraph(signed(_remark(row)), row.id) for row in rows]
    tones = ["quiet" if _untested(row) else TONE[row.verdict] for row in rows]
    return Table("", HEADER, cells, align="l" * len(HEADER), remarks=remarks, tones=tones)


def _verdict(row: Row) -> str:
    mark = UNTESTED if _untested(row) else MARK[row.verdict]
    return f"{mark}; {CHOSEN}" if row.chosen else mark


def _remark(row: Row) -> str:
    """The reason, and how the test could have come out otherwise."""
    parts = [row.reason]
    if row.passes is not None and not _untested(row):
        low, high = (_value(end, _digits(row.passes)) for end in row.passes)
        parts.append(f"A printed value would have passed from {low} to {high}.")
    elif row.fails and row.verdict == REPRODUCED:
        parts.append(f"It would have failed if {row.fails}.")
    if row.chosen:
        parts.append(f"Chosen with this in view: {row.chosen}.")
    return " ".join(parts)


def _digits(passes: tuple[float, float]) -> int:
    """Significant digits that tell the ends of a range apart, two of its width at least."""
    low, high = passes
    largest = max(abs(low), abs(high))
    return max(OUR_DIGITS, 2 + ceil(log10(largest / (high - low)))) if high > low else PRINTED_DIGITS


def _ours(row: Row) -> str:
    text = _value(row.ours, OUR_DIGITS)
    if row.interval95 is None:
        return text
    low, high = (_value(end, OUR_DIGITS) for end in row.interval95)
    return f"{text} [{low},\u00a0{high}]"


def _untested(row: Row) -> bool:
    """Not reproduced because it was not put to a test."""
    return row.verdict == NOT_REPRODUCED and row.reason.startswith((GIVEN, NOT_COMPUTED))


def signed(text: str) -> str:
    """With a real minus sign before a number."""
    return re.sub(r"(?<![\w/.)])-(?=\d)", "−", text)


def _value(value: float | str | None, digits: int) -> str:
    """A number with at most so many significant digits, whole ones in full; words as they are."""
    if value is None:
        return MISSING
    if isinstance(value, str):
        return signed(value)
    if value == round(value):
        return fixed(value, 0)
    text = number(value, digits)
    if digits > OUR_DIGITS and "." in text:  # exact numbers, not estimates
        text = re.sub(r"\.?0+(?=$|e)", "", text)
    return text.rstrip(".").replace("-", "−")
