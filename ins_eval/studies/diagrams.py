"""Block diagrams: boxes, enclosures and arrows on a canvas."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.patches import FancyBboxPatch

from ins_eval.figures.style import INK, QUIET, sheet

HEIGHT_IN = 2.7
BOX, ENCLOSURE = "#f2f2f2", "#fbf6ea"


def canvas(title: str, note: str, height_in: float = HEIGHT_IN) -> Axes:
    """A sheet of 10 by 3.75 units to draw on."""
    ax = sheet(height_in, title, note)[1]
    ax.set(xlim=(0.0, 10.0), ylim=(0.0, 3.75))
    ax.axis("off")
    return ax


def box(ax: Axes, x: float, y: float, width: float, height: float, text: str) -> None:
    shape = FancyBboxPatch((x, y), width, height, boxstyle="round,pad=0,rounding_size=0.08")
    shape.set(facecolor=BOX, edgecolor=QUIET, linewidth=0.8, zorder=2)
    ax.add_patch(shape)
    ax.text(x + width / 2, y + height / 2, text, ha="center", va="center", fontsize=8.5, zorder=3, linespacing=1.3)


def enclosure(ax: Axes, x: float, y: float, width: float, height: float, text: str) -> None:
    shape = FancyBboxPatch((x, y), width, height, boxstyle="square,pad=0")
    shape.set(facecolor=ENCLOSURE, edgecolor=INK, linewidth=1.2, zorder=1)
    ax.add_patch(shape)
    ax.text(x + 0.1, y + height - 0.12, text, ha="left", va="top", fontsize=8.5, color=QUIET, zorder=3)


def arrow(ax: Axes, start: tuple[float, float], end: tuple[float, float]) -> None:
    ax.annotate("", end, start, arrowprops={"arrowstyle": "-|>", "color": INK, "linewidth": 1.0}, zorder=4)
