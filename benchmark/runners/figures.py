"""Figures of the report on concealed effects."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from benchmark.scores.score import BANDS, SEEN, rate
from ins_eval.figures.style import FAINT, INK, QUIET, legend_below, sheet, styled

GOOD, BAD, ODD, NAMED = "#1b7837", "#b2182b", "#b8860b", "#12508f"
WORDS = (
    ("accelerometer", "acc."), ("temperature rate quadratic", "T'²"), ("temperature rate coupling", "T T'"),
    ("temperature quadratic", "T²"), ("temperature rate", "T'"), ("bias temperature", "bias T"),
    ("scale temperature", "scale T"), ("vibration rectification", "vibration"), ("misalignment", "misalign."),
    ("cross pendulous", "cross pend."), ("cross output", "cross out."), ("g sensitivity", "g-sensitivity"),
)  # fmt: skip
LEAST_ROWS = 8  # of a matrix, beside which the label of its axis has room
OTHER_AXIS, SILENT_WORDS = "right name, wrong axis", "no mismatch"


def short(name: str) -> str:
    """A name of the vocabulary in few letters; T' is dT/dt."""
    name = name.removeprefix("outside.").replace("_", " ").replace(".", " ")
    for long, brief in WORDS:
        name = name.replace(long, brief)
    return name


def outcome(record: dict) -> str:
    """What an answer says first, in the words of the confusion matrix."""
    if not record["heard"]:
        return record["verdict"]
    if not record["named"]:
        return "unexplained"
    first, target = record["named"][0], record["truth"][0]
    if first.split()[0] == target.split()[0]:
        return target.split()[0] if first == target else OTHER_AXIS
    if first.startswith("composed"):
        return "composed, right column" if record.get("right") else "composed"
    return first.split()[0]


@styled
def confusion(records: Sequence[dict], title: str, note: str, right: Sequence[str] = ()) -> Figure:
    """What was concealed (rows) against what was named first (columns); `right` are columns that are always right."""
    rows = sorted({one["truth"][0].split()[0] for one in records})
    seen = {outcome(one) for one in records}
    last = [name for name in ("composed, right column", "composed", OTHER_AXIS, "unexplained", SILENT_WORDS, "missing")
            if name in seen]  # fmt: skip
    columns = [name for name in rows if name in seen] + sorted(seen - set(rows) - set(last)) + last
    count = np.zeros((len(rows), len(columns)), dtype=int)
    for one in records:
        count[rows.index(one["truth"][0].split()[0]), columns.index(outcome(one))] += 1
    figure, ax = sheet(2.6 + 0.155 * max(len(rows), LEAST_ROWS), title, note)
    ax.grid(visible=False)
    for i, j in np.argwhere(count > 0):
        hit = rows[i] == columns[j] or columns[j] in right
        tone = GOOD if hit else QUIET if columns[j] in ("unexplained", SILENT_WORDS, "missing") else BAD
        ax.add_patch(_square(j, i, tone, min(1.0, 0.35 + 0.65 * count[i, j] / count[i].sum())))
        ax.text(j, i, count[i, j], ha="center", va="center", fontsize=6.5, color="white")
    ax.set_xticks(range(len(columns)), [short(one) for one in columns], rotation=90, fontsize=6.5)
    ax.set_yticks(range(len(rows)), [f"{short(one)} ({n})" for one, n in zip(rows, count.sum(axis=1), strict=True)],
                  fontsize=6.5)  # fmt: skip
    ax.set_xlim(-0.5, len(columns) - 0.5)
    ax.set_ylim(len(rows) - 0.5, -0.5)
    for k in range(len(rows)):
        ax.axhline(k + 0.5, color=FAINT, linewidth=0.3, zorder=0.1)
    for k in range(len(columns)):
        ax.axvline(k + 0.5, color=FAINT, linewidth=0.3, zorder=0.1)
    ax.tick_params(length=0)
    ax.set(xlabel="named first", ylabel="concealed (cases)")
    return figure


def _square(x: int, y: int, colour: str, strength: float):
    from matplotlib.patches import Rectangle

    return Rectangle((x - 0.46, y - 0.46), 0.92, 0.92, facecolor=colour, alpha=strength, linewidth=0)


@styled
def by_effect(records: Sequence[dict]) -> Figure:
    """Detected and named first, of each effect of the vocabulary where it can be seen, with exact intervals."""
    names = sorted({one["truth"][0].split()[0] for one in records})
    note = (
        f"Cases of one effect with D of at least {SEEN:g}; bars: exact 95 % intervals. Named first: name and axis; "
        "it counts also where one recording cannot separate the effect from a rival."
    )
    figure, ax = sheet(1.6 + 0.185 * len(names), "Detected and named first, by effect", note)
    for k, name in enumerate(names):
        here = [one for one in records if one["truth"][0].split()[0] == name]
        for shift, word, tone in ((-0.17, "heard", NAMED), (0.17, "first", GOOD)):
            found = rate(sum(one[word] for one in here), len(here))
            label = {"heard": "detected", "first": "named first"}[word] if k == 0 else None
            ax.plot(found["interval95"], [k + shift] * 2, color=tone, linewidth=0.8, alpha=0.6)
            ax.plot(found["rate"], k + shift, "o", color=tone, markersize=3.2, label=label)
    counts = [sum(one["truth"][0].split()[0] == name for one in records) for name in names]
    ax.set_yticks(range(len(names)), [f"{short(one)} ({n})" for one, n in zip(names, counts, strict=True)], fontsize=7)
    ax.set_ylim(len(names) - 0.4, -0.6)
    _percent(ax)
    legend_below(figure, ax)
    return figure


@styled
def by_band(records: Sequence[dict]) -> Figure:
    """Detected against the size of the effect, each kind of case by itself."""
    drawn = ("single", "limited", "pair", "triple", "four", "multi", "elsewhere", "unidentifiable", "outside")
    kinds = [kind for kind in drawn if any(one["kind"] == kind for one in records)]
    note = (
        "D: the realised log Bayes factor that the oracle finds for the concealed effect. Bars: exact 95 % "
        "intervals; small numbers: cases. The dashed line is the target for D of at least 16."
    )
    figure, ax = sheet(3.6, "Detected, by size of the effect", note)
    names = [name for _, _, name in BANDS]
    colours = (INK, NAMED, "#4a9bd4", GOOD, ODD, BAD, "#7b3fa0", "#8c8c8c", "#d95f9a")
    for k, kind in enumerate(kinds):
        for x, name in enumerate(names):
            here = [one for one in records if one["kind"] == kind and one["band"] == name]
            if not here:
                continue
            found, at = rate(sum(one["heard"] for one in here), len(here)), x + 0.1 * (k - 0.5 * (len(kinds) - 1))
            ax.plot([at] * 2, found["interval95"], color=colours[k], linewidth=0.9, alpha=0.6)
            ax.plot(at, found["rate"], "o", color=colours[k], markersize=4, label=kind)
            ax.text(at, -0.045, len(here), ha="center", va="top", fontsize=6.5, color=colours[k])
    ax.plot([len(names) - 1.45, len(names) - 0.55], [0.98] * 2, color=QUIET, linestyle="--", linewidth=0.8)
    ax.set_xticks(range(len(names)), [name.replace(">=", "≥").replace("<=", "≤") for name in names])
    ax.set_xlim(-0.5, len(names) - 0.5)
    ax.set_ylim(-0.12, 1.03)
    ax.set_yticks(np.linspace(0, 1, 6))
    ax.yaxis.set_major_formatter(PercentFormatter(1.0, symbol=" %"))
    ax.set_ylabel("detected")
    ax.grid(axis="x", visible=False)
    legend_below(figure, ax, columns=5)
    return figure


@styled
def calibration(bins: Sequence[dict]) -> Figure:
    """Stated probability of an explanation against how often it was the truth."""
    note = (
        "Every explanation that an answer names or lists, of detected cases with one effect of the vocabulary. On the "
        "line the stated probability is right; below it the answers are too confident. Bars: exact 95 % intervals."
    )
    figure, ax = sheet(4.0, "Stated probabilities and how often they came true", note)
    ax.plot([0, 1], [0, 1], color=QUIET, linewidth=0.8, linestyle="--")
    for k, one in enumerate(bins):
        ax.plot([one["stated"]] * 2, one["interval95"], color=NAMED, linewidth=1.0, alpha=0.6)
        ax.plot(one["stated"], one["rate"], "o", color=NAMED, markersize=5)
        right, low = one["stated"] > 0.5, -14 if k % 2 else -3  # neighbours lie close at the ends
        low = max(low, -3) if one["rate"] < 0.1 else low  # the numbers of the axis stand below
        ax.annotate(
            f"{one['hits']} of {one['count']}",
            (one["stated"], one["rate"]),
            xytext=(-6 if right else 6, low if right else -3),
            textcoords="offset points",
            ha="right" if right else "left",
            fontsize=7,
        )
    ax.set(xlabel="stated probability", ylabel="share that came true", xlim=(-0.03, 1.03), ylim=(-0.03, 1.05))
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_formatter(PercentFormatter(1.0, symbol=" %"))
    return figure


@styled
def oracle(records: Sequence[dict]) -> Figure:
    """Our gain of log evidence beside the oracle's, of each case."""
    note = (
        "Each case with effects of the vocabulary: log evidence gained by the named effects, against the D of an "
        "oracle that knows the effect. Answers that detect or name nothing are at 0."
    )
    figure, ax = sheet(4.6, "The oracle and diagnose", note)
    groups = (
        ("named, all of it", GOOD, "o", lambda one: one["all named"]),
        ("truth only listed", ODD, "s", lambda one: one.get("found", False)),
        ("something else named", BAD, "X", lambda one: bool(one["named"])),
        ("detected, nothing named", NAMED, "^", lambda one: one["heard"]),
        ("not detected", QUIET, "v", lambda one: True),
    )
    left = [one for one in records if one["d"] is not None]
    for label, tone, mark, belongs in groups:
        here = [one for one in left if belongs(one)]
        left = [one for one in left if not belongs(one)]
        if here:
            gains = [one["gain"] or 0.0 for one in here]
            ax.plot([one["d"] for one in here], gains, mark, color=tone, markersize=4, alpha=0.7, linestyle="none",
                    markeredgewidth=0, label=f"{label} ({len(here)})")  # fmt: skip
    top = max([10.0, *(one["d"] or 0.0 for one in records), *(one["gain"] or 0.0 for one in records)])
    ax.plot([0, top], [0, top], color=QUIET, linewidth=0.8, linestyle="--")
    for edge in (4.0, 8.0, 16.0):
        ax.axvline(edge, color=FAINT, linewidth=0.8)
    for scale in (ax.set_xscale, ax.set_yscale):
        scale("symlog", linthresh=10.0)
    ax.set(
        xlabel="D of the oracle [nats]",
        ylabel="log evidence gain of diagnose [nats]",
        xlim=(-4, 2 * top),
        ylim=(-4, 2 * top),
    )
    legend_below(figure, ax, columns=3)
    return figure


def _percent(ax) -> None:
    ax.set_xlim(-0.02, 1.02)
    ax.xaxis.set_major_formatter(PercentFormatter(1.0, symbol=" %"))
    ax.grid(axis="y", visible=False)
