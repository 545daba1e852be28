"""What is left over after the belief: whitened residuals, where they leave their bands, and what was located."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from ins_eval.report.style import INK, QUIET, legend_below, shade, sheet, styled

CHANNELS = (
    "position north", "position east", "position down",
    "velocity north", "velocity east", "velocity down",
    "attitude north", "attitude east", "attitude down",
)  # fmt: skip
LOCATED = "#f4c7ab"
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
        "found account for the recording. Shaded: what was located."
    )
    figure, panels = sheet(1.2 + 1.05 * len(shown), title, note, rows=len(shown), sharex=True, squeeze=False)
    for k, ax in zip(shown, panels[:, 0], strict=True):
        t, mean = _means(time_s, innovations[:, k], block_s)
        ax.axhspan(-BAND, BAND, color="#ececec", linewidth=0, zorder=0.2, label="95 % of a white residual")
        for channel in dict.fromkeys(one[2] for one in located):
            shade(ax, [one[:2] for one in located if one[2] == channel], f"located: {channel}", color=LOCATED)
        ax.plot(t, mean, color=INK, linewidth=0.8, label="whitened residual")
        ax.axhline(0.0, color=QUIET, linewidth=0.5)
        ax.set_ylabel(CHANNELS[k].replace(" ", "\n"))
        ax.set_ylim(min(-4.0, np.nanmin(mean) * 1.1), max(4.0, np.nanmax(mean) * 1.1))
    panels[-1, 0].set_xlabel("time in the recording [s]")
    legend_below(figure, panels[0, 0])
    return figure


def _means(time_s: np.ndarray, e: np.ndarray, block_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Sum of each block over the root of its count; NaN where a block holds nothing."""
    block = np.floor((time_s - time_s[0]) / block_s).astype(int)
    here = np.isfinite(e)
    count = np.bincount(block[here], minlength=block[-1] + 1)
    total = np.bincount(block[here], weights=e[here], minlength=block[-1] + 1)
    mean = np.where(count > 0, total / np.sqrt(np.maximum(count, 1)), np.nan)
    return time_s[0] + (np.arange(count.size) + 0.5) * block_s, mean
