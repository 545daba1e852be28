"""Words and signs that no page, message or help text may contain: a reader sees plain words and the field's units."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[2] / "ins_eval"
SEEN = (
    "report",
    "figures",
    "interface",
    "exports",
    "diagnosis/unnamed",
    "cli.py",
    "options.py",
    "wording.py",
)
FORBIDDEN = {
    "after having looked everywhere": "with every channel and interval searched",
    "The same as a figure": "what the figure shows",
    "in fewer than one in a million recordings": "in fewer than one recording in a million",
    "by themselves": "estimated without a model",
    "Left beside them": "what is left",
    "Nor has it": "it has no",
    "restless": "standard deviation",
    "torque of the magnet": "what a unit of every grade has",
    "for want of": "for lack of",
    "pay for having been chosen": "the price of choosing among all",
    "parts the two": "separates the two",
    "nothing is at rest": "no stretch of so many seconds is at rest",
    "makes it less": "reduces this",
    "leave it away": "leave it out",
    "is no drift to tell": "no drift is found",
    "What time did meanwhile": "changes with time are included",
}
SIGNS = {r"\+-": "±", r"\bug\b(?!_)": "µg", r"\burad\b": "µrad"}


@cache
def shown(names: Sequence[str] = (".",)) -> list[tuple[str, str]]:
    """Every text of these parts of the code, with its place: no docstrings."""
    return list(_texts(names))


def _texts(names: Sequence[str]) -> Iterator[tuple[str, str]]:
    for name in names:
        path = PACKAGE / name
        for file in sorted(path.rglob("*.py")) if path.is_dir() else [path]:
            tree = ast.parse(file.read_text(encoding="utf-8"))
            documented = (ast.Module, ast.ClassDef, ast.FunctionDef)
            docs = {id(n.body[0].value) for n in ast.walk(tree)
                    if isinstance(n, documented) and n.body and isinstance(n.body[0], ast.Expr)}  # fmt: skip
            for node in ast.walk(tree):
                if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docs:
                    yield f"{file.relative_to(PACKAGE)}:{node.lineno}", node.value


@pytest.mark.parametrize("words", FORBIDDEN)
def test_mannered_words_are_gone(words: str) -> None:
    assert [place for place, text in shown() if words.lower() in text.lower()] == [], f"say: {FORBIDDEN[words]}"


@pytest.mark.parametrize("pattern", SIGNS)
def test_units_and_signs_are_those_of_the_field(pattern: str) -> None:
    sentences = [(place, text) for place, text in shown(SEEN) if " " in text or "[" in text]
    assert [place for place, text in sentences if re.search(pattern, text)] == [], f"write {SIGNS[pattern]}"


def test_the_physics_of_an_effect_is_named_in_words_of_every_grade() -> None:
    from ins_eval.effects import VOCABULARY

    assert [name for name, effect in VOCABULARY.items() if "torque of the magnet" in effect.physics] == []
