"""Where the INS believes it is: its track beside that of the reference, and how its error grows between fixes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from ins_eval.analysis.schuler import SCHULER_PERIOD_S
from ins_eval.figures.style import (
    INK,
    QUIET,
    colour,
    distinct,
    in_order,
    in_scale,
    is_own,
    label,
    legend_below,
    sheet,
    styled,
)

POINTS = 800  # of a track; it is not a function of time, so its points are thinned evenly
MOST_BANDS = 4  # of which overlapping ones can still be told apart: by eye
STILL = 0.05  # of the largest error: a reference that moves less would be a point


@styled
def ground_track(
    *, time_s: np.ndarray, reference_m: np.ndarray, errors_m: Mapping[str, np.ndarray], reference: str = "GPS"
) -> Figure:
    """Tracks over ground and INS minus `reference`, east and north in km, or in m of short ones, with equal scales.

    `time_s` (n,) since the start; `reference_m` (n, 2) north and east of the start; `errors_m` compensation -> (n, 2).
    """
    errors_m, cut = _kept(errors_m)
    largest = max(float(np.nanmax(np.abs(one))) for one in errors_m.values())
    still = float(np.nanmax(np.abs(reference_m))) < STILL * largest
    note = f"Left: tracks of INS and {reference}, from the start. Right: INS minus {reference}. "
    if still:
        note = f"INS minus {reference}, which moves too little to be drawn beside it. "
    note += "Equal scales north and east."
    if cut:
        note += f" Not drawn, for the others would be points: {', '.join(map(label, cut))}."
    title = "Ground track of the INS beside the reference"
    figure, panels = sheet(4.9, title, note, columns=1 if still else 2, squeeze=False)
    error, every = panels[0, -1], max(1, time_s.size // POINTS)
    if not still:
        far = float(np.nanmax(np.abs(reference_m)))
        _track(panels[0, 0], reference_m[::every], far, INK, reference.removeprefix("the "), width=2.2)
        for name, text in distinct(errors_m).items():
            _track(panels[0, 0], (reference_m + errors_m[name])[::every], far, colour(name), text)
        panels[0, 0].set_title("over ground")
        error.set_title(f"INS minus {reference}")
    marks = np.searchsorted(time_s, np.arange(1, int(time_s[-1] // SCHULER_PERIOD_S) + 1) * SCHULER_PERIOD_S)
    for name, text in distinct(errors_m).items():
        _track(error, errors_m[name][::every], largest, colour(name), text)
        at = errors_m[name][marks] / _unit(largest)[1]
        error.plot(at[:, 1], at[:, 0], "D", color=colour(name), markersize=4, label="_")
    error.plot(0.0, 0.0, "o", color=INK, markersize=5, label="start")
    if marks.size:
        error.plot([], [], "D", color=QUIET, markersize=4, linestyle="none", label="a Schuler period later (84.4 min)")
    for ax in panels[0]:
        ax.set_aspect("equal", adjustable="datalim")
        ax.ticklabel_format(useOffset=False)
    legend_below(figure, *panels[0])
    return figure


def _track(ax: Axes, north_east_m: np.ndarray, far_m: float, tint: str, text: str, width: float = 1.0) -> None:
    """A line on a map whose unit follows how far it goes."""
    unit, size = _unit(far_m)
    ax.plot(north_east_m[:, 1] / size, north_east_m[:, 0] / size, color=tint, linewidth=width, label=text)
    ax.set(xlabel=f"east [{unit}]", ylabel=f"north [{unit}]")


def _unit(far_m: float) -> tuple[str, float]:
    return ("km", 1000.0) if far_m >= 1000.0 else ("m", 1.0)


def _kept(errors_m: Mapping[str, np.ndarray]) -> tuple[dict[str, np.ndarray], list[str]]:
    """The tracks that fit on one map, and the names of those which are so wide that the others would be points."""
    kept = in_scale({name: float(np.nanmax(np.abs(one))) for name, one in errors_m.items()})
    return {name: errors_m[name] for name in kept}, [name for name in in_order(errors_m) if name not in kept]


@styled
def error_growth(
    *, after_s: np.ndarray, position_m: Mapping[str, np.ndarray], band_m: Mapping[str, np.ndarray], count: int
) -> Figure:
    """RMS position error against the time since a start afresh, compensation -> (m,), with its 95 % band (2, m)."""
    legend = distinct(position_m)
    main = _main(legend, position_m)
    note = f"RMS over {count} starts, each from a fix, whose noise is in it. Band: 95 % interval"
    note += "." if len(main) == len(legend) else " of the thick curves; the others are drawn thin."
    figure, ax = sheet(3.7, "How far it is off after the last fix", note)
    for name, text in legend.items():
        if name in main and np.isfinite(band_m[name]).all():
            ax.fill_between(after_s, *band_m[name], color=colour(name), alpha=0.18, linewidth=0)
        style = {"linewidth": 1.6, "zorder": 2.5} if name in main else {"linewidth": 0.7}
        ax.plot(after_s, position_m[name], color=colour(name), label=text, **style)
    ax.set(xscale="log", yscale="log", xlabel="time since the fix [s]", ylabel="position error, RMS [m]")
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(NullFormatter())
    ax.set_xlim(float(after_s[0]), float(after_s[-1]))
    legend_below(figure, ax)
    return figure


def _main(names: Iterable[str], position_m: Mapping[str, np.ndarray]) -> list[str]:
    """Whose bands are drawn: all of few; of many the user's own, none, and the best and the worst in the end."""
    names = list(names)
    if len(names) <= MOST_BANDS:
        return names
    at_end = sorted(names, key=lambda name: position_m[name][-1])
    return [name for name in names if is_own(name) or name in ("none", at_end[0], at_end[-1])]
