"""One look for every figure: colours, names of compensations, type, decimation and SVG output."""

from __future__ import annotations

import functools
import io
import re
import textwrap
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.text import Text
from matplotlib.textpath import text_to_path
from matplotlib.ticker import FixedLocator

from ins_eval.figures.scales import name_groups, with_scales
from ins_eval.printable import printable
from ins_eval.wording import in_symbols, joined, unbroken

WIDTH_IN = 8.0
HANDLE, PAD, SPACING = 1.8, 0.8, 2.0  # of a legend, in font sizes: its lines, from there to the text, between columns
TITLE_PT = 11.0
LEGEND_ROW_IN, ROWS_INCLUDED = 0.17, 2  # of a legend; what the height of a sheet allows for
UNHINTED = 1.03  # a text is up to so many times as wide when drawn as when it is measured
NOTE_PT = 8.5
NOTE_CHARACTERS = 126  # of NOTE_PT across WIDTH_IN
INK, QUIET, FAINT = "#222222", "#666666", "#d9d9d9"
OUTAGE = "#f3e2b3"
ACCENT = "#b8860b"  # the published values, on every figure

# Simple is blue and hysteresis red, as in Paper A; a refined one is dark, its unrefined twin light.
# Blue and red differ in lightness too, so that they stay apart in grey and for colour-blind readers.
COLOUR = {
    "none": "#8a8a8a",
    "quadratic": "#8073ac",
    "simple": "#4a9bd4",
    "simple_anchored": "#8fb8d0",
    "simple_refined": "#12508f",
    "hysteresis": "#f0876a",
    "hysteresis_refined": "#b2182b",
    "hysteresis_scale_only": "#f4b183",
    "hysteresis_bias_only": "#d6604d",
    "hysteresis_without_rate": "#dba0a8",
    "hysteresis_blind": "#b08968",
    "hysteresis_piecewise_scale": "#e8c4a2",
}
OTHER_COLOURS = (("#5aae61", "#1b7837"), ("#5ab4ac", "#01665e"))  # a user's own models, and the same refined
DWARFS = 4.0  # a curve so many times the main ones would leave them flat: by eye
ALIKE = 1e-9  # of its largest value: curves that differ by less are the same but for rounding
REFINED = "_refined"  # what ends the name of a model whose oven run was used

LABEL = {
    "none": "none",
    "quadratic": "quadratic",
    "simple": "simple",
    "simple_anchored": "simple, anchored",
    "simple_refined": "simple, refined",
    "hysteresis": "hysteresis",
    "hysteresis_refined": "hysteresis, refined",
    "hysteresis_scale_only": "hysteresis, scale factor only",
    "hysteresis_bias_only": "hysteresis, bias only",
    "hysteresis_without_rate": "hysteresis, without rate terms",
    "hysteresis_blind": "hysteresis, bias blind to direction",
    "hysteresis_piecewise_scale": "hysteresis, piecewise scale factor",
}

RC = {
    "font.family": ["DejaVu Sans"],  # comes with matplotlib: the layout is the same everywhere
    "font.size": 9.0,
    "axes.titlesize": 9.0,
    "axes.labelsize": 9.0,
    "axes.edgecolor": QUIET,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#ececec",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.2,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "text.color": INK,
    "xtick.color": QUIET,
    "ytick.color": QUIET,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "axes.unicode_minus": True,
    "svg.fonttype": "none",
    "svg.hashsalt": "ins_eval",
}


def colour(name: str) -> str:
    """The colour of a compensation, the same in every figure."""
    light, dark = OTHER_COLOURS[zlib.crc32(name.removesuffix(REFINED).encode()) % len(OTHER_COLOURS)]
    return COLOUR.get(name) or (dark if name.endswith(REFINED) else light)


def label(name: str) -> str:
    """The name of a compensation as a reader sees it."""
    own = name.removesuffix(REFINED)
    return LABEL.get(name) or printable(name if own == name else f"{own}, refined")


def in_order(names: Iterable[str]) -> list[str]:
    """Compensations in the order of `COLOUR`, a user's own models first."""
    order = list(COLOUR)
    return sorted(names, key=lambda name: (order.index(name) if name in order else -1, name))


def is_own(name: str) -> bool:
    """Whether a compensation is what is believed or a user's own model, and none of the built-in ones."""
    return name not in COLOUR


def in_scale(sizes: Mapping[str, float]) -> list[str]:
    """Compensations that a common axis shows in full, by the largest size of each: not those that dwarf the main ones.

    Main are the user's own; without one all but "none", less the largest of them where there are several.
    """
    main = sorted(size for name, size in sizes.items() if is_own(name))
    if not main:
        main = sorted(size for name, size in sizes.items() if name != "none")
        main = main[:-1] or main
    return [name for name, size in sizes.items() if not main or not size > DWARFS * main[-1] > 0.0]


def distinct(series: Mapping[str, np.ndarray]) -> dict[str, str]:
    """What the legend says of each compensation whose curve is drawn, in order: of equal curves the first is."""
    found: dict[str, list[str]] = {}
    for name in in_order(series):
        values = np.asarray(series[name], dtype=float)
        close = ALIKE * np.nanmax(np.abs(values)) if np.isfinite(values).any() else 0.0
        alike = (
            first for first in found if np.allclose(series[first], values, rtol=0.0, atol=close, equal_nan=True)
        )  # fmt: skip
        found.setdefault(next(alike, name), []).append(name)
    return {
        first: label(first) + (f" (same as {joined([label(name) for name in others])})" if others else "")
        for first, (_, *others) in found.items()
    }


def styled(draw: Callable[..., Figure]) -> Callable[..., Figure]:
    """Let a figure function run under `RC`, whatever the settings around it."""

    @functools.wraps(draw)
    def wrapped(*args, **kwargs) -> Figure:
        with mpl.rc_context():
            mpl.rcdefaults()
            mpl.rcParams.update(RC)
            return as_written(draw(*args, **kwargs))

    return wrapped


def as_written(figure: Figure) -> Figure:
    """The figure whose texts are drawn as they stand: a `$` of a name begins no formula, and nothing in it acts.

    The numbers of an axis are made when it is drawn, so that those in powers of ten are not touched; names on it are.
    """
    for axis in (axis for ax in figure.axes for axis in (ax.xaxis, ax.yaxis)):
        if isinstance(at := axis.get_major_locator(), FixedLocator):  # names, which are set anew when they are drawn
            axis.set_ticklabels([_clean(name) for name in axis.get_major_formatter().format_ticks(at())])
    for text in _texts(figure):
        if text.get_text():
            text.set_text(_clean(text.get_text()))
            text.set_parse_math(False)
    return figure


def _clean(text: str) -> str:
    return in_symbols(printable(text, keep="\n"))


def _texts(artist: Artist) -> Iterator[Text]:
    """Every text below an artist; of an axis without the numbers that are yet to be made, and would be by asking."""
    if isinstance(artist, Text):
        yield artist
    if isinstance(artist, Axis):
        made = (*vars(artist).get("majorTicks", ()), *vars(artist).get("minorTicks", ()))
        below = [artist.label, artist.offsetText, *made]
    else:
        below = artist.get_children()
    for one in below:
        yield from _texts(one)


class Drawing(Figure):
    """A figure that a notebook shows, whether or not it was told to show those of matplotlib."""

    def _repr_svg_(self) -> str:
        return svg(self)


def sheet(height_in: float, title: str, note: str, *, rows: int = 1, columns: int = 1, **grid):
    """A figure with a title and, below it in grey, the definition and window: (Figure, Axes or array of them)."""
    figure = Drawing(figsize=(WIDTH_IN, height_in), dpi=72, layout="constrained")  # dpi of SVG
    lines = textwrap.wrap(unbroken(note), NOTE_CHARACTERS)
    # The layout keeps room for a figure title only, so the title carries blank lines where the note will stand.
    figure.suptitle(title + "\n" * len(lines), x=0.008, ha="left", fontsize=TITLE_PT, fontweight="bold")
    if lines:
        top = 1.0 - (1.45 * TITLE_PT + 4.0) / (72.0 * height_in)
        figure.text(0.008, top, "\n".join(lines), va="top", fontsize=NOTE_PT, color=QUIET, linespacing=1.3)
    axes = figure.subplots(rows, columns, **grid)
    return figure, axes


def legend_below(figure: Figure, *axes: Axes, columns: int = 4) -> None:
    """One legend under the panels, where it covers no data; equal entries once, in at most so many columns as fit."""
    entries: dict[str, object] = {}
    for ax in axes:
        for handle, text in zip(*ax.get_legend_handles_labels(), strict=True):
            entries.setdefault(text, handle)
    if entries:
        fitting = (count for count in range(columns, 1, -1) if _legend_width_pt(list(entries), count) < 72.0 * WIDTH_IN)
        chosen = next(fitting, 1)
        _make_taller(figure, LEGEND_ROW_IN * max(0, -(-len(entries) // chosen) - ROWS_INCLUDED))
        options = {"ncols": chosen, "handlelength": HANDLE, "columnspacing": SPACING, "handletextpad": PAD}
        figure.legend(entries.values(), entries.keys(), loc="outside lower left", **options)


def _make_taller(figure: Figure, by_in: float) -> None:
    """Let a figure grow by so much at its foot; what stands at its head keeps its distance from there."""
    old = figure.get_figheight()
    figure.set_figheight(old + by_in)
    for text in figure.texts:
        text.set_y(1.0 - (1.0 - text.get_position()[1]) * old / (old + by_in))


def _legend_width_pt(texts: Sequence[str], columns: int) -> float:
    """How wide a legend is that is filled column by column."""
    font = FontProperties(family=RC["font.family"], size=RC["legend.fontsize"])
    wide = [text_to_path.get_text_width_height_descent(text, font, ismath=False)[0] for text in texts]
    split = [part for part in np.array_split(wide, columns) if part.size]
    blank, border = RC["legend.fontsize"] * (HANDLE + PAD), 2.0 * RC["legend.fontsize"]
    between = RC["legend.fontsize"] * SPACING * (len(split) - 1)
    return sum(UNHINTED * float(part.max()) + blank for part in split) + between + border


def shade(ax: Axes, spans: Sequence[tuple[float, float]], text: str, *, color: str = OUTAGE) -> None:
    """Shade spans of time; only the first enters the legend."""
    for k, (start, end) in enumerate(spans):
        ax.axvspan(start, end, color=color, linewidth=0, zorder=0.5, label=text if k == 0 else "_")


def decimate(time_s: np.ndarray, values: np.ndarray, limit: int = 800) -> tuple[np.ndarray, np.ndarray]:
    """At most about `limit` points of a series that keep every visible extreme and every gap (NaN).

    The lowest and the highest point of each of limit/2 stretches are kept, so a spike of one sample survives.
    """
    time_s, values = np.asarray(time_s, dtype=float), np.asarray(values, dtype=float)
    n = values.size
    if n <= limit:
        return time_s, values
    finite = np.isfinite(values)
    edges = np.linspace(0, n, limit // 2 + 1).astype(int)
    keep = [0, n - 1, *(np.flatnonzero(np.diff(finite)) + 1), *np.flatnonzero(np.diff(finite))]
    stretch = np.repeat(np.arange(edges.size - 1), np.diff(edges))
    known = np.logical_or.reduceat(finite, edges[:-1])
    for signed in (values, -values):  # the first of the lowest, then of the highest
        lowest = np.fmin.reduceat(signed, edges[:-1])
        at = np.flatnonzero(signed == lowest[stretch])
        stretches, first = np.unique(stretch[at], return_index=True)
        keep += [*at[first][known[stretches]]]
    kept = np.unique(keep)
    return time_s[kept], values[kept]


def svg(figure: Figure) -> str:
    """The figure as an SVG file: text stays text, no date, coordinates to 0.01 pt; the same bytes each time."""
    buffer = io.StringIO()
    name_groups(figure)
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(RC)
        canvas = FigureCanvasSVG(figure)  # its layout is found with the widths of text in this format
        if layout := figure.get_layout_engine():
            layout.execute(figure)
            figure.set_layout_engine(None)  # a second layout would start from the first and shift by a hair
        canvas.print_svg(buffer, metadata={"Date": None, "Creator": None})  # `savefig` draws twice
    short = re.sub(r' d="[^"]*"', lambda path: re.sub(r"(?<=\.\d\d)\d+", "", path[0]), buffer.getvalue())
    return with_scales(short, figure)
