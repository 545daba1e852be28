"""What an SVG file says of its axes and curves, so that a page can read values off them and zoom along time.

A group of axes holds ``data-box`` (left, top, width and height in the drawing), ``data-x`` and ``data-y`` (lowest and
highest value; ``linear``, ``log`` or ``names``), ``data-x-label`` and ``data-y-label``; a curve holds ``data-name``;
a text that stands at a value of x holds ``data-at``.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from html import escape

from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator

NUMBER = re.compile(r"[-−+]?[\d.]*")
GROUP = '<g id="{}"'


def name_groups(figure: Figure) -> None:
    """Give the groups of an SVG file that are to hold data names of their own."""
    for a, ax in enumerate(figure.axes):
        ax.set_gid(f"panel_{a}")
        for k, line in enumerate(ax.lines):
            line.set_gid(f"curve_{a}_{k}")
        for k, text in enumerate(ax.texts):
            text.set_gid(f"note_{a}_{k}")


def with_scales(drawing: str, figure: Figure) -> str:
    """The SVG file of a figure, drawn with these names, with the data in its groups."""
    data = {name: values for ax in figure.axes for name, values in _of(ax, figure.bbox.height).items()}
    for name, values in data.items():
        said = "".join(f' data-{key}="{escape(value)}"' for key, value in values.items())
        drawing = drawing.replace(GROUP.format(name), GROUP.format(name) + said, 1)
    return drawing


def _of(ax: Axes, height: float) -> dict[str, Mapping[str, str]]:
    left, bottom, right, top = ax.bbox.extents
    found: dict[str, Mapping[str, str]] = {
        str(ax.get_gid()): {
            "box": f"{left:.2f} {height - top:.2f} {right - left:.2f} {top - bottom:.2f}",
            "x": "{:.9g} {:.9g} ".format(*ax.get_xlim()) + _kind(ax.xaxis),
            "y": "{:.9g} {:.9g} ".format(*ax.get_ylim()) + _kind(ax.yaxis),
            "x-label": _label([one.get_xlabel() for one in (ax, *ax.get_shared_x_axes().get_siblings(ax))]),
            "y-label": _label([one.get_ylabel() for one in (ax, *ax.get_shared_y_axes().get_siblings(ax))]),
        }
    }
    for line in ax.lines:
        if not str(line.get_label()).startswith("_"):
            found[str(line.get_gid())] = {"name": str(line.get_label())}
    for text in ax.texts:
        if text.get_transform() != ax.transAxes:
            found[str(text.get_gid())] = {"at": f"{text.get_position()[0]:.9g}"}
    return found


def _kind(axis: Axis) -> str:
    """``linear`` or ``log``, or ``names`` where words stand beside its rows."""
    if isinstance(at := axis.get_major_locator(), FixedLocator):
        shown = axis.get_major_formatter().format_ticks(at())
        if not all(NUMBER.fullmatch(one) for one in shown):
            return "names"
    return axis.get_scale()


def _label(texts: list[str]) -> str:
    """The first label that says something, on one line; panels that share an axis label it once."""
    return re.sub(r"\s+", " ", next(filter(None, texts), ""))
