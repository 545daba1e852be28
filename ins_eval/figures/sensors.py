"""What an IMU recorded beside what a reference implies: six channels, gyros left, accelerometers right."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ins_eval.figures.style import INK, QUIET, decimate, legend_below, sheet, styled

AXES = "xyz"
SENSORS = ("gyro", "accelerometer")
IMPLIED, BEFORE, AFTER = "#35978f", "#a6a6a6", "#8c2d04"
TIME_LABEL = "time in the recording [s]"
MOST_POINTS = 150  # of a cloud, which keeps the file small


@styled
def sensor_signals(
    *, time_s: np.ndarray, recorded: np.ndarray, implied: np.ndarray, units: Sequence[str], window_s: float
) -> Figure:
    """A short stretch of six channels (n, 6) at `time_s` (n,); `units` are those of gyros and accelerometers."""
    note = f"The stretch with the most motion, as means over {window_s:g} s; nothing is corrected."
    figure, panels = _six("Recorded and implied", note, units)
    for channel, ax in enumerate(panels):
        for values, colour, width, text in (
            (recorded, INK, 1.8, "recorded"),
            (implied, IMPLIED, 0.9, "implied by the reference"),
        ):
            ax.plot(*_open_at_gaps(time_s, values[:, channel], window_s), color=colour, linewidth=width, label=text)
        ax.set_xlim(float(time_s[0]), float(time_s[-1]))
        ax.ticklabel_format(useOffset=False)
    legend_below(figure, panels[0])
    return figure


@styled
def sensor_residuals(
    *, time_s: np.ndarray, before: np.ndarray, after: np.ndarray, units: Sequence[str], window_s: float
) -> Figure:
    """Six channels (n, 6) over the whole recording; a gap in `time_s` (n,) is left open."""
    note = (
        f"Means over {window_s:g} s. Before: the plain difference. After: less bias, scale factors and misalignments "
        "as far as they are determined."
    )
    figure, panels = _six("Recorded minus implied", note, units)
    for channel, ax in enumerate(panels):
        for values, colour, text in ((before, BEFORE, "before"), (after, AFTER, "after")):
            t, v = _open_at_gaps(time_s, values[:, channel], window_s)
            ax.plot(*decimate(t, v, 500), color=colour, linewidth=0.9, label=text)
        ax.axhline(0.0, color=QUIET, linewidth=0.6, zorder=1)
        ax.set_xlim(float(time_s[0]), float(time_s[-1]))
    legend_below(figure, panels[0])
    return figure


@styled
def sensor_scatter(
    *,
    implied: np.ndarray,
    difference: np.ndarray,
    fitted: Sequence[tuple[float, float] | None],
    units: Sequence[str],
    window_s: float,
) -> Figure:
    """The difference (n, 6), less what the other axes explain, against the input (n, 6) of its own axis.

    `fitted` has level at zero input and slope of each channel, None where its scale factor is not determined.
    """
    note = (
        f"Means over {window_s:g} s, misalignments taken off; the slope is the scale factor error. No line: not "
        "determined."
    )
    figure, panels = _six("Difference against input", note, units, against="implied")
    every = -(-implied.shape[0] // MOST_POINTS)
    for channel, ax in enumerate(panels):
        x, y = implied[:, channel], difference[:, channel]
        ax.plot(x[::every], y[::every], ".", color=BEFORE, markersize=3.5, label="one window")
        if fitted[channel] is not None:
            level, slope = fitted[channel]
            ends = np.array([x.min(), x.max()])
            ax.plot(ends, level + slope * ends, color=AFTER, linewidth=1.4, label="fitted")
        ax.ticklabel_format(useOffset=False)
    legend_below(figure, *panels)
    return figure


def _six(title: str, note: str, units: Sequence[str], against: str = "") -> tuple[Figure, list[Axes]]:
    """Three rows by two columns, in the order of the channels; against time, or against the `against` of each."""
    figure, grid = sheet(6.4, title, note, rows=3, columns=2, sharex=False if against else "col")
    panels = [grid[axis, sensor] for sensor in range(2) for axis in range(3)]
    for channel, ax in enumerate(panels):
        sensor, axis = divmod(channel, 3)
        ax.set_ylabel(f"{SENSORS[sensor]} {AXES[axis]}\n[{units[sensor]}]")
        ax.locator_params(axis="x", nbins=6)
        if against:
            ax.set_xlabel(f"{against} {SENSORS[sensor]} {AXES[axis]} [{units[sensor]}]")
        elif axis == 2:
            ax.set_xlabel(TIME_LABEL)
    return figure, panels


def _open_at_gaps(time_s: np.ndarray, values: np.ndarray, window_s: float) -> tuple[np.ndarray, np.ndarray]:
    gaps = np.flatnonzero(np.diff(time_s) > 1.5 * window_s) + 1
    return np.insert(time_s, gaps, time_s[gaps] - 0.5 * window_s), np.insert(values, gaps, np.nan)
