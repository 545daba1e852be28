"""The six channels of an IMU at rest: Allan deviation with the noise that makes it, and laws of temperature."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator

from ins_eval.figures.style import INK, QUIET, legend_below, sheet, styled

SEEN, FIT = "#35978f", INK
TERMS = {
    "white": ("white noise N", "#4a9bd4", "--"),
    "flicker": ("flicker B", "#b2182b", "--"),
    "random_walk": ("random walk K", "#8073ac", "--"),
    "quantisation": ("quantisation Q", "#b8860b", ":"),
}
BOX = {"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 1.5}
PLAIN = FuncFormatter(lambda value, _: f"{value:g}")


@styled
def allan_deviation(*, channels: Sequence[Mapping[str, Any]], rest_s: float) -> Figure:
    """Six panels, gyros left and accelerometers right, in the field's units.

    Each of `channels` has ``name``, ``unit``, ``tau_s``, ``deviation``, ``fit`` (the deviation of the fit at tau_s, or
    None), ``terms`` (that of each visible term by its name) and ``words`` (the coefficients with their intervals).
    """
    note = (
        f"How far means over the averaging time differ from one to the next, in {rest_s:.0f} s at rest. Points: "
        "measured. Black: the fit of all noise terms; dashed: the terms that are seen. Values with [95 % interval]."
    )
    figure, grid = sheet(8.4, "Allan deviation at rest", note, rows=3, columns=2, sharex=True)
    panels = [grid[axis, sensor] for sensor in range(2) for axis in range(3)]
    for ax, channel in zip(panels, channels, strict=False):
        if not channel["deviation"].max() > 0.0:  # an ideal sensor has nothing to show on a logarithmic scale
            ax.set(yticks=[], ylabel=f"{channel['name']}\n[{channel['unit']}]")
            ax.text(0.5, 0.5, "no noise", transform=ax.transAxes, ha="center", color=QUIET)
            continue
        ax.plot(channel["tau_s"], channel["deviation"], "o", color=SEEN, markersize=3.5, label="measured")
        if channel["fit"] is not None:
            ax.plot(channel["tau_s"], channel["fit"], color=FIT, linewidth=1.2, label="fit")
        seen = channel["deviation"][channel["deviation"] > 0.0]
        low, high = seen.min() / 2.0, seen.max() * 2.0
        for term, values in channel["terms"].items():
            text, colour, dash = TERMS[term]
            ax.plot(channel["tau_s"], values, dash, color=colour, linewidth=1.0, label=text)
        ax.set(xscale="log", yscale="log", ylim=(low, high), ylabel=f"{channel['name']}\n[{channel['unit']}]")
        ax.text(
            0.03, 0.05, channel["words"], transform=ax.transAxes, fontsize=7.5, color=QUIET, linespacing=1.25, bbox=BOX
        )
        ax.yaxis.set_major_formatter(PLAIN)
        ax.yaxis.set_minor_locator(LogLocator(subs=(2.0, 5.0)))
        ax.yaxis.set_minor_formatter(PLAIN)
        ax.xaxis.set_major_formatter(PLAIN)
    for ax in panels[len(channels) :]:
        ax.set_visible(False)
    for ax in (grid[2, 0], grid[2, 1]):
        ax.set_xlabel("averaging time [s]")
    legend_below(figure, *panels, columns=6)
    return figure


@styled
def temperature_laws(*, channels: Sequence[Mapping[str, Any]]) -> Figure:
    """Six panels, gyros left and accelerometers right, in the field's units.

    Each of `channels` has ``name``, ``unit``, ``temperature_c`` and ``change`` of each mean, ``line_c`` and ``line``,
    the ends of its straight line, and ``words``, the slope with its interval.
    """
    note = (
        "Points: means over ten seconds at rest, less their mean. Black: the straight line, its slope with [95 % "
        "interval]. Changes with time are included."
    )
    figure, grid = sheet(8.4, "Channels at rest against temperature", note, rows=3, columns=2, sharex=True)
    panels = [grid[axis, sensor] for sensor in range(2) for axis in range(3)]
    for ax, channel in zip(panels, channels, strict=False):
        ax.plot(channel["temperature_c"], channel["change"], "o", color=SEEN, markersize=3.0, label="mean over 10 s")
        ax.plot(channel["line_c"], channel["line"], color=FIT, linewidth=1.2, label="straight line")
        ax.set(ylabel=f"{channel['name']}\n[{channel['unit']}]")
        ax.text(0.03, 0.05, channel["words"], transform=ax.transAxes, fontsize=7.5, color=QUIET, bbox=BOX)
    for ax in panels[len(channels) :]:
        ax.set_visible(False)
    for ax in (grid[2, 0], grid[2, 1]):
        ax.set_xlabel("temperature [°C]")
    legend_below(figure, *panels, columns=2)
    return figure
