"""A diagnosis in pictures: the whitened residual and what was located in it, evidence, effect and drive, the gain."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill

import numpy as np
from matplotlib.figure import Figure

from ins_eval.diagnosis.answer.summary import block_means
from ins_eval.figures.style import INK, QUIET, legend_below, shade, sheet, styled
from ins_eval.vocabulary import CHANNELS_MEASURED
from ins_eval.wording import fixed

LOCATED, LOCATED_TINT = "#d95f02", "#fdeee1"
FOUND = "#12508f"
BAND = 2.0  # sigmas
LABEL_WIDTH, QUANTITY_WIDTH = 14, 26  # letters along the height of a low and of a high panel
LEAST_GAIN = 0.05  # of that of the channel that changes most, for a channel to be drawn


@styled
def whitened_residuals(
    *,
    time_s: np.ndarray,
    innovations: np.ndarray,
    located: Sequence[tuple[float, float, str]],
    block_s: float,
    channels: Sequence[str] = CHANNELS_MEASURED,
    title: str = "Whitened residuals",
) -> Figure:
    """Means of the whitened residual (n, 9) over `block_s`, in their own sigma; `located` has start, end, channel."""
    shown = [k for k in range(innovations.shape[1]) if np.isfinite(innovations[:, k]).any()]
    note = (
        f"Means over {block_s:g} s divided by their sigma: 95 % lie within the band where the belief and the noise "
        "found account for the recording." + (" Below: what was located." if located else "")
    )
    count = len(shown) + bool(located)
    heights = [1.0] * len(shown) + ([0.4 + 0.28 * len(located)] if located else [])
    figure, panels = sheet(
        1.2 + 1.05 * sum(heights), title, note, rows=count, sharex=True, squeeze=False, height_ratios=heights
    )
    for k, ax in zip(shown, panels[:, 0], strict=False):
        t, mean = block_means(time_s, innovations[:, k], block_s)
        ax.axhspan(-BAND, BAND, color="#ececec", linewidth=0, zorder=0.2, label="95 % of a white residual")
        shade(ax, [(start, end) for start, end, _ in located], "located", color=LOCATED_TINT)
        ax.plot(t, mean, color=INK, linewidth=0.8, label="whitened residual")
        ax.axhline(0.0, color=QUIET, linewidth=0.5)
        ax.set_ylabel(fill(channels[k], LABEL_WIDTH))
        ax.set_ylim(min(-4.0, np.nanmin(mean) * 1.1), max(4.0, np.nanmax(mean) * 1.1))
    if located:
        ax = panels[-1, 0]
        for row, (start, end, _) in enumerate(located):
            ax.barh(row, end - start, left=start, height=0.55, color=LOCATED, label="located")
        ax.set_yticks(range(len(located)), [channel for _, _, channel in located], fontsize=7.5)
        ax.set_ylim(len(located) - 0.5, -0.5)
        ax.set_ylabel("located")
        ax.grid(axis="y", visible=False)
    panels[-1, 0].set_xlabel("time in the recording [s]")
    legend_below(figure, *panels[:, 0])
    return figure


@styled
def evidence_of_effects(
    *,
    names: Sequence[str],
    log_bayes_factors: Sequence[float],
    named: Sequence[bool],
    threshold: float,
    title: str = "Evidence of each effect",
    where: str = "",
) -> Figure:
    """Log Bayes factor of each of `names`, best first, against none in its place; an effect must reach `threshold`."""
    note = (
        f"Log Bayes factor in nats{where}, its prior over sizes and times integrated out; 3 nats are odds of 20. An "
        f"effect has to gain {threshold:.1f} nats, the price of choosing among all that were tried."
    )
    figure, ax = sheet(1.5 + 0.27 * len(names), title, note)
    rows = np.arange(len(names))
    values = np.asarray(log_bayes_factors, dtype=float)
    for chosen, colour, text in ((True, LOCATED, "in the answer"), (False, "#9ab3c8", "not in the answer")):
        here = np.asarray(named) == chosen
        if here.any():
            ax.barh(rows[here], values[here], height=0.62, color=colour, label=text)
    ax.axvline(threshold, color=INK, linewidth=0.9, linestyle="--", label="threshold of an effect")
    low, high = min(0.0, values.min()), max(values.max(), threshold)
    ax.set_xlim(low - 0.02 * (high - low), high + 0.12 * (high - low))
    for row, value in zip(rows, values, strict=True):
        ax.text(max(value, 0.0) + 0.01 * (high - low), row, _nats(value), va="center", fontsize=8.0, color=INK)
    ax.set_yticks(rows, list(names))
    ax.set_ylim(len(names) - 0.4, -0.6)
    ax.grid(axis="y", visible=False)
    ax.set_xlabel("log Bayes factor [nats]")
    legend_below(figure, ax)
    return figure


@styled
def effect_against_drive(
    *,
    time_s: np.ndarray,
    mean: np.ndarray,
    sigma: np.ndarray,
    effect: np.ndarray,
    drive: tuple[str, np.ndarray] | None,
    quantity: str,
    located: Sequence[tuple[float, float]] = (),
    title: str = "The effect against its drive",
) -> Figure:
    """What is wrong in one channel, (windows,) with its `sigma`, over time and over the `drive`; `effect` drawn in.

    `drive` is the label of its axis with its values (windows,), `quantity` a label, "channel [unit]". An `effect` of
    NaN is not drawn; without a `drive` there is no second panel. `located` has the intervals, in s, in which this
    channel was located.
    """
    explained = bool(np.isfinite(effect).any())
    note = (
        "Dots: error of this channel estimated in each window without a model, as a slow disturbance of any form, with "
        "its 95 % band; everything else is at its best value."
        + (
            " Line: the effect as it was found. Where it is right, the dots lie along it."
            if explained
            else " The noise is held at or below the believed level, since the error would inflate it."
        )
    )
    beside = fill(quantity, QUANTITY_WIDTH)
    figure, panels = sheet(5.9 if drive else 3.4, title, note, rows=2 if drive else 1, squeeze=False)
    top = panels[0, 0]
    shade(top, located, "located", color=LOCATED_TINT)
    top.fill_between(time_s, mean - BAND * sigma, mean + BAND * sigma, color="#dce6ee", linewidth=0, label="95 %")
    top.plot(time_s, mean, "o", color=FOUND, markersize=3.2, label="estimated without a model")
    top.axhline(0.0, color=QUIET, linewidth=0.5)
    if explained:
        top.plot(time_s, effect, color=LOCATED, linewidth=1.6, label="the effect")
    top.set_xlabel("time in the recording [s]")
    top.set_ylabel(beside)
    if drive:
        ax, (name, values) = panels[1, 0], drive
        ax.plot(values, mean, color="#b9cbd9", linewidth=0.7, label="in the order of time")
        ax.errorbar(
            values, mean, BAND * sigma, fmt="o", color=FOUND, ecolor="#b9cbd9", elinewidth=0.9, markersize=3.2,
            label="estimated without a model",
        )  # fmt: skip
        ax.axhline(0.0, color=QUIET, linewidth=0.5)
        if explained:
            order = np.argsort(values)
            ax.plot(values[order], effect[order], color=LOCATED, linewidth=1.6, label="the effect")
        ax.set_xlabel(name)
        ax.set_ylabel(beside)
    legend_below(figure, *panels[:, 0])
    return figure


@styled
def before_and_after(
    *,
    time_s: np.ndarray,
    before: np.ndarray,
    after: np.ndarray,
    block_s: float,
    channels: Sequence[str] = CHANNELS_MEASURED,
    most: int = 4,
    located: Sequence[tuple[float, float]] = (),
    title: str = "Before and after",
) -> Figure:
    """Means of the whitened residual over `block_s` without and with the effects, (n, 9) each, one noise for both.

    Of the channels that change most, at most `most`. `located` has the intervals, in s, that an answer names.
    """
    shown = [k for k in range(before.shape[1]) if np.isfinite(before[:, k]).any()]
    means = {k: [block_means(time_s, of[:, k], block_s) for of in (before, after)] for k in shown}
    gain = {k: float(np.nansum(means[k][0][1] ** 2) - np.nansum(means[k][1][1] ** 2)) for k in shown}
    shown = sorted(shown, key=lambda k: -gain[k])[:most]
    shown = sorted(k for k in shown if k == shown[0] or gain[k] > LEAST_GAIN * gain[shown[0]])
    note = (
        f"Means over {block_s:g} s of the whitened residual divided by their sigma, without and with the effects; the "
        "noise is the same for both. Within the band lie 95 % of what nothing is wrong with."
    )
    figure, panels = sheet(1.2 + 1.35 * len(shown), title, note, rows=len(shown), sharex=True, squeeze=False)
    for k, ax in zip(shown, panels[:, 0], strict=True):
        (t, old), (_, new) = means[k]
        ax.axhspan(-BAND, BAND, color="#ececec", linewidth=0, zorder=0.2, label="95 % of a white residual")
        shade(ax, located, "located", color=LOCATED_TINT)
        ax.plot(t, old, color=LOCATED, linewidth=0.9, label="before")
        ax.plot(t, new, color=INK, linewidth=0.9, label="after")
        ax.axhline(0.0, color=QUIET, linewidth=0.5)
        ax.set_ylabel(fill(channels[k], LABEL_WIDTH))
        low, high = np.nanmin([old, new]), np.nanmax([old, new])
        ax.set_ylim(min(-4.0, 1.1 * low), max(4.0, 1.1 * high))
    panels[-1, 0].set_xlabel("time in the recording [s]")
    legend_below(figure, *panels[:, 0])
    return figure


def _nats(value: float) -> str:
    if abs(value) >= 1e6:
        return f"{value:.2e}"
    return fixed(value, 1 if abs(value) < 1000.0 else 0)
