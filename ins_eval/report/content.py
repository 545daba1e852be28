"""What a report says, before it is known where it will be read: `page` and `text` render the same sections."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from ins_eval.vocabulary import definition_name
from ins_eval.wording import Estimate, Statistic, with_interval

COUNT = 3  # numbers of a first screen
GLANCE = "At a glance"  # heading of the section that a page shows with its answer


@dataclass(frozen=True)
class Paragraph:
    """Plain sentences, with a few words in bold before them."""

    text: str
    lead: str = ""


@dataclass(frozen=True)
class Table:
    """Rows of ready-made text; `align` has one of ``l`` and ``r`` a column, by default ``lrr...``.

    A row may have a remark, which is set below it across the columns, and a tone, in which its last cell is coloured:
    ``good``, ``weak``, ``bad``, ``odd`` or ``quiet``. `remarks` and `tones` hold one a row or are empty; so do `links`,
    to which the first cell of a row leads.
    """

    title: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str = ""
    align: str = ""
    remarks: Sequence[Paragraph] = ()
    tones: Sequence[str] = ()
    links: Sequence[str] = ()

    @property
    def alignment(self) -> str:
        return self.align or "l" + "r" * (len(self.header) - 1)


@dataclass(frozen=True)
class Picture:
    """A figure by its name, with a caption that says what to see; left out where no such figure was drawn."""

    name: str
    caption: str


class Number(NamedTuple):
    """A number that answers: what it is, its value with unit, and how sure it is."""

    what: str
    value: str
    interval: str = ""


def measured(what: str, entry: Estimate | Statistic, unit: str, digits: int = 2) -> Number:
    """A number with the 95 % interval that stands with it."""
    value, _, interval = with_interval(entry, digits).partition(" [")
    return Number(what, f"{value} {unit}", f"95 %: {interval.rstrip(']').replace(', ', ' to ')}" if interval else "")


@dataclass(frozen=True)
class Numbers:
    """The few numbers on which an answer rests, set large side by side."""

    items: Sequence[Number]


Block = Paragraph | Table | Picture | Numbers


@dataclass(frozen=True)
class Section:
    """A heading and what stands below it."""

    heading: str
    blocks: Sequence[Block]

    @property
    def anchor(self) -> str:
        return "".join(c if c.isalnum() else "-" for c in self.heading.lower()).strip("-")


def at_a_glance(numbers: Sequence[Number], picture: Picture | None, *steps: str) -> Section:
    """What the first screen holds below the verdict: the first numbers with intervals, what to do next, one figure."""
    blocks: list[Block] = [Numbers(numbers[:COUNT])] if numbers else []
    blocks += [Paragraph(" ".join(filter(None, steps)), "What to do next.")] if any(steps) else []
    return Section(GLANCE, [*blocks, picture] if picture else blocks)


def paragraphs(*texts: str) -> list[Paragraph]:
    """One paragraph for each text that is not empty."""
    return [Paragraph(text) for text in texts if text]


def table(
    title: str, header: Sequence[str], rows: Sequence[Sequence[str]], note: str = "", align: str = ""
) -> list[Table]:
    """A table, or nothing where there are no rows."""
    return [Table(title, header, rows, note, align)] if rows else []


def definitions_table(metrics: Mapping) -> list[Table]:
    """Each definition in words, as a formula, with its window and source."""
    rows = [
        (definition_name(key), *(d.get(part, "") for part in ("words", "formula", "window", "source")))
        for key, d in (metrics.get("definitions") or {}).items()
    ]
    return table("", ("name", "in words", "formula", "window", "source"), rows, align="lllll")
