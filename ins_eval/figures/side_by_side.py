"""Values with their 95 % intervals in rows, one below the other: runs, recordings, what a model expects."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from ins_eval.figures.style import INK, QUIET, legend_below, sheet, styled

MOST_ROWS = 40  # beyond which names could not be read
DECADE = 10.0  # between values, from which their axis is logarithmic


class Value(NamedTuple):
    """A row: its name, its value with the ends of its interval (nan: none), and of what it is, for the legend."""

    name: str
    value: float
    low: float = np.nan
    high: float = np.nan
    of: str = ""
    colour: str = INK


@styled
def side_by_side(
    *, values: Sequence[Value], title: str, rows: str, axis: str, note: str = "", nothing: float | None = None
) -> Figure:
    """A dot for each of `values` with a line over its interval; values of one name share a row.

    `rows` says what a row is, `axis` what the values are, "name [unit]"; at `nothing` there is no difference.
    """
    names = list(dict.fromkeys(one.name for one in values))
    if len(names) > MOST_ROWS:
        note = f"{note} The first {MOST_ROWS} of {len(names)}.".strip()
    shown = [one for one in values if one.name in names[:MOST_ROWS]]
    kinds = list(dict.fromkeys(one.of for one in shown))
    figure, ax = sheet(1.5 + 0.3 * len(names[:MOST_ROWS]), title, note)
    for one in shown:
        row = names.index(one.name) + 0.5 * (kinds.index(one.of) - 0.5 * (len(kinds) - 1)) / len(kinds)
        ax.plot(
            [one.low, one.high],
            [row, row],
            color=one.colour,
            linewidth=2.0,
            label="95 % interval" if np.isfinite(one.low) else "_",
        )
        ax.plot(one.value, row, "o", color=one.colour, markersize=5, label=one.of or "value")
    if nothing is not None:
        ax.axvline(nothing, color=QUIET, linewidth=0.8, linestyle="--", label="no difference")
    sizes = [one.value for one in shown]
    if nothing is None and min(sizes) > 0.0 and max(sizes) > DECADE * min(sizes):
        ax.set_xscale("log")
        ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        ax.xaxis.set_minor_formatter(NullFormatter())
    ax.set_yticks(range(len(names[:MOST_ROWS])), names[:MOST_ROWS])
    ax.set_ylim(len(names[:MOST_ROWS]) - 0.5, -0.5)
    ax.grid(axis="y", visible=False)
    ax.set(xlabel=axis, ylabel=rows)
    legend_below(figure, ax)
    return figure
