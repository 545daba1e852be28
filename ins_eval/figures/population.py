"""Many instruments: intervals, distributions and where a published value lies among them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullFormatter, StrMethodFormatter

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
from ins_eval.units import NMI
from ins_eval.vocabulary import PAPER_ARM, definition_name, measure_name, source_name
from ins_eval.wording import joined

Statistic = Mapping[str, Any]  # {"value": float, "interval95": [low, high]}

RATIO_TICKS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)
RATIO_RANGE = (0.1, 5.0)


@styled
def cep_over_time(
    *,
    time_s: np.ndarray,
    cep_m: Mapping[str, np.ndarray],
    band_m: Mapping[str, np.ndarray],
    size: int,
    title: str = "Circular error probable over time",
) -> Figure:
    """CEP(t) = median over instruments of the radial error, name -> (k,) in m, with its 95 % band, name -> (k, 2)."""
    note = (
        f"CEP(t): median over {size} instruments of the horizontal radial error at time t, about the true position. "
        "Band: 95 % bootstrap interval of the median."
    )
    figure, ax = sheet(3.9, title, note)
    for name in in_order(cep_m):
        if name in band_m:
            band = np.asarray(band_m[name]) / NMI
            t, low = decimate(time_s, band[:, 0], 300)
            high = np.interp(t, time_s, band[:, 1])
            ax.fill_between(t, low, high, color=colour(name), alpha=0.18, linewidth=0)
        ax.plot(
            *decimate(time_s, np.asarray(cep_m[name]) / NMI, 400), color=colour(name), linewidth=1.4, label=label(name)
        )
    ax.set(xlabel="time since start of navigation [s]", ylabel="CEP [nmi]")
    ax.set_xlim(float(time_s[0]), float(time_s[-1]))
    ax.set_ylim(bottom=0.0)
    right = ax.secondary_yaxis("right", functions=(lambda y: y * NMI / 1000.0, lambda y: y * 1000.0 / NMI))
    right.set_ylabel("[km]")
    legend_below(figure, ax)
    return figure


@styled
def missions_by_temperature(*, warmer_c: np.ndarray, ratios: Mapping[str, np.ndarray], turns: np.ndarray) -> Figure:
    """Ratio to simple compensation of the velocity RMS of each mission, one panel a compensation (-> (n,) ratios).

    Against `warmer_c` (n,), how much warmer the IMU was than in the oven run; marked by the number of `turns` (n,).
    """
    note = (
        f"Horizontal velocity RMS of each of {warmer_c.size} missions over that of the same mission with simple "
        "compensation. Below 1 is better; the shaded side is worse. Line: geometric mean of neighbouring missions."
    )
    figure, panels = sheet(
        3.9, "Each mission: does a compensation help there?", note, columns=len(ratios), sharey=True, squeeze=False
    )
    kinds = {"at most 2 turns": turns < 3, "3 to 5 turns": (turns >= 3) & (turns < 6), "6 turns or more": turns >= 6}
    for ax, (name, values) in zip(panels[0], ratios.items(), strict=True):
        shown = np.clip(values, *RATIO_RANGE)
        ax.axhspan(1.0, RATIO_RANGE[1], color="#f5f5f5", linewidth=0, zorder=0.2)
        ax.axhline(1.0, color=QUIET, linewidth=0.8)
        for (words, inside), marker in zip(kinds.items(), "osd", strict=True):
            ax.plot(
                warmer_c[inside], shown[inside], marker, markersize=3.5, color=colour(name), alpha=0.6, label=words,
                markerfacecolor="none" if marker == "o" else colour(name),
            )  # fmt: skip
        parts = np.array_split(np.argsort(warmer_c), max(2, min(10, warmer_c.size // 10)))
        middle = [float(np.mean(warmer_c[part])) for part in parts]
        ax.plot(middle, [float(np.exp(np.mean(np.log(values[part])))) for part in parts], color=INK, linewidth=1.4)
        ax.set_yscale("log")
        ax.set_ylim(*RATIO_RANGE)
        ax.yaxis.set_major_locator(FixedLocator(RATIO_TICKS))
        ax.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        ax.yaxis.set_minor_formatter(NullFormatter())
        ax.set(xlabel="IMU warmer than in the oven run [°C]", title=label(name))
    panels[0, 0].set_ylabel("ratio to simple [1]")
    legend_below(figure, panels[0, 0])
    return figure


@styled
def improvement_per_instrument(
    *,
    ratios: Mapping[str, Mapping[str, np.ndarray]],
    fraction_improved: Mapping[str, Mapping[str, Statistic]] | None = None,
) -> Figure:
    """Distribution over instruments of ratios: pair "new/old" -> measure -> (n,), one panel a measure.

    Left of 1 the instrument became better.
    """
    measures = list(next(iter(ratios.values())))
    size = len(ratios[next(iter(ratios))][measures[0]])
    words = {pair: " / ".join(map(label, pair.split("/"))) for pair in ratios}
    note = (
        f"Ratio {joined(list(words.values()))} of each of {size} paired instruments: cumulative share of instruments "
        "at or below a ratio. Below 1 is better; the shaded side is worse."
    )
    figure, panels = sheet(
        3.9, "Improvement of each instrument on its one flight", note, columns=len(measures), sharey=True, squeeze=False
    )
    for ax, measure in zip(panels[0], measures, strict=True):
        for k, (pair, of_pair) in enumerate(ratios.items()):
            shade = colour(pair.partition("/")[0] if len(ratios) == 1 else pair.partition("/")[2])
            values = np.sort(np.asarray(of_pair[measure], dtype=float))
            share = np.arange(1, values.size + 1) / values.size
            curve = words[pair] if len(ratios) > 1 else "instruments"
            ax.step(np.clip(values, *RATIO_RANGE), share, where="post", color=shade, linewidth=1.4, label=curve)
            ends = np.clip(np.percentile(values, [5, 95]), *RATIO_RANGE)
            ax.plot(
                *(ends, [0.5 - 0.05 * k] * 2),
                color=QUIET if len(ratios) == 1 else shade,
                linewidth=1.0,
                marker="|",
                markersize=8,
                label="5 to 95 % of instruments" if k == 0 else "_",
            )
            text = f"{100 * float(np.mean(values < 1.0)):.0f} % improved"
            if interval := (fraction_improved or {}).get(pair, {}).get(measure):
                text = f"{100 * interval['value']:.0f} % improved\n[{_percent_range(interval['interval95'])}]"
            tint = INK if len(ratios) == 1 else shade
            ax.text(0.03, 0.97 - 0.15 * k, text, transform=ax.transAxes, va="top", ha="left", color=tint)
        ax.axvspan(1.0, RATIO_RANGE[1], color="#f5f5f5", linewidth=0, zorder=0.2)
        ax.axvline(1.0, color=QUIET, linewidth=0.8)
        ax.set_xscale("log")
        ax.set_xlim(*RATIO_RANGE)
        ax.xaxis.set_major_locator(FixedLocator(RATIO_TICKS))
        ax.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        ax.xaxis.set_minor_formatter(NullFormatter())
        ax.set(xlabel="ratio [1]", title=measure_name(measure), ylim=(0.0, 1.0))
    panels[0, 0].set_ylabel("share of instruments [1]")
    legend_below(figure, *panels[0])
    return figure


@styled
def error_budget(
    *,
    budget: Mapping[str, Mapping[str, Mapping[str, Statistic]]],
    measures: Sequence[str] = ("velocity_rms_horizontal", "cep_rate_final"),
    size: int | None = None,
) -> Figure:
    """Bars of `budget[source][compensation][measure]` with 95 % intervals; entries that are no mapping are skipped."""
    sources = [source for source, arms in budget.items() if isinstance(arms, Mapping)]
    arms = in_order({name for source in sources for name in budget[source]})
    of = f" of {size} instruments" if size else ""
    note = (
        f"Ensemble{of} in which one source of error acts and all others are off. Bars: value; lines: 95 % interval. "
        "Sources add in quadrature in the velocity RMS, not in the CEP rate."
    )
    height = 1.7 + 0.17 * len(sources) * (len(arms) + 1)
    figure, panels = sheet(
        height, "Error budget: each source alone", note, columns=len(measures), sharey=True, squeeze=False
    )
    thickness = 0.8 / max(len(arms), 1)
    for ax, measure in zip(panels[0], measures, strict=True):
        for k, name in enumerate(arms):
            rows = [(row, budget[source].get(name, {}).get(measure)) for row, source in enumerate(sources)]
            rows = [(row, entry) for row, entry in rows if entry]
            if not rows:
                continue
            y = np.array([row + (k - (len(arms) - 1) / 2) * thickness for row, _ in rows])
            value = np.array([entry["value"] for _, entry in rows])
            ax.barh(y, value, height=0.9 * thickness, color=colour(name), label=label(name))
            _intervals(ax, value, y, [entry.get("interval95") for _, entry in rows])
        ax.set_xlabel(_axis_label(measure))
        ax.set_xlim(left=0.0)
        ax.grid(axis="y", visible=False)
    panels[0, 0].set_yticks(range(len(sources)), [source_name(s) for s in sources])
    panels[0, 0].set_ylabel("source of error")
    panels[0, 0].invert_yaxis()
    legend_below(figure, *panels[0], columns=3)
    return figure


@styled
def velocity_rms_by_compensation(
    *,
    rms_mps: Mapping[str, Mapping[str, Statistic]],
    paper_mps: Mapping[str, Mapping[str, float]] | None = None,
    size: int | None = None,
    components: Sequence[str] = ("east", "north"),
) -> Figure:
    """Velocity RMS `rms_mps[name][component]` with 95 % intervals, beside the published `paper_mps[arm][component]`."""
    names = in_order(rms_mps)
    over = f" over {size} instruments" if size else " over instruments"
    note = f"RMS{over} of the RMS over each flight, outage epochs excluded. Lines: 95 % bootstrap interval."
    if paper_mps:
        note += " Diamonds: Paper A, Table 7 (one flight)."
    figure, panels = sheet(
        1.7 + 0.3 * len(names),
        "Velocity RMS of every compensation",
        note,
        columns=len(components),
        sharey=True,
        squeeze=False,
    )
    printed = {PAPER_ARM.get(arm, arm): values for arm, values in (paper_mps or {}).items()}
    for ax, component in zip(panels[0], components, strict=True):
        right = 0.0
        for row, name in enumerate(names):
            entry = rms_mps[name].get(component)
            if entry:
                ax.barh(row, entry["value"], height=0.62, color=colour(name))
                _intervals(ax, np.array([entry["value"]]), np.array([row]), [entry.get("interval95")])
                right = max(right, entry["value"], *(entry.get("interval95") or (0.0,)))
            if component in printed.get(name, {}):
                ax.plot(
                    printed[name][component],
                    row,
                    "D",
                    color=ACCENT,
                    markeredgecolor="white",
                    markersize=7,
                    label="Paper A, Table 7",
                )
                right = max(right, printed[name][component])
        for row, name in enumerate(names):
            if entry := rms_mps[name].get(component):
                edge = max(
                    entry["value"], *(entry.get("interval95") or (0.0,)), printed.get(name, {}).get(component, 0.0)
                )
                ax.text(edge + 0.04 * right, row, f"{entry['value']:.2f}", va="center", fontsize=8.5, color=QUIET)
        ax.set(xlabel=f"{component} velocity RMS [m/s]", title=component)
        ax.set_xlim(0.0, 1.18 * right if right else 1.0)
        ax.grid(axis="y", visible=False)
    panels[0, 0].set_yticks(range(len(names)), [label(name) for name in names])
    panels[0, 0].set_ylabel("compensation")
    panels[0, 0].invert_yaxis()
    legend_below(figure, *panels[0])
    return figure


@styled
def single_flight_rates(
    *,
    rates_nmi_per_h: Mapping[str, Mapping[str, np.ndarray]],
    paper_nmi_per_h: Mapping[str, float] | None = None,
) -> Figure:
    """Distribution over instruments of the single-flight radial error rate, definition -> name -> (n,), in nmi/h.

    `paper_nmi_per_h` "simple"/"hysteresis" -> the published number, a dashed line in that arm's colour.
    """
    size = len(next(iter(next(iter(rates_nmi_per_h.values())).values())))
    note = (
        f"Cumulative share of {size} single flights with a radial error rate at or below the abscissa, one panel a "
        f"definition. Dashed: the numbers Paper A prints as CEP for its one flight, definition not given."
    )
    figure, panels = sheet(
        3.7,
        "Where the published flight lies among ours",
        note,
        columns=len(rates_nmi_per_h),
        sharey=True,
        squeeze=False,
    )
    right = max(float(np.percentile(v, 99)) for arms in rates_nmi_per_h.values() for v in arms.values())
    for ax, (definition, arms) in zip(panels[0], rates_nmi_per_h.items(), strict=True):
        for name in in_order(arms):
            values = np.sort(np.asarray(arms[name], dtype=float))
            share = np.arange(1, values.size + 1) / values.size
            ax.step(values, share, where="post", color=colour(name), linewidth=1.4, label=label(name))
        for arm, value in (paper_nmi_per_h or {}).items():
            ax.axvline(
                value,
                color=colour(PAPER_ARM.get(arm, arm)),
                linestyle=(0, (4, 2)),
                linewidth=1.1,
                label=f"Paper A, {arm}: {value:.2f}",
            )
        ax.set(xlabel="rate [nmi/h]", title=definition_name(definition), ylim=(0.0, 1.0))
        ax.set_xlim(0.0, right)
    panels[0, 0].set_ylabel("share of flights [1]")
    legend_below(figure, *panels[0])
    return figure


def _intervals(ax: Axes, x: np.ndarray, y: np.ndarray, intervals: Sequence[Sequence[float] | None]) -> None:
    """Horizontal 95 % intervals [low, high] of values x in rows y; None is left out."""
    for value, row, interval in zip(x, y, intervals, strict=True):
        if interval is not None:
            ends = [min(interval[0], value), max(interval[1], value)]
            ax.plot(ends, [row, row], color="white", linewidth=2.2)  # so that the line shows on a dark bar
            ax.plot(ends, [row, row], color=INK, linewidth=1.0)


def _axis_label(measure: str) -> str:
    unit = "[m/s]" if measure.startswith("velocity") else "[nmi/h]"
    return f"{measure_name(measure)} {unit}"


def _percent_range(interval: Sequence[float]) -> str:
    return f"{100 * interval[0]:.0f}, {100 * interval[1]:.0f} %"
