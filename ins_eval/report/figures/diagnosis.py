"""What is left over after the belief: whitened residuals, where they leave their bands, and what was located."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from ins_eval.report.style import INK, QUIET, legend_below, sheet, styled

CHANNELS = (
    "position north", "position east", "position down",
    "velocity north", "velocity east", "velocity down",
    "attitude north", "attitude east", "attitude down",
)  # fmt: skip
LOCATED = "#d95f02"
BAND = 2.0  # sigmas


@styled
def whitened_residuals(
    *,
    time_s: np.ndarray,
    innovations: np.ndarray,
    located: Sequence[tuple[float, float, str]],
    block_s: float,
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
        t, mean = _means(time_s, innovations[:, k], block_s)
        ax.axhspan(-BAND, BAND, color="#ececec", linewidth=0, zorder=0.2, label="95 % of a white residual")
        ax.plot(t, mean, color=INK, linewidth=0.8, label="whitened residual")
        ax.axhline(0.0, color=QUIET, linewidth=0.5)
        ax.set_ylabel(CHANNELS[k].replace(" ", "\n"))
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


def _means(time_s: np.ndarray, e: np.ndarray, block_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Sum of each block over the root of its count; NaN where a block holds nothing."""
    block = np.floor((time_s - time_s[0]) / block_s).astype(int)
    here = np.isfinite(e)
    count = np.bincount(block[here], minlength=block[-1] + 1)
    total = np.bincount(block[here], weights=e[here], minlength=block[-1] + 1)
    mean = np.where(count > 0, total / np.sqrt(np.maximum(count, 1)), np.nan)
    return time_s[0] + (np.arange(count.size) + 0.5) * block_s, mean
