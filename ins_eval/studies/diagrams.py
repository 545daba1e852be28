"""Block diagrams from a TOML table: ``elements`` on a sheet of 10 by 3.75 units, or a ``chain`` of boxes.

    ["box", x, y, width, height, text]         ["arrow", x, y, to x, to y]        ["marked ...", ...] in the accent
    ["enclosure", x, y, width, height, text]   ["line", [x ...], [y ...]]         ["sum", x, y] where two flows meet
    ["words", x, y, text, { size, ha, va }]    in grey, with ``ink`` in black

A table with ``on`` draws its elements on those of another one. The first boxes of a chain may be ``unseen``, and
``leads_in`` names what enters a box from above.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

from ins_eval.figures.style import ACCENT, INK, QUIET, sheet, styled

HEIGHT_IN, CHAIN_HEIGHT_IN, LED_CHAIN_HEIGHT_IN = 2.7, 1.7, 2.1
BOX, ENCLOSURE, UNSEEN = "#f2f2f2", "#fbf6ea", "#9a9a9a"
GAP = 0.32  # between the boxes of a chain


def diagrams(file: Path) -> dict[str, Figure]:
    """Every diagram of a file by its name."""
    tables = tomllib.loads(file.read_text(encoding="utf-8"))
    return {name: _drawn({**tables.get(table.get("on"), {}), **table}, tables) for name, table in tables.items()}


@styled
def _drawn(table: Mapping[str, Any], tables: Mapping[str, Any]) -> Figure:
    chain, leads_in = table.get("chain"), table.get("leads_in")
    height_in = HEIGHT_IN if not chain else LED_CHAIN_HEIGHT_IN if leads_in else CHAIN_HEIGHT_IN
    ax = sheet(table.get("height_in", height_in), table["title"], table["note"])[1]
    ax.set(xlim=(0.0, 10.0), ylim=(0.0, 3.75))
    ax.axis("off")
    if chain:
        _chain(ax, chain, table.get("unseen", 0), leads_in)
    else:
        for kind, *of in (*tables.get(table.get("on"), {}).get("elements", ()), *table["elements"]):
            DRAW[kind](ax, *of)
    return ax.figure


def _box(ax: Axes, x: float, y: float, width: float, height: float, text: str) -> None:
    shape = FancyBboxPatch((x, y), width, height, boxstyle="round,pad=0,rounding_size=0.08")
    shape.set(facecolor=BOX, edgecolor=QUIET, linewidth=0.8, zorder=2)
    ax.add_patch(shape)
    ax.text(x + width / 2, y + height / 2, text, ha="center", va="center", fontsize=8.5, zorder=3, linespacing=1.3)


def _marked_box(ax: Axes, *of: Any) -> None:
    _box(ax, *of)
    ax.patches[-1].set(edgecolor=ACCENT, linewidth=1.4)


def _enclosure(ax: Axes, x: float, y: float, width: float, height: float, text: str) -> None:
    shape = FancyBboxPatch((x, y), width, height, boxstyle="square,pad=0")
    shape.set(facecolor=ENCLOSURE, edgecolor=INK, linewidth=1.2, zorder=1)
    ax.add_patch(shape)
    ax.text(x + 0.1, y + height - 0.12, text, ha="left", va="top", fontsize=8.5, color=QUIET, zorder=3)


def _arrow(ax: Axes, x: float, y: float, to_x: float, to_y: float, color: str = INK, linewidth: float = 1.0) -> None:
    style = {"arrowstyle": "-|>", "color": color, "linewidth": linewidth}
    ax.annotate("", (to_x, to_y), (x, y), arrowprops=style, zorder=4)


def _marked_arrow(ax: Axes, x: float, y: float, to_x: float, to_y: float) -> None:
    _arrow(ax, x, y, to_x, to_y, ACCENT, 1.4)


def _line(ax: Axes, x: Sequence[float], y: Sequence[float]) -> None:
    ax.plot(x, y, color=INK, linewidth=1.0)


def _sum(ax: Axes, x: float, y: float) -> None:
    ax.plot(x, y, "o", color="white", markeredgecolor=INK, markersize=13, zorder=3)
    ax.text(x, y, "+", ha="center", va="center", fontsize=10, zorder=4)
    ax.text(x - 0.16, y - 0.4, "−", ha="center", fontsize=10)


def _words(ax: Axes, x: float, y: float, text: str, look: Mapping[str, Any]) -> None:
    placed = {key: look[key] for key in ("ha", "va") if key in look}
    ax.text(x, y, text, fontsize=look["size"], color=INK if look.get("ink") else QUIET, **placed)


DRAW = {
    **{"box": _box, "marked box": _marked_box, "enclosure": _enclosure, "arrow": _arrow},
    **{"marked arrow": _marked_arrow, "line": _line, "sum": _sum, "words": _words},
}


def _chain(ax: Axes, texts: Sequence[str], unseen: int, leads_in: Mapping[str, Any] | None) -> None:
    """Boxes from left to right, the first `unseen` grey; `leads_in` names what enters a box from above."""
    ax.set_ylim(0.7, 3.3 if leads_in else 2.6)
    width = (9.9 - GAP * (len(texts) - 1)) / len(texts)
    for k, text in enumerate(texts):
        x = 0.05 + k * (width + GAP)
        _box(ax, x, 0.9, width, 1.5, text)
        if k < unseen:
            ax.texts[-1].set_color(UNSEEN)
        if k + 1 < len(texts) and k + 1 != unseen:
            _arrow(ax, x + width, 1.65, x + width + GAP, 1.65)
        if leads_in and leads_in["box"] == k:
            _arrow(ax, x + width / 2, 3.2, x + width / 2, 2.4)
            ax.text(x + width / 2 + 0.12, 2.85, leads_in["words"], fontsize=8.5, color=QUIET)
