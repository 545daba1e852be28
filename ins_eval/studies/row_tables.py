"""Rows of a paper from tables in TOML: words, kind of test, and where its numbers stand among those computed.

A table ``["id"]`` has the fields of `Statement`. Its id is that of a row or, with a "*" or "|", a regular expression
for several. In its texts ``{path}`` is a number as `papers.number` writes it, with its interval if it has one,
``{path:4}`` with four significant digits, ``{path:.1f}`` as Python formats it, and a list with strokes between.
"""

from __future__ import annotations

import re
import tomllib
from collections import ChainMap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from ins_eval.studies import papers
from ins_eval.studies.filled import FIELD, NotComputed, at, filled
from ins_eval.studies.papers import CONTRADICTS, NOT_COMPUTED, NOT_REPRODUCED, Row

SEVERAL = re.compile(r"[*|]")
DIGITS = "3"

Values = Mapping[str, Mapping[str, Any]]  # by id of a row: what stands nowhere in the computed tree


@dataclass(frozen=True)
class Statement:
    """One table. A number, where it is no number itself, is ``"{path}"``, or a text with such fields in it.

    `reason` are sentences; one whose numbers were not computed in this run is left out, and of a list of sentences
    the first stands that can. What a table leaves open (a number, the kind) is taken from the values of the row.

    `kind`: "given", "contradicts" and "open" (not reproduced) need no test; the functions of `papers` of the same name
    judge "recalculated" (to its last `digit`), "claimed" (`above` or `below`; `what` is the quantity), "simulated"
    (`of` names the interval, `nothing` what would say that there is nothing) and "decided" (by ``holds`` of the row's
    values; "consistent" is one that else contradicts itself).
    """

    title: str
    kind: str | None = None
    reason: Sequence[str | Sequence[str]] = ()
    unit: str | None = None
    printed: float | str | None = None
    recomputed: float | str | None = None
    ours: float | str | None = None
    digit: float | None = None
    above: float | str | None = None
    below: float | str | None = None
    what: str = "ours"
    of: str = ""
    nothing: float | str | None = None
    fails: str = ""


def rows_of(groups: Mapping[str, ModuleType], computed: Mapping[str, Any], *of: Any) -> Iterator[Row]:
    """The rows of all groups, by name of the module with their ``values(*of)``, whose TOML file stands beside it."""
    for group, module in groups.items():
        for row in rows(read(Path(module.__file__).with_suffix(".toml")), module.values(*of), computed):
            yield replace(row, group=group)


def read(file: Path) -> dict[str, Statement]:
    """The statements of a file by id, in their order. Raises TypeError for a field that there is not."""
    return {id: Statement(**said) for id, said in tomllib.loads(file.read_text(encoding="utf-8")).items()}


def rows(statements: Mapping[str, Statement], values: Values, computed: Mapping[str, Any]) -> Iterator[Row]:
    """The row of each statement, or of one whose id is a pattern those of all ids in `values` that match it.

    They come in the order of the statements; those of patterns that follow one another in the order of `values`. A path
    leads through the row's own values or else through `computed`, which names all trees that there may be and holds
    None for one that was not computed. Raises KeyError for another name and for values without a statement.
    """
    left = dict(values)
    for is_pattern, run in groupby(statements, key=lambda id: bool(SEVERAL.search(id))):
        patterns = list(run)
        ids = [id for id in left if id not in statements] if is_pattern else patterns
        for id in ids:
            if said := next((statements[p] for p in patterns if re.fullmatch(p, id)), None):
                yield _Judge(id, said, left.pop(id, {}), computed).row()
    if left:
        raise KeyError(f"{', '.join(left)}: values without a statement")


class _Judge:
    """One row in the making."""

    def __init__(self, id: str, statement: Statement, own: Mapping[str, Any], computed: Mapping[str, Any]) -> None:
        self.id, self.statement, self.own, self.tree = id, statement, own, ChainMap({**own}, {**computed})

    def row(self) -> Row:
        """The row with its verdict."""
        said = self.statement
        kind, title = self._value("kind"), self._text(said.title)
        reason = "" if self.own.get("holds", True) is None else self._reason()
        numbers = {key: self._value(key) for key in ("printed", "recomputed", "ours")}
        unit = self._value("unit") or ""
        if kind == "given":
            return papers.given(self.id, title, reason, **numbers, unit=unit)
        if kind in ("contradicts", "open"):
            verdict = CONTRADICTS if kind == "contradicts" else NOT_REPRODUCED
            return papers.row(self.id, title, verdict, reason or NOT_COMPUTED, **numbers, unit=unit)
        if kind == "recalculated":
            printed, computed = numbers.pop("printed"), numbers.pop("recomputed")
            digit = self._value("digit")
            return papers.recalculated(self.id, title, printed, computed, digit, reason, **numbers, unit=unit)
        if kind == "claimed":
            ours, ends = numbers.pop("ours"), {side: self._value(side) for side in ("above", "below")}
            return papers.claimed(self.id, title, ours, reason, **ends, what=said.what, **numbers, unit=unit)
        if kind == "simulated":
            printed, ours = numbers.pop("printed"), numbers.pop("ours")
            of, nothing = self._value("of"), self._value("nothing") or 0.0
            return papers.simulated(self.id, title, printed, ours, of, reason, nothing, **numbers, unit=unit)
        if kind in ("decided", "consistent"):
            otherwise = NOT_REPRODUCED if kind == "decided" else CONTRADICTS
            ends = {"fails": self._text(said.fails), "passes": self.own.get("passes")}
            return papers.decided(self.id, title, self.own["holds"], reason, otherwise, **ends, **numbers, unit=unit)
        raise ValueError(f"{self.id}: there is no kind of row {kind!r}")

    def _reason(self) -> str:
        """The sentences whose numbers are there."""
        found = []
        for sentence in self.statement.reason:
            for text in [sentence] if isinstance(sentence, str) else sentence:
                try:
                    found.append(self._text(text))
                    break
                except NotComputed:
                    continue
        return " ".join(found)

    def _value(self, key: str) -> Any:
        """A field of the statement, or what the row has of that name: a number, an estimate or a text."""
        stated = getattr(self.statement, key)
        stated = self.own.get(key) if stated in (None, "") else stated
        if not isinstance(stated, str):
            return stated
        try:
            alone = FIELD.fullmatch(stated)
            return at(alone[1], self.tree) if alone and alone[2] is None else self._text(stated)
        except NotComputed:
            return None

    def _text(self, template: str) -> str:
        return filled(template, self.tree, _words)


def _words(value: Any, form: str) -> str:
    """A value in a sentence."""
    form = form or DIGITS
    if value is None:
        raise NotComputed
    if isinstance(value, str):
        return value
    if isinstance(value, Mapping):
        return papers.between(value, int(form))
    if isinstance(value, Sequence | np.ndarray):
        return " / ".join(_words(one, form) for one in value)
    return papers.number(value, int(form)) if form.isdigit() else format(value, form)
