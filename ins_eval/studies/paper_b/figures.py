"""Figures 11 to 13 of Paper B, and our distributions beside its tables.

Names of estimates are those of the results: an estimate is ``{"value", "interval95"}``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from ins_eval.figures.style import ACCENT, INK, QUIET, decimate, legend_below, sheet, styled

BEFORE, AFTER, COMPENSATED, IDENTIFIED = "#4a9bd4", "#b2182b", "#1b7837", "#8073ac"  # blue, red, green as in the paper
CHANNELS = {"forward": "forward gain", "feedback": "feedback gain"}
BINS = 24


@styled
def forward_estimation(
    *, n_fpga: np.ndarray, before: np.ndarray, after: np.ndarray, before_gain: float, after_gain: float
) -> Figure:
    """A scan before and after the drift; `n_fpga`, `before`, `after` (p,) in counts, slopes in counts a count."""
    note = (
        "One repetition of the identified unit. Left the scans, which cannot be distinguished; right their difference, "
        f"whose slope of {1e6 * (after_gain / before_gain - 1.0):.1f} ppm of that of the scan is the drift found."
    ).replace("-", "−")
    figure, (left, right) = sheet(3.2, "Estimation of the forward gain (Fig. 11)", note, columns=2)
    left.plot(n_fpga, 1e-6 * before, "o", color=BEFORE, markersize=5, label="before")
    left.plot(n_fpga, 1e-6 * after, ".", color=AFTER, markersize=4, label="−200 ppm injected")
    left.set(xlabel="N_FPGA [count]", ylabel="N_out [10⁶ count]")
    difference = after - before
    slope = after_gain - before_gain
    right.plot(n_fpga, difference, ".", color=AFTER, label="after − before")
    middle = n_fpga - n_fpga.mean()
    right.plot(n_fpga, difference.mean() + slope * middle, color=INK, linewidth=1.0, label="least squares")
    right.set(xlabel="N_FPGA [count]", ylabel="change of N_out [count]")
    legend_below(figure, left, right)
    return figure


@styled
def feedback_estimation(
    *, before: Sequence[float], after: Sequence[float], printed: Mapping[str, Sequence[float]]
) -> Figure:
    """N_on − N_off (r,) of each repetition before and after the drift, ours and printed, in counts."""
    note = (
        "Left the identified unit, right Table 4 as printed. By eq. (26) the size must fall where the gain rises by "
        "200 ppm, as ours does; the printed one rises (B9)."
    )
    figure, panels = sheet(3.2, "Estimation of the feedback gain (Fig. 12)", note, columns=2, sharey=True)
    for ax, name, (first, second) in zip(
        panels, ("ours", "printed"), ((before, after), (printed["before"], printed["after"])), strict=True
    ):
        at = np.arange(1, len(first) + 1)
        ax.plot(at, first, "o-", color=BEFORE, markersize=5, label="before")
        ax.plot(at, second, "s-", color=AFTER, markersize=5, label="+200 ppm injected")
        ax.set(xlabel="repetition", title=name, xticks=at)
        ax.ticklabel_format(axis="y", useOffset=False)
    panels[0].set_ylabel("N_on − N_off [count]")
    legend_below(figure, *panels)
    return figure


@styled
def static_output(
    *, time_s: np.ndarray, output_ug: Mapping[str, np.ndarray], printed_ug: Mapping[str, float]
) -> Figure:
    """N_out(0), N'_out(1), N_out(1) less 1 g (n,): "before", "after", "compensated"; and the printed changes."""
    note = (
        "The identified unit, means of 50 ms. Dashed: the printed changes from N_out(0), of which the paper gives "
        "the magnitudes, with the signs that the loop requires: 193 µg below, 24 µg above."
    )
    figure, ax = sheet(3.2, "Output at 1 g, with and without compensation (Fig. 13)", note)
    tints = {
        "before": (BEFORE, "N_out(0)"),
        "after": (AFTER, "N'_out(1), drifted"),
        "compensated": (COMPENSATED, "N_out(1), compensated"),
    }
    level = float(np.mean(output_ug["before"]))
    for name, (tint, words) in tints.items():
        ax.plot(time_s, output_ug[name], color=tint, label=words)
        if name in printed_ug:
            ax.axhline(level + printed_ug[name], color=ACCENT, linestyle="--", linewidth=1.0, label="printed")
    ax.set(xlabel="time [s]", ylabel="output − 1 g [µg]")
    legend_below(figure, ax)
    return figure


@styled
def estimates_by_repetition(
    *,
    identified_ppm: Mapping[str, Sequence[float]],
    printed_ppm: Mapping[str, Sequence[float]],
    population_ppm: Mapping[str, Mapping],
    injected_ppm: Mapping[str, float],
) -> Figure:
    """Drift found in each repetition, printed and of the identified unit, on the central 95 % of ours."""
    note = (
        "Grey: central 95 % of single repetitions of our units, with assumed temperature coefficients and warm-up. The "
        "identified unit was chosen after the tables, so its agreement shows nothing."
    )
    figure, panels = sheet(3.3, "Tables 3 and 4 row by row", note, columns=2)
    for ax, (channel, words) in zip(panels, CHANNELS.items(), strict=True):
        low, high = population_ppm[channel]["interval95"]
        at = np.arange(1, len(printed_ppm[channel]) + 1)
        ax.axhspan(low, high, color="#ececec", linewidth=0, label="our units")
        ax.axhline(injected_ppm[channel], color=QUIET, linewidth=1.0, linestyle=":", label="injected")
        ax.plot(at, printed_ppm[channel], "D", color=ACCENT, markersize=6, label="Paper B")
        ax.plot(at, identified_ppm[channel], "o", color=IDENTIFIED, markersize=5, label="identified unit")
        ax.set(xlabel="repetition", title=words, xticks=at)
    panels[0].set_ylabel("drift found [ppm]")
    legend_below(figure, *panels, columns=5)
    return figure


@styled
def shift_distribution(*, shift_ppm: Mapping[str, np.ndarray], printed_ppm: Mapping[str, float]) -> Figure:
    """Histogram of the mean shift (units,) of each channel, and the printed one."""
    size = len(next(iter(shift_ppm.values())))
    note = (
        f"{size} units, six repetitions each, warmed up by about 2 °C between reference and test, within the paper's "
        "3 °C. The shift comes from temperature coefficients alone and can have either sign; the paper has one value."
    )
    figure, panels = sheet(3.2, "Found less injected drift, over our units", note, columns=2, sharey=True)
    widest = max(np.abs(np.concatenate(list(shift_ppm.values()))).max(), *(abs(v) for v in printed_ppm.values()))
    edges = np.linspace(-1.05 * widest, 1.05 * widest, BINS + 1)
    for ax, (channel, words) in zip(panels, CHANNELS.items(), strict=True):
        ax.hist(shift_ppm[channel], edges, color="#9dbcd4", edgecolor="white", linewidth=0.5, label="our units")
        ax.axvline(printed_ppm[channel], color=ACCENT, linewidth=2.0, label="Paper B")
        ax.axvline(0.0, color=QUIET, linewidth=0.8)
        ax.set(xlabel="found − injected [ppm]", title=words)
    panels[0].set_ylabel("units")
    panels[0].yaxis.set_major_locator(MaxNLocator(integer=True))
    legend_below(figure, *panels)
    return figure


@styled
def shift_and_size(
    *, small_ppm: Mapping[str, np.ndarray], large_ppm: Mapping[str, np.ndarray], sizes_ppm: tuple[float, float]
) -> Figure:
    """Shift (n,) of the same tests with the paper's and with a larger drift put in."""
    small, large = sizes_ppm
    note = (
        f"Each point is one repetition of one unit, at the same temperatures. On the line the shift is the same; if "
        f"a share of the drift were not estimated, the points would lie on a slope of {large / small:g}."
    )
    figure, panels = sheet(
        3.4, "The shift does not grow with what is injected", note, columns=2, sharex=True, sharey=True
    )
    widest = 1.1 * max(np.abs(v).max() for v in (*small_ppm.values(), *large_ppm.values()))
    for ax, (channel, words) in zip(panels, CHANNELS.items(), strict=True):
        ax.plot([-widest, widest], [-widest, widest], color=INK, linewidth=1.0, label="the same shift")
        ax.plot([-widest, widest], [-widest * large / small, widest * large / small], color=QUIET, linewidth=1.0,
                linestyle=":", label="a share of the drift")  # fmt: skip
        ax.plot(small_ppm[channel], large_ppm[channel], ".", color=BEFORE, markersize=4, label="our units")
        ax.set(xlabel=f"found − injected, {small:g} ppm injected [ppm]", title=words)
        ax.set(xlim=(-widest, widest), ylim=(-widest, widest))
    panels[0].set_ylabel(f"with {large:g} ppm injected [ppm]")
    legend_below(figure, *panels)
    return figure


@styled
def stability_against_drift(
    *,
    forward_ppm: np.ndarray,
    phase_margin_deg: Sequence[float],
    crossover_hz: Sequence[float],
    steps: Mapping[str, tuple[np.ndarray, np.ndarray]],
) -> Figure:
    """Phase margin and crossover over the drift, and responses name -> (time_s, output in g) to a step of 1 g."""
    note = (
        "200 ppm cannot be seen on this scale: the forward gain would have to halve or double. The static output does "
        "not change at all."
    )
    figure, (left, right) = sheet(3.4, "Stability against drift of the forward gain", note, columns=2)
    percent = 1e-4 * np.asarray(forward_ppm)
    left.plot(percent, phase_margin_deg, color=AFTER, label="phase margin [°]")
    left.plot(percent, crossover_hz, color=BEFORE, label="crossover [Hz]")
    left.axvline(-0.02, color=ACCENT, linewidth=1.5, label="−200 ppm")
    left.set(xlabel="drift of the forward gain [%]", ylabel="margin [°], crossover [Hz]", ylim=(0.0, None))
    _steps(right, steps)
    legend_below(figure, left, right, columns=6)
    return figure


@styled
def attraction_by_carrier(
    *,
    volts: Sequence[float],
    gain_ppm: Sequence[float],
    added_scatter_ppm: Sequence[float],
    carrier_v: float,
    excited_v: float,
    scatter_ppm: float,
    limit_ppm: float,
) -> Figure:
    """What attraction on a held plate adds to the gain (n,) and to its scatter, by the amplitude of the carrier."""
    note = (
        "The plate is held at the middle of the bridge, where the attraction is largest; a free plate is not "
        "attracted. The gain grows by the same in every excitation, and the added scatter is small beside the bias's."
    )
    figure, ax = sheet(3.2, "Attraction in the open-loop test with excitation", note)
    ax.loglog(volts, gain_ppm, color=BEFORE, label="added to the gain")
    ax.loglog(volts, added_scatter_ppm, color=AFTER, label="added to its scatter")
    ax.axhline(scatter_ppm, color=QUIET, linewidth=1.0, linestyle=":", label="scatter from the bias")
    ax.axhline(limit_ppm, color=ACCENT, linewidth=1.0, linestyle="--", label="10 ppm of Paper B")
    ax.axvline(carrier_v, color=INK, linewidth=1.2, label="our carrier")
    ax.axvline(excited_v, color=INK, linewidth=1.2, linestyle="--", label="pulled in")
    ax.set(xlabel="amplitude of the carrier [V]", ylabel="gain or scatter [ppm]")
    legend_below(figure, ax, columns=3)
    return figure


@styled
def temperature_calibrated(
    *,
    room: Mapping[str, Mapping],
    far: Mapping[str, Mapping],
    floor: Mapping[str, float],
    changes_c: tuple[float, float],
) -> Figure:
    """RMS errors by arm, with intervals, after a change in the paper's room and after a large one; and their floor."""
    note = (
        "RMS over our units with 95 % intervals, on a logarithmic scale. Grey lines: the same errors at constant "
        "temperature. With another unit's coefficients the errors grow, as expected."
    )
    figure, panels = sheet(3.4, "Errors after correction for temperature", note, columns=2, sharey=True)
    tints = {"none": INK, "tests": BEFORE, "tests_and_output": COMPENSATED, "other_unit": AFTER}
    words = ("as measured", "tests corrected", "tests and output corrected", "with another unit's coefficients")
    errors = {"forward_ppm": "forward gain", "feedback_ppm": "feedback gain", "output_ug": "output"}
    at = np.arange(len(errors))
    for ax, arms, change_c in zip(panels, (room, far), changes_c, strict=True):
        for k, (arm, label) in enumerate(zip(tints, words, strict=True)):
            value = np.array([arms[arm][error]["value"] for error in errors])
            ends = np.array([arms[arm][error]["interval95"] for error in errors]).T
            ax.errorbar(at + 0.14 * (k - 1.5), value, np.abs(ends - value), fmt="o", color=tints[arm], label=label)
        floors = [floor[error] for error in errors]
        ax.hlines(floors, at - 0.35, at + 0.35, color=QUIET, linewidth=2.0, label="no change of temperature")
        ax.set(yscale="log", title=f"{change_c:.0f} °C from the reference", xlabel="error of gains [ppm], output [µg]")
        ax.set_xticks(at, errors.values())
    panels[0].set_ylabel("RMS [ppm] or [µg]")
    legend_below(figure, *panels, columns=3)
    return figure


@styled
def loop_in_flight(*, stretches: Mapping[str, Mapping[str, np.ndarray]]) -> Figure:
    """By name of the flight "time_s", "force_g", "off_ug" and "linear_ug" (n,), of samples of 10 ms."""
    note = (
        "Above: the specific force along the axis that changes most. Below: the loop less its steady state, without "
        "noise, in samples of 10 ms: the response of the transfer function, and the steps of the converters."
    )
    figure, panels = sheet(
        4.8, "The sampled loop beside its steady state, where a flight has the most motion", note, rows=2, columns=2
    )
    panels = np.reshape(panels, (2, 2))
    for (upper, lower), (name, one) in zip(panels.T, stretches.items(), strict=True):
        time_s = one["time_s"] - one["time_s"][0]
        upper.plot(*decimate(time_s, one["force_g"]), color=INK)
        upper.set(title=name, xlabel="time [s]", ylabel="specific force [g]")
        lower.plot(*decimate(time_s, one["off_ug"]), color=BEFORE, linewidth=0.6, label="loop − steady state")
        lower.plot(*decimate(time_s, one["linear_ug"]), color=AFTER, label="from the transfer function")
        lower.set(xlabel="time [s]", ylabel="difference [µg]")
    legend_below(figure, *panels[1])
    return figure


def _steps(ax: Axes, steps: Mapping[str, tuple[np.ndarray, np.ndarray]]) -> None:
    tints = (INK, ACCENT, "#8fb8d0", "#d6604d")
    widths = (2.6, 1.0, 1.2, 1.2)
    for (name, (time_s, output_g)), tint, width in zip(steps.items(), tints, widths, strict=False):
        ax.plot(1e3 * time_s, output_g, color=tint, linewidth=width, label=name)
    ax.set(xlabel="time after a step of 1 g [ms]", ylabel="output [g]")
