"""Figures 9 and 10 of Paper A with its axes, and our distributions beside its tables of the oven."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, MultipleLocator, NullFormatter, NullLocator, StrMethodFormatter

from ins_eval.figures.style import (
    ACCENT,
    INK,
    QUIET,
    colour,
    decimate,
    in_order,
    label,
    legend_below,
    sheet,
    styled,
)

Statistic = Mapping[str, Any]  # {"value": float, "interval95": [low, high]}
PRINTED = "Paper A"
CASES = {"given": "true attitude given", "aligned": "self-aligned"}
PAIR = ("simple", "hysteresis_refined")
OVEN_TIME = "time since start of navigation [s]"


@styled
def oven_velocity_error(
    *,
    time_s: np.ndarray,
    east_mps: Mapping[str, np.ndarray],
    north_mps: Mapping[str, np.ndarray],
    best: int,
    case: str = "given",
) -> Figure:
    """Fig. 9a/b: errors of all runs, name -> (runs, m) at `time_s` (m,); run number `best` is drawn thick."""
    return _oven_runs(
        time_s,
        {"east velocity error [m/s]": east_mps, "north velocity error [m/s]": north_mps},
        best,
        case,
        "Velocity error in the oven",
    )


@styled
def oven_position_error(
    *,
    time_s: np.ndarray,
    longitude_arcmin: Mapping[str, np.ndarray],
    latitude_arcmin: Mapping[str, np.ndarray],
    best: int,
    case: str = "given",
) -> Figure:
    """Fig. 10a/b: errors of all runs, name -> (runs, m) at `time_s` (m,); run number `best` is drawn thick."""
    return _oven_runs(
        time_s,
        {"longitude error [arc-minute]": longitude_arcmin, "latitude error [arc-minute]": latitude_arcmin},
        best,
        case,
        "Position error in the oven",
    )


@styled
def oven_runs(
    *,
    rms_mps: Mapping[str, Mapping[str, Mapping[str, np.ndarray]]],
    best: Mapping[str, int],
    printed_mps: Mapping[str, Mapping[str, float]] | None = None,
) -> Figure:
    """Velocity RMS of each run of one instrument: case -> compensation -> "east"/"north" -> (runs,).

    A row a case of alignment; `best` case -> number of the best run; `printed_mps` compensation -> component.
    """
    note = (
        "One instrument, every run a switch-on of its own. A line joins the two compensations of one run; shaded: the "
        "run that gains most. Dashed: Table 6 of Paper A, “one of the best” of ten."
    )
    components = ("east", "north")
    figure, panels = sheet(
        1.5 + 1.75 * len(rms_mps),
        "Ten runs in the oven",
        note,
        rows=len(rms_mps),
        columns=2,
        sharex=True,
        sharey=True,
        squeeze=False,
    )
    for row, (case, arms) in zip(panels, rms_mps.items(), strict=True):
        for ax, component in zip(row, components, strict=True):
            both = [np.asarray(arms[name][component], dtype=float) for name in PAIR]
            run = np.arange(1, both[0].size + 1)
            ax.axvspan(best[case] + 0.55, best[case] + 1.45, color="#f2f2f2", linewidth=0, label="best run")
            ax.vlines(run, *both, color=QUIET, linewidth=0.9)
            for name, values in zip(PAIR, both, strict=True):
                ax.plot(run, values, "o", color=colour(name), markersize=5, label=label(name))
                value = (printed_mps or {}).get(name, {}).get(component)
                if value is not None:
                    text = f"{PRINTED}, {label(name)}"
                    ax.axhline(value, color=colour(name), linestyle=(0, (4, 2)), linewidth=1.0, label=text)
            ax.set_title(f"{component}, {CASES.get(case, case)}")
            ax.xaxis.set_major_locator(MultipleLocator(1))
            ax.grid(axis="x", visible=False)
        row[0].set_ylabel("velocity RMS [m/s]")
    panels[0, 0].set_ylim(bottom=0.0)  # of all, once all is drawn
    for ax in panels[-1]:
        ax.set_xlabel("run [number]")
    legend_below(figure, *panels.ravel(), columns=5)
    return figure


@styled
def best_of_ten(
    *, ratios: Mapping[str, np.ndarray], printed: Mapping[str, float] | None = None, case: str = "given"
) -> Figure:
    """Ratio hysteresis refined / simple of every run, component -> (instruments, runs); the best: least horizontal.

    `ratios` holds "horizontal", by which the best run is chosen in every panel; `printed` component -> ratio.
    """
    instruments, runs = np.shape(ratios["horizontal"])
    chosen = np.argmin(ratios["horizontal"], axis=1)
    note = (
        f"Cumulative share of {instruments} instruments, {CASES.get(case, case)}. Grey: any one of {runs} runs; red: "
        "of each instrument only the run with the smallest horizontal ratio. Below 1 is better; shaded: worse."
    )
    figure, panels = sheet(
        3.6, "What the best of ten runs shows", note, columns=len(ratios), sharey=True, squeeze=False
    )
    ticks = (0.2, 0.5, 1.0, 2.0, 5.0)
    for ax, (component, values) in zip(panels[0], ratios.items(), strict=True):
        values = np.asarray(values, dtype=float)
        ax.axvspan(1.0, ticks[-1], color="#f5f5f5", linewidth=0, zorder=0.2)
        ax.axvline(1.0, color=QUIET, linewidth=0.8)
        for seen, style, text in (
            (values.ravel(), {"color": QUIET}, "any run"),
            (values[np.arange(instruments), chosen], {"color": colour(PAIR[1])}, f"best of {runs}"),
        ):
            ordered = np.sort(np.clip(seen, 0.1, ticks[-1]))
            share = np.arange(1, ordered.size + 1) / ordered.size
            ax.step(*_evenly(ordered, share), where="post", linewidth=1.4, label=text, **style)
            ax.plot(np.median(seen), 0.5, "o", markersize=5, **style)
        if printed and component in printed:
            ax.axvline(printed[component], color=ACCENT, linestyle="--", linewidth=1.2, label=f"{PRINTED}, Table 6")
        ax.set_xscale("log")
        ax.set_xlim(ticks[0], ticks[-1])
        ax.xaxis.set_major_locator(FixedLocator(ticks))
        ax.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        ax.xaxis.set_minor_formatter(NullFormatter())
        ax.set(xlabel="ratio [1]", title=component, ylim=(0.0, 1.0))
    panels[0, 0].set_ylabel("share [1]")
    legend_below(figure, *panels[0])
    return figure


@styled
def refinement(
    *,
    rms_mps: Mapping[str, Mapping[str, Mapping[str, Statistic]]],
    unrefined_mps: Mapping[str, Statistic] | None = None,
    size: int | None = None,
) -> Figure:
    """Horizontal velocity RMS in further oven runs: case -> "refined" or "free" -> number of runs -> statistic.

    "free": with a constant of its own for each refinement run; `unrefined_mps` case -> statistic, drawn at 0 runs.
    """
    note = "RMS over oven runs that were not used for the refinement"
    note += (f", of {size} instruments" if size else "") + ". Vertical lines: 95 % interval."
    figure, panels = sheet(
        3.4, "How many oven runs refine the hysteresis model", note, columns=len(rms_mps), sharey=True, squeeze=False
    )
    looks = {
        "refined": (colour(PAIR[1]), 0.0, "refined, one constant over all runs"),
        "free": (INK, 0.08, "refined, a constant for each run"),
    }
    for ax, (case, kinds) in zip(panels[0], rms_mps.items(), strict=True):
        for kind, entries in kinds.items():
            tint, shift, text = looks[kind]
            numbers = sorted(entries, key=int)
            at = [int(n) + shift for n in numbers]
            ax.plot(at, [entries[n]["value"] for n in numbers], color=tint, linewidth=1.0, zorder=2)
            _statistics(ax, at, [entries[n] for n in numbers], tint, text)
        if unrefined_mps and case in unrefined_mps:
            _statistics(ax, [0], [unrefined_mps[case]], colour("hysteresis"), "from the chamber alone")
        ax.set(xlabel="oven runs for the refinement [number]", title=CASES.get(case, case))
        ax.xaxis.set_major_locator(MultipleLocator(1))
    panels[0, 0].set_ylabel("horizontal RMS [m/s]")
    panels[0, 0].set_ylim(bottom=0.0)  # of all, once all is drawn
    legend_below(figure, *panels[0])
    return figure


@styled
def sensitivity(*, cases: Mapping[str, Mapping[str, Any]]) -> Figure:
    """One assumption changed at a time: case -> `words`, `against_base` (name -> statistic of a ratio), `ratio`.

    Left: how each compensation's error changes against the base; right: hysteresis refined / simple in that case.
    The case "base", where there is one, comes first and is marked on the right by a line.
    """
    note = (
        "Ratios of the horizontal velocity RMS with 95 % interval. Left: with the changed assumption to without. "
        "Right: hysteresis, refined to simple under that assumption; below 1 it helps; band: the base."
    )
    names = sorted(cases, key=lambda name: (name != "base", -_reach(cases[name])))
    figure, (moved, gain) = sheet(
        1.9 + 0.28 * len(names),
        "Sensitivity to what the paper does not say",
        note,
        columns=2,
        sharey=True,
        width_ratios=[5, 4],
    )
    for k, arm in enumerate(PAIR):
        rows = [(row, (cases[name].get("against_base") or {}).get(arm)) for row, name in enumerate(names)]
        rows = [(row + 0.15 * (2 * k - 1), entry) for row, entry in rows if entry]
        _statistics_in_rows(moved, rows, colour(arm), label(arm))
    rows = [(row, cases[name].get("ratio")) for row, name in enumerate(names)]
    _statistics_in_rows(gain, [(row, entry) for row, entry in rows if entry], INK, "hysteresis, refined / simple")
    if (base := (cases.get("base") or {}).get("ratio")) is not None:
        gain.axvspan(*base["interval95"], color="#ececec", linewidth=0, zorder=0.3)
    for ax, text in ((moved, "error against the base [1]"), (gain, "hysteresis, refined / simple [1]")):
        ax.axvline(1.0, color=QUIET, linewidth=0.8)
        ax.set_xscale("log")
        low, high = ax.get_xlim()
        ticks = [t for t in (0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 5.0) if low <= t <= high]
        ax.xaxis.set_major_locator(FixedLocator(ticks))
        ax.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        ax.xaxis.set_minor_locator(NullLocator())
        ax.set_xlabel(text)
    words = [str(cases[name].get("words", name)) if name != "base" else "base" for name in names]
    moved.set_yticks(range(len(names)), [textwrap.fill(text, 46) for text in words], fontsize=8.0)
    moved.set_ylim(len(names) - 0.5, -0.5)
    legend_below(figure, moved, gain)
    return figure


def _oven_runs(
    time_s: np.ndarray, panels: Mapping[str, Mapping[str, np.ndarray]], best: int, case: str, title: str
) -> Figure:
    """Two panels of all runs of one instrument, the best thick on top of the others."""
    runs = len(next(iter(next(iter(panels.values())).values())))
    note = (
        f"One instrument in the oven with the temperatures of the flight, {CASES.get(case, case)}. Thick: the best of "
        f"{runs} runs, as the paper shows; thin: the other {runs - 1}."
    )
    figure, axes = sheet(5.4, title, note, rows=2, sharex=True)
    for ax, (text, arms), letter in zip(axes, panels.items(), "ab", strict=True):
        for name in in_order(arms):
            others = np.delete(np.asarray(arms[name], dtype=float), best, axis=0)
            for k, run in enumerate(others):
                thin = {"linewidth": 0.6, "alpha": 0.35, "label": f"{label(name)}, other runs" if k == 0 else "_"}
                ax.plot(*decimate(time_s, run, 150), color=colour(name), zorder=2, **thin)
        for name in in_order(arms):
            ax.plot(
                *decimate(time_s, np.asarray(arms[name])[best], 600),
                color=colour(name),
                linewidth=1.8,
                zorder=3,
                label=f"{label(name)}, best run",
            )
        ax.axhline(0.0, color=QUIET, linewidth=0.6, zorder=1)
        ax.set_ylabel(text)
        ax.set_title(letter, loc="left")
    axes[-1].set_xlabel(OVEN_TIME)
    axes[-1].set_xlim(float(time_s[0]), float(time_s[-1]))
    legend_below(figure, *axes)
    return figure


def _evenly(x: np.ndarray, y: np.ndarray, limit: int = 300) -> tuple[np.ndarray, np.ndarray]:
    """At most `limit` points of a cumulative curve, both ends among them."""
    keep = np.unique(np.linspace(0, x.size - 1, min(limit, x.size)).round().astype(int))
    return x[keep], y[keep]


def _statistics(ax: Axes, x: Sequence[float], entries: Sequence[Statistic], tint: str, text: str) -> None:
    """Values over x with their vertical intervals."""
    for at, entry in zip(x, entries, strict=True):
        ax.plot([at, at], entry["interval95"], color=tint, linewidth=1.4)
    ax.plot(x, [entry["value"] for entry in entries], "o", color=tint, markersize=5.5, label=text)


def _statistics_in_rows(ax: Axes, rows: Sequence[tuple[float, Statistic]], tint: str, text: str) -> None:
    """Values in rows with their horizontal intervals."""
    for row, entry in rows:
        ax.plot(entry["interval95"], [row, row], color=tint, linewidth=1.2)
    if rows:
        values = [entry["value"] for _, entry in rows]
        ax.plot(values, [row for row, _ in rows], "o", color=tint, markersize=4.5, label=text)


def _reach(case: Mapping[str, Any]) -> float:
    """How far a case moves either compensation, as |ln ratio|, for the order of the rows."""
    moved = [entry["value"] for entry in (case.get("against_base") or {}).values()]
    return max((abs(np.log(value)) for value in moved if value > 0.0), default=0.0)
