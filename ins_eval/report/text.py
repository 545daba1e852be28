"""The report as plain text for a terminal."""

from __future__ import annotations

import textwrap
import unicodedata
from collections.abc import Collection, Sequence

from ins_eval.printable import printable
from ins_eval.report.content import Block, Numbers, Paragraph, Picture, Section, Table
from ins_eval.wording import in_symbols, unbroken

GAP = 2  # blanks between columns
INDENT = "    "  # of a remark below its row


def render(
    title: str, answer: str, sections: Sequence[Section], *, figures: Collection[str] = (), width: int = 100
) -> str:
    """Answer, title and sections in lines of at most `width` characters.

    `figures` names the figures that exist; each is mentioned by its file where the page would show it.
    """
    parts = [*(_fill(line, width) for line in answer.splitlines()), "", *_headed(title, "=", width)]
    for section in sections:
        parts += _headed(section.heading, "-", width)
        parts += [text + "\n" for block in section.blocks if (text := _block(block, figures, width))]
    return printable("\n".join(parts).rstrip("\n") + "\n", keep="\n")


def format_table(table: Table, width: int = 100) -> str:
    """The table with aligned columns; cells are wrapped until a row fits `width`, words before numbers."""
    rows = [[in_symbols(str(cell)) for cell in row] for row in (table.header, *table.rows)]
    remarks = ["", *([_spoken(remark) for remark in table.remarks] or [""] * len(table.rows))]
    widths = _column_widths(table, rows, width)
    lines = []
    for number, (row, remark) in enumerate(zip(rows, remarks, strict=True)):
        cells = [textwrap.wrap(cell, w) or [""] for cell, w in zip(row, widths, strict=True)]
        for line in range(max(map(len, cells))):
            texts = [
                _pad(cell[line] if line < len(cell) else "", w, side)
                for cell, w, side in zip(cells, widths, table.alignment, strict=True)
            ]
            lines.append((" " * GAP).join(texts).rstrip().replace("\u00a0", " "))
        if remark:
            lines += [INDENT + line for line in _fill(remark, width - len(INDENT)).splitlines()]
        if number == 0:
            lines.append("-" * (sum(widths) + GAP * (len(widths) - 1)))
    title = [_fill(table.title, width)] if table.title else []
    note = [_fill(table.note, width)] if table.note else []
    return "\n".join([*title, *lines, *note])


def _column_widths(table: Table, rows: Sequence[Sequence[str]], width: int) -> list[int]:
    """Natural widths, narrowed where they do not fit: first down to the longest word, then anywhere.

    In a column of numbers (aligned right) only the header may be wrapped at first.
    """
    columns = list(zip(*rows, strict=True))
    widths = [max(map(_columns, column)) for column in columns]
    least = [
        max(_longest_word(column[0]), *(map(_columns if side == "r" else _longest_word, column[1:])), 1)
        for column, side in zip(columns, table.alignment, strict=True)
    ]
    room = width - GAP * (len(widths) - 1)
    while sum(widths) > room:
        slack = [w - limit for w, limit in zip(widths, least, strict=True)]
        widest = slack.index(max(slack)) if max(slack) > 0 else widths.index(max(widths))
        if widths[widest] == 1:
            break
        widths[widest] -= 1
    return widths


def _block(block: Block, figures: Collection[str], width: int) -> str:
    if isinstance(block, Paragraph):
        return _fill(_spoken(block), width)
    if isinstance(block, Numbers):
        lines = (f"{one.what}: {one.value}" + (f", {one.interval}" if one.interval else "") for one in block.items)
        return "\n".join(_fill(line, width) for line in lines)
    if isinstance(block, Picture):
        return f"[figure: figures/{block.name}.svg]" if block.name in figures else ""
    return format_table(block, width)


def _spoken(paragraph: Paragraph) -> str:
    return f"{paragraph.lead} {paragraph.text}".strip()


def _headed(heading: str, rule: str, width: int) -> list[str]:
    return [_fill(heading, width), rule * min(width, _columns(heading)), ""]


def _fill(text: str, width: int) -> str:
    return textwrap.fill(unbroken(in_symbols(text)), width).replace("\u00a0", " ")


def _longest_word(text: str) -> int:
    return max(map(_columns, text.split()), default=0)


def _columns(text: str) -> int:
    """Columns of a terminal that a text takes; a combining mark takes none."""
    return sum(not unicodedata.combining(c) for c in text)


def _pad(text: str, width: int, side: str) -> str:
    blanks = " " * max(0, width - _columns(text))
    return blanks + text if side == "r" else text + blanks
