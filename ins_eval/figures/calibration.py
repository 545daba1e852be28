"""One accelerometer in the chamber: scale factor and bias against temperature, and what each model leaves of them.

`points` is a mapping of columns (n,): `temperature_c`, `rate_c_per_min`, `ramp_c_per_min`, `elapsed_s`, `scale`,
`bias_ug`. The kinds are those of Figures 5, 6 and 7 of Paper A.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ins_eval.figures.style import QUIET, colour, decimate, in_order, label, legend_below, sheet, styled

Columns = Mapping[str, np.ndarray]

BRANCH = {"falling": "#35978f", "rising": "#d08a00"}
SHORTEST_STRETCH_C = 3.0  # a shorter one is the noise of the reading about a turning point
TEMPERATURE = "temperature [°C]"
SCALE, BIAS = "scale", "bias_ug"
LEFT_OF = {SCALE: "K1 [ppm]", BIAS: "K0 [µg]"}


@styled
def scale_against_temperature(
    *, points: Columns, fitted: Columns, title: str = "Scale factor against temperature"
) -> Figure:
    """Four-point K1, and the same less the free line; `fitted` model -> K1 (n,) at the points."""
    note = (
        "Means over one degree of the reading, a line for each rate of the chamber. Right: less the line of simple "
        "compensation, in ppm, so that loop and curvature show."
    )
    return _against_temperature(points, fitted, SCALE, "K1 [pulse/(g s)]", title, note)


@styled
def bias_against_temperature(*, points: Columns, fitted: Columns, title: str = "Bias against temperature") -> Figure:
    """Four-point K0, and the same less the free line; `fitted` model -> K0 (n,) in µg at the points."""
    note = (
        "Means over one degree of the reading, a line for each rate of the chamber, each with the bias of its own "
        "switch-on. Right: less the line of simple compensation."
    )
    return _against_temperature(points, fitted, BIAS, "K0 [µg]", title, note)


@styled
def residual_against_temperature(
    *, points: Columns, residual: Columns, quantity: str, title: str = "What each model leaves, against temperature"
) -> Figure:
    """`residual` model -> (n,), of the `quantity` "scale" in ppm or "bias_ug" in µg; one panel a model."""
    names = in_order(residual)
    rows = -(-len(names) // 2)
    note = "Means over one degree of the reading, a line for each rate of the chamber. Mind the scale of each panel."
    figure, grid = sheet(1.0 + 1.9 * rows, title, note, rows=rows, columns=2, sharex=True, squeeze=False)
    for ax, name in zip(grid.flat, names, strict=False):
        _draw_branches(ax, points, residual[name])
        ax.axhline(0.0, color=QUIET, linewidth=0.6, zorder=1)
        ax.set_title(label(name))
        ax.set_ylabel(LEFT_OF[quantity])
    for ax in grid.flat[len(names) :]:
        ax.set_visible(False)
    for column in range(2):
        shown = [ax for ax in grid[:, column] if ax.get_visible()]
        if shown:
            shown[-1].set_xlabel(TEMPERATURE)
            shown[-1].tick_params(labelbottom=True)
    legend_below(figure, grid[0, 0])
    return figure


@styled
def residual_against_time(
    *, points: Columns, scale_ppm: Columns, bias_ug: Columns, title: str = "What remains, against time"
) -> Figure:
    """Residuals of K1 (model -> (n,) in ppm) and of K0 (model -> (n,) in µg), the rates one after the other."""
    note = "The rates of the chamber one after the other (dotted: the next one begins); only the time of the readings."
    figure, (above, below) = sheet(4.6, title, note, rows=2, sharex=True)
    time_h, starts_h = _one_after_the_other(points)
    for ax, residual, text in ((above, scale_ppm, LEFT_OF[SCALE]), (below, bias_ug, LEFT_OF[BIAS])):
        for name in in_order(residual):
            ax.plot(*decimate(time_h, residual[name], 600), color=colour(name), linewidth=0.8, label=label(name))
        for start in starts_h[1:]:
            ax.axvline(start, color=QUIET, linewidth=0.6, linestyle=(0, (1, 2)))
        ax.axhline(0.0, color=QUIET, linewidth=0.6, zorder=1)
        ax.set_ylabel(text)
    below.set_xlabel("time [h]")
    below.set_xlim(0.0, float(time_h[-1]))
    legend_below(figure, above, below)
    return figure


def _against_temperature(points: Columns, fitted: Columns, quantity: str, text: str, title: str, note: str) -> Figure:
    """The quantity itself on the left, and less the line of simple compensation on the right."""
    figure, (whole, detail) = sheet(3.9, title, note, columns=2)
    values = points[quantity]
    line = fitted.get("simple", np.full(values.size, np.mean(values)))
    unit = 1e6 / float(np.mean(values)) if quantity == SCALE else 1.0
    _draw_branches(whole, points, values)
    _draw_branches(detail, points, unit * (values - line))
    order = np.argsort(points["temperature_c"])
    whole.plot(points["temperature_c"][order][[0, -1]], line[order][[0, -1]], color=colour("simple"), label="simple")
    detail.axhline(0.0, color=colour("simple"), linewidth=1.2, zorder=1)
    if "quadratic" in fitted:
        curve = unit * (fitted["quadratic"] - line)
        detail.plot(*_by_degree(points["temperature_c"], curve), color=colour("quadratic"), label="quadratic")
    if "hysteresis" in fitted:
        for rows, branch in _stretches(points):
            detail.plot(
                *_by_degree(points["temperature_c"][rows], unit * (fitted["hysteresis"] - line)[rows]),
                color=colour("hysteresis"),
                linestyle="-" if branch == "falling" else (0, (4, 2)),
                linewidth=0.9,
                label=f"hysteresis, {branch}",
            )
    whole.set(xlabel=TEMPERATURE, ylabel=text)
    detail.set(xlabel=TEMPERATURE, ylabel=f"less the simple line\n{LEFT_OF[quantity]}")
    whole.ticklabel_format(useOffset=False, axis="y")
    legend_below(figure, whole, detail, columns=6)
    return figure


def _draw_branches(ax: Axes, points: Columns, values: np.ndarray) -> None:
    """Every stretch of falling or rising temperature, in the colour of its branch."""
    for rows, branch in _stretches(points):
        means = _by_degree(points["temperature_c"][rows], values[rows])
        ax.plot(*means, color=BRANCH[branch], linewidth=0.7, label=branch)


def _stretches(points: Columns) -> Iterator[tuple[slice, str]]:
    """Rows of each stretch in which the temperature goes one way, ramp by ramp, and the branch it is on."""
    for ramp in _groups(points["ramp_c_per_min"]):
        rising = points["rate_c_per_min"][ramp] > 0.0
        for part in _groups(rising):
            rows = slice(ramp.start + part.start, ramp.start + part.stop)
            if np.ptp(points["temperature_c"][rows]) >= SHORTEST_STRETCH_C:
                yield rows, "rising" if rising[part.start] else "falling"


def _by_degree(temperature_c: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Means over each whole degree that was read, in order of temperature."""
    degree, of = np.unique(np.round(temperature_c), return_inverse=True)
    return degree, np.bincount(of, values) / np.bincount(of)


def _one_after_the_other(points: Columns) -> tuple[np.ndarray, list[float]]:
    """Time in h (n,) over the ramps in their order, and the start of each."""
    time_s, starts = np.empty(points["elapsed_s"].size), []
    end = 0.0
    for rows in _groups(points["ramp_c_per_min"]):
        starts.append(end / 3600.0)
        elapsed = points["elapsed_s"][rows]
        time_s[rows] = end + elapsed - elapsed[0]
        end = float(time_s[rows][-1]) + float(np.median(np.diff(elapsed)))
    return time_s / 3600.0, starts


def _groups(column: np.ndarray) -> list[slice]:
    """Stretches of consecutive rows in which a column keeps its value."""
    edges = [0, *(np.flatnonzero(np.diff(column)) + 1).tolist(), column.size]
    return [slice(a, b) for a, b in zip(edges[:-1], edges[1:], strict=True)]
