"""Texts with places for numbers: ``{path:form}``, where a path leads through nested mappings, fields and lists."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any

from ins_eval.report.content import Block, paragraphs, table
from ins_eval.studies.papers import number
from ins_eval.wording import with_interval

FIELD = re.compile(r"\{([^{}:]+)(?::([^{}]*))?\}")


class NotComputed(LookupError):
    """A number was not computed in this run."""


def at(path: str, tree: Mapping[str, Any]) -> Any:
    """What stands at the end of a path. Raises `NotComputed` where that is nothing, KeyError for a wrong first name."""
    root, *keys = path.split(".")
    found = tree[root]
    for key in keys:
        if found is None:
            break
        if isinstance(found, Mapping):
            found = found.get(key)
        else:
            found = found[int(key)] if key.isdigit() else getattr(found, key)
    if found is None:
        raise NotComputed(path)
    return found


def filled(template: str, tree: Mapping[str, Any], words: Callable[[Any, str], str]) -> str:
    """The text with its numbers in `words`, which takes a value and a form. Raises as `at`."""
    return FIELD.sub(lambda field: words(at(field[1], tree), field[2] or ""), template)


def blocks_of(section: Mapping[str, Any], tree: Mapping[str, Any]) -> list[Block]:
    """Paragraphs and tables of a section in TOML: ``texts``, and ``tables`` as `content.table` takes them.

    A text or a row of which a number was not computed is left out.
    """
    blocks: list[Block] = [*paragraphs(*(possible(text, tree) for text in section.get("texts", ())))]
    for of in section.get("tables", ()):
        rows = [cells for row in of["rows"] if all(cells := [possible(cell, tree) for cell in row])]
        header = [possible(cell, tree) for cell in of["header"]]
        blocks += table(possible(of["title"], tree), header, rows, possible(of.get("note", ""), tree))
    return blocks


def possible(text: str, tree: Mapping[str, Any]) -> str:
    """A text of a page, or nothing where a number of it was not computed."""
    try:
        return filled(text, tree, _on_page)
    except NotComputed:
        return ""


def _on_page(value: Any, form: str) -> str:
    """``.1f`` with a real minus sign, and with the interval of an estimate; ``2`` with so many significant digits."""
    if isinstance(value, str):
        return value
    if form.isdigit():
        return number(value, int(form))
    return with_interval(value, int(form[1:-1])) if form.endswith("f") else format(value, form)
