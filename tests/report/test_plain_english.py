"""Words and signs that no page, message, help text or docstring may contain: plain words and the field's units.

The pages of the benchmark are read, too.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from ins_eval.figures import style

REPOSITORY = Path(__file__).resolve().parents[2]
PACKAGE = REPOSITORY / "ins_eval"
PAGES = (PACKAGE, REPOSITORY / "benchmark" / "runners")
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
    "told apart": "separated",
    "tell apart": "separate",
    "tell them apart": "separate them",
    "tells them apart": "separates them",
    "sets them apart": "separates them",
    "would tell": "would separate, or would show",
    "told from": "separated from",
    "in the liveliest": "with the most motion",
    "found without a form": "estimated without a model",
    "motion does not tell": "the motion does not show, or determine",
    "cannot tell": "does not determine",
    "cannot be told": "is unknown, or not determined",
    "too small to tell": "too small to determine",
    "to part them": "to separate them",
    "whence": "from where",
    "takes a part over": "is smaller then",
    "drawn towards 0": "near 0",
    "that chance alone": "how often noise alone",
    "what noise leaves open": "from the noise",
    "hours of flight": "hours of navigation: a car does not fly",
    "are no share of": "are not a share of",
    "comes of it": "its result",
    "ours gives stands there": "where our values are",
    "stood beside it": "were known as well",
    "the tool said": "the verdict of diagnose",
    "that others know": "known from other sources",
    "who else knows": "what other sources say",
    "taken out of the simulation": "removed from the model, or from the belief",
    "temperature of another time": "temperatures shifted in time",
    "it came for its format": "kept for its format",
    "felt in them": "measured",
    "is drawn most": "where the attraction is largest",
    "by what makes it": "by cause",
    "told by its": "identified by its",
    "told by specific": "identified by its specific force",
    "what an effect must bring": "the threshold of an effect",
    "next flight with": "the next recording: a car does not fly",
}
SIGNS = {r"\+-": "±", r"\bug\b(?!_)": "µg", r"\burad\b": "µrad"}


@cache
def texts() -> list[tuple[str, str, bool]]:
    """Every text of the package with its place, and whether it is a docstring; a page and a TOML file are one text."""
    return list(_texts())


def _texts() -> Iterator[tuple[str, str, bool]]:
    endings = ("py", "toml", "html", "js")
    for file in sorted(path for of in PAGES for ending in endings for path in of.rglob(f"*.{ending}")):
        place, content = str(file.relative_to(REPOSITORY)), file.read_text(encoding="utf-8")
        if file.suffix != ".py":
            yield place, content, False
            continue
        tree = ast.parse(content)
        documented = (ast.Module, ast.ClassDef, ast.FunctionDef)
        docs = {id(n.body[0].value) for n in ast.walk(tree)
                if isinstance(n, documented) and n.body and isinstance(n.body[0], ast.Expr)}  # fmt: skip
        for node in ast.walk(tree):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                yield f"{place}:{node.lineno}", node.value, id(node) in docs


def plain(text: str) -> str:
    """Without the ends of lines, at which words would hide."""
    return re.sub(r"\s*\\?\n\s*", " ", text).lower()


@pytest.mark.parametrize("words", FORBIDDEN)
def test_mannered_words_are_gone(words: str) -> None:
    assert [place for place, text, _ in texts() if words.lower() in plain(text)] == [], f"say: {FORBIDDEN[words]}"


@pytest.mark.parametrize("pattern", SIGNS)
def test_units_and_signs_are_those_of_the_field(pattern: str) -> None:
    seen = [
        (place, text) for place, text, doc in texts() if place.removeprefix("ins_eval/").startswith(SEEN) and not doc
    ]
    sentences = [(place, text) for place, text in seen if " " in text or "[" in text]
    assert [place for place, text in sentences if re.search(pattern, text)] == [], f"write {SIGNS[pattern]}"


def test_the_physics_of_an_effect_is_named_in_words_of_every_grade() -> None:
    from ins_eval.effects import VOCABULARY

    assert [name for name, effect in VOCABULARY.items() if "torque of the magnet" in effect.physics] == []


def test_names_on_an_axis_have_the_signs_of_units_and_are_no_formula() -> None:
    figure, ax = style.sheet(3.0, "t", "")
    ax.set_yticks([0.0, 1.0], ["5 ug/degC", "a$x$b"])
    drawing = style.svg(style.as_written(figure))
    assert ">5 µg/°C<" in drawing and ">a$x$b<" in drawing
