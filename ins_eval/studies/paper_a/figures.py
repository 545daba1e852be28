"""Figures 1, 3 and 5-7 of Paper A with its axes: what the laboratory gives.

Fig. 9 and 10 are in `oven_figures`, Fig. 11-13 those of the flight report (`traces`), Fig. 2, 4 and 8 drawings
(``diagrams.toml``). A unit of the chamber is a mapping of columns (n,): `temperature_c`, `rate_c_per_min`,
`ramp_c_per_min`, `elapsed_s`, `scale`, `bias_ug`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator, StrMethodFormatter

from ins_eval.figures.style import (
    ACCENT,
    COLOUR,
    INK,
    QUIET,
    colour,
    decimate,
    label,
    legend_below,
    sheet,
    styled,
)
from ins_eval.wording import fixed

Statistic = Mapping[str, Any]  # {"value": float, "interval95": [low, high]}
Columns = Mapping[str, np.ndarray]
LOOPS = (INK, "#5e3c99", "#8073ac", "#b2abd2")  # from the outermost loop inwards
PRINTED = "Paper A"
SCALE_UNIT = "[pulse/(g s)]"
TABLE4 = ("none", "simple", "quadratic", "hysteresis")
TABLE4_TICKS = (1, 2, 5, 10, 20, 50, 100, 200)
FALLING, RISING = "#35978f", "#d08a00"


@styled
def magnet_loops(*, loops: Mapping[str, tuple[np.ndarray, np.ndarray]]) -> Figure:
    """Fig. 1: loops of the relative scale factor; name -> temperature (n,) in degC and change (n,) in ppm.

    The first loop is the outermost; along each the order is that of time. What comes before the first turn, the
    curve of a fresh magnet, is left out.
    """
    note = (
        "The magnet of the accelerometer in slow cycles of temperature; only its hysteresis, whatever the rate. Fig. 1 "
        "of Paper A shows another magnet (a ruthenium-iron compound below 5 K, over the field): only the kind of loop "
        "in its inset can be compared."
    )
    figure, ax = sheet(3.9, "Temperature hysteresis of the magnet", note)
    for k, (name, (temperature_c, change_ppm)) in enumerate(loops.items()):
        tint = LOOPS[k % len(LOOPS)]
        turns = np.flatnonzero(np.diff(np.sign(np.diff(temperature_c)))) + 1
        x, y = (np.asarray(values)[turns[0] :] for values in (temperature_c, change_ppm))
        ax.plot(*_thinned(x, y), color=tint, linewidth=1.6 if k == 0 else 1.1, label=name)
        if k == 0:
            turn = int(turns[1] - turns[0])
            _arrow(ax, x[: turn + 1], y[: turn + 1], tint)
            _arrow(ax, x[turn:], y[turn:], tint)
    ax.set(xlabel="temperature [°C]", ylabel="change of the scale factor [ppm]")
    ax.margins(y=0.12)
    legend_below(figure, ax)
    return figure


@styled
def loop_opening(*, openings: Mapping[str, Columns], at_c: float = 22.0) -> Figure:
    """Falling less rising K1 at `at_c`, one panel a unit; unit -> columns (m,), one for each rate of the chamber.

    Columns: `ramp_c_per_min`, and in ppm `magnet_ppm`, `rate_ppm`, `reading_ppm`, which add up to `total_ppm`.
    """
    note = (
        f"Falling less rising scale factor at a reading of {at_c:g} °C, by cause; bars below zero close the "
        "loop. The magnet's part is the same at every rate."
    )
    parts = (
        ("magnet_ppm", LOOPS[0], "magnet"),
        ("rate_ppm", FALLING, "rate terms of eq. (11)"),
        ("reading_ppm", RISING, "late reading of the thermometer"),
    )
    figure, panels = sheet(
        3.5, "What opens the loop of the scale factor", note, columns=len(openings), sharey=True, squeeze=False
    )
    for ax, (name, columns) in zip(panels[0], openings.items(), strict=True):
        at = np.arange(len(columns["ramp_c_per_min"]))
        above, below = np.zeros(at.size), np.zeros(at.size)
        for key, tint, text in parts:
            part = np.asarray(columns[key], dtype=float)
            ax.bar(at, part, 0.6, bottom=np.where(part >= 0.0, above, below), color=tint, label=text)
            above, below = above + np.maximum(part, 0.0), below + np.minimum(part, 0.0)
        style = {"color": ACCENT, "markeredgecolor": "white", "markersize": 7}
        ax.plot(at, columns["total_ppm"], "D", label="together", **style)
        ax.axhline(0.0, color=QUIET, linewidth=0.8)
        ax.set_xticks(at, [f"{ramp:g}" for ramp in columns["ramp_c_per_min"]])
        ax.set(xlabel="rate [°C/min]", title=name)
        ax.grid(axis="x", visible=False)
    panels[0, 0].set_ylabel("falling − rising [ppm]")
    legend_below(figure, *panels[0])
    return figure


@styled
def creep_elongation(*, runs: Sequence[Columns]) -> Figure:
    """Fig. 3a-c: one panel a block of resin, temperature left and elongation right, against time in min.

    Each run has `container_c` and the columns (n,) `time_min`, `temperature_c` and `creep_um`, the slow part alone.
    """
    note = (
        "Run #1 of each block. Elongation is the creep ΔLv alone, without the thermal step, as in the paper; positive: "
        "longer. The end is the ΔLv that Table 2 prints for run #1, the course to it is the model's."
    )
    figure, panels = sheet(
        5.4, "Creep of epoxy resin: temperature and elongation", note, rows=len(runs), sharex=True, squeeze=False
    )
    rights = []
    for ax, run, letter in zip(panels[:, 0], runs, "abcdef", strict=False):
        right = ax.twinx()
        rights.append(right)
        for side, key, tint, text in (
            (ax, "temperature_c", COLOUR["simple"], "temperature"),
            (right, "creep_um", COLOUR["hysteresis_refined"], "elongation"),
        ):
            side.plot(*decimate(run["time_min"], run[key], 400), color=tint, linewidth=1.4, label=text)
            side.margins(y=0.12)
        ax.set_title(f"{letter}: {fixed(run['container_c'], 0)} °C, ΔLv {fixed(run['creep_um'][-1], 3)} µm", loc="left")
        ax.set_ylabel("temperature\n[°C]", color=COLOUR["simple_refined"])
        right.set_ylabel("elongation\n[µm]", color=COLOUR["hysteresis_refined"])
        right.spines["right"].set_visible(True)
        right.grid(visible=False)
    panels[-1, 0].set_xlabel("time [min]")
    panels[-1, 0].set_xlim(float(runs[-1]["time_min"][0]), float(runs[-1]["time_min"][-1]))
    legend_below(figure, *panels[:, 0], *rights)
    return figure


@styled
def scale_factor_by_temperature(*, units: Mapping[str, Columns]) -> Figure:
    """Fig. 5a-c: K1 of each unit on the falling and the rising branch, one panel a unit; below it how far they part."""
    note = (
        "Four-point K1, means over one degree of the reading; a line for each rate of the chamber. Below: falling less "
        "rising, in ppm of the mean K1. The paper's axis is pulses per g, without a time base."
    )
    return _by_branch(
        units, "scale", f"K1 {SCALE_UNIT}", "falling − rising\n[ppm]", True, "Scale factor against temperature", note
    )


@styled
def bias_by_temperature(*, units: Mapping[str, Columns]) -> Figure:
    """Fig. 7a-c: K0 of each unit on the falling and the rising branch, one panel a unit; below it how far they part."""
    note = (
        "Four-point K0, means over one degree of the reading; a line for each rate of the chamber, each with the bias "
        "of its own switch-on. Below: falling less rising."
    )
    return _by_branch(units, "bias_ug", "K0 [µg]", "falling − rising\n[µg]", False, "Bias against temperature", note)


@styled
def compensated_scale_factor(*, units: Mapping[str, Columns], fitted: Mapping[str, Mapping[str, np.ndarray]]) -> Figure:
    """Fig. 6: what the hysteresis model leaves of K1 against time; the unit with the least residual first and large.

    `fitted` unit -> "simple" and "hysteresis" -> K1 of the model (n,) at the points of the unit.
    """
    note = (
        "K1 over the K1 of the model, the rates of the chamber one after the other (dotted: the next rate begins). "
        "Large: the unit with the least residual, as the paper shows “one of the best”. Below each name: RMS of what "
        "is left, and of what the simple model leaves."
    )
    left = {name: {m: _left_ppm(units[name], k1) for m, k1 in fitted[name].items()} for name in units}
    rms = {name: {m: float(np.std(ppm)) for m, ppm in models.items()} for name, models in left.items()}
    names = sorted(units, key=lambda name: rms[name]["hysteresis"])
    widths = [2.0] + [1.0] * (len(names) - 1)
    figure, panels = sheet(
        3.7,
        "Scale factor after hysteresis compensation",
        note,
        columns=len(names),
        width_ratios=widths,
        sharey=True,
        squeeze=False,
    )
    for ax, name in zip(panels[0], names, strict=True):
        time_h, starts_h = _one_after_the_other(units[name])
        for start in starts_h[1:]:
            ax.axvline(start, color=QUIET, linewidth=0.6, linestyle=(0, (1, 2)))
        ax.plot(
            *decimate(time_h, left[name]["hysteresis"], 600),
            color=colour("hysteresis"),
            linewidth=0.8,
            label="K1 compensated with the hysteresis model",
        )
        words = f"{rms[name]['hysteresis']:.0f} ppm (simple {rms[name]['simple']:.0f})"
        ax.set(xlabel="time [h]", title=f"{name}\n{words}")
        ax.set_xlim(0.0, float(time_h[-1]))
    panels[0, 0].set_ylabel("K1 off its level [ppm]")
    level = float(np.mean(units[names[0]]["scale"]))
    right = panels[0, 0].secondary_yaxis(
        "right", functions=(lambda y: level * (1.0 + 1e-6 * y), lambda y: 1e6 * (y / level - 1.0))
    )
    right.set_ylabel(f"K1 {SCALE_UNIT}")
    right.yaxis.set_major_formatter(StrMethodFormatter("{x:.0f}"))
    right.spines["right"].set_visible(True)
    legend_below(figure, *panels[0])
    return figure


@styled
def temperature_sensitivity(
    *,
    ours: Mapping[str, Mapping[str, Statistic]],
    printed: Mapping[str, Mapping[str, float]],
    scaled: Mapping[str, Mapping[str, Statistic]] | None = None,
    draws: int | None = None,
) -> Figure:
    """Ours, unit -> compensation -> statistic in ppm/degC, beside the printed value; `scaled`: rescaled coefficients.

    An interval spans the central 95 % of the draws.
    """
    note = (
        "(max − min) / (mean · span) of K1 left after compensation. Dot and line: median and central 95 %"
        + (f" of {draws} draws" if draws else "")
        + " of all that the paper does not print (play of the magnet, noise, thermal lag), with its printed "
        "coefficients and T0 = 22 °C."
    )
    names = [name for name in TABLE4 if any(name in arms for arms in ours.values())]
    figure, panels = sheet(
        2.0 + 0.36 * len(names),
        "Table 4: temperature sensitivity of the scale factor",
        note,
        columns=len(ours),
        sharex=True,
        sharey=True,
        squeeze=False,
    )
    series = [(ours, "o", 0.0, "printed coefficients")]
    if scaled:
        series = [(ours, "o", -0.15, "printed coefficients"), (scaled, "s", 0.15, "rescaled to Table 4")]
    for ax, unit in zip(panels[0], ours, strict=True):
        for tree, marker, shift, text in series:
            for row, name in enumerate(names):
                entry = tree.get(unit, {}).get(name)
                if entry:
                    # the legend shows the marker of a series, the colour is that of the compensation
                    ax.plot(entry["interval95"], [row + shift] * 2, color=colour(name), linewidth=1.4)
                    filled = {"markerfacecolor": colour(name) if marker == "o" else "white"}
                    ax.plot(entry["value"], row + shift, marker, color=colour(name), markersize=5.5, **filled)
            ax.plot([], [], marker, color=QUIET, label=text, **({} if marker == "o" else {"markerfacecolor": "white"}))
        for row, name in enumerate(names):
            value = printed.get(unit, {}).get(name)
            if value is not None:
                style = {"color": ACCENT, "markeredgecolor": "white", "markersize": 7.5}
                ax.plot(value, row, "D", label=f"{PRINTED}, Table 4", zorder=1.5, **style)
        ax.set_xscale("log")
        ax.xaxis.set_major_locator(FixedLocator(TABLE4_TICKS))
        ax.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        ax.xaxis.set_minor_locator(NullLocator())
        ax.set(xlabel="sensitivity [ppm/°C]", title=unit)
        ax.grid(axis="y", visible=False)
    panels[0, 0].set_yticks(range(len(names)), [label(name) for name in names])
    panels[0, 0].set_ylim(len(names) - 0.5, -0.5)
    panels[0, 0].set_ylabel("compensation")
    legend_below(figure, *panels[0])
    return figure


def _by_branch(
    units: Mapping[str, Columns], key: str, axis: str, apart: str, relative: bool, title: str, note: str
) -> Figure:
    """Falling and rising branch of every unit above, their difference below."""
    grid = {"rows": 2, "columns": len(units), "height_ratios": [3, 1.7], "squeeze": False}
    figure, (above, below) = sheet(4.9, title, note, sharex=True, sharey=False if relative else "row", **grid)
    for upper, lower, (name, unit), letter in zip(above, below, units.items(), "abcdef", strict=False):
        per_ppm = float(np.mean(unit[key])) * 1e-6 if relative else 1.0
        ramps = np.unique(unit["ramp_c_per_min"])
        for ramp in ramps:
            seen = unit["ramp_c_per_min"] == ramp
            branches = {}
            for text, sign, tint in (("temperature falling", -1, FALLING), ("temperature rising", 1, RISING)):
                on = seen & (np.sign(unit["rate_c_per_min"]) == sign)
                branches[sign] = degree, mean = _by_degree(unit["temperature_c"][on], unit[key][on])
                upper.plot(degree, mean, color=tint, linewidth=0.9, label=text)
            shared, i, j = np.intersect1d(branches[-1][0], branches[1][0], return_indices=True)
            shade = LOOPS[np.searchsorted(ramps, ramp) % len(LOOPS)]
            difference = (branches[-1][1][i] - branches[1][1][j]) / per_ppm
            lower.plot(shared, difference, color=shade, linewidth=0.9, label=f"{ramp:g} °C/min")
        lower.axhline(0.0, color=QUIET, linewidth=0.6, zorder=1)
        upper.set_title(f"{letter}: {name}", loc="left")
        upper.yaxis.set_major_formatter(StrMethodFormatter("{x:.0f}"))
        lower.set_xlabel("temperature [°C]")
    above[0].set_ylabel(axis)
    below[0].set_ylabel(apart)
    legend_below(figure, *above, *below, columns=6)
    return figure


def _by_degree(temperature_c: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Means over each whole degree that was read, in order of temperature."""
    degree, which = np.unique(np.round(temperature_c), return_inverse=True)
    return degree, np.bincount(which, weights=values) / np.bincount(which)


def _left_ppm(unit: Columns, model: np.ndarray) -> np.ndarray:
    """What a model leaves of K1, (n,) in ppm."""
    return 1e6 * (np.asarray(unit["scale"]) / np.asarray(model) - 1.0)


def _one_after_the_other(unit: Columns) -> tuple[np.ndarray, list[float]]:
    """Time in h (n,) over the rates in their order, and the start of each."""
    time_h, starts, end = np.empty(unit["elapsed_s"].size), [], 0.0
    for ramp in dict.fromkeys(unit["ramp_c_per_min"].tolist()):
        seen = unit["ramp_c_per_min"] == ramp
        elapsed_h = unit["elapsed_s"][seen] / 3600.0
        time_h[seen] = end + elapsed_h - elapsed_h[0]
        starts.append(end)
        end = float(time_h[seen][-1])
    return time_h, starts


def _thinned(x: np.ndarray, y: np.ndarray, limit: int = 600) -> tuple[np.ndarray, np.ndarray]:
    """Every k-th point of a curve that is no function of x, and its last."""
    every = max(1, len(x) // limit)
    return np.append(np.asarray(x)[::every], x[-1]), np.append(np.asarray(y)[::every], y[-1])


def _arrow(ax: Axes, x: np.ndarray, y: np.ndarray, tint: str) -> None:
    """An arrow with a word in the middle of one branch of a loop."""
    k, falling = x.size // 2, x[-1] < x[0]
    ahead = k + max(1, x.size // 20)
    ax.annotate("", (x[ahead], y[ahead]), (x[k], y[k]), arrowprops={"arrowstyle": "-|>", "color": tint})
    place = {"xytext": (0, 6 if falling else -6), "textcoords": "offset points", "ha": "center"}
    text = "falling" if falling else "rising"
    ax.annotate(text, (x[k], y[k]), va="bottom" if falling else "top", color=QUIET, fontsize=8.5, **place)
