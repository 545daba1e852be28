"""One flight or recording against time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from ins_eval.analysis.schuler import SCHULER_PERIOD_S
from ins_eval.figures.style import (
    INK,
    QUIET,
    colour,
    decimate,
    distinct,
    in_scale,
    is_own,
    legend_below,
    shade,
    sheet,
    styled,
)
from ins_eval.units import HOUR, NMI
from ins_eval.wording import fixed, small

Spans = Sequence[tuple[float, float]]
Series = Mapping[str, np.ndarray]

TIME_LABEL = "time since start of navigation [s]"
PATH_STRETCH_LIMIT = 5.0  # a path thinner than this is drawn with a stretched short side
RATES_NMI_PER_H = (0.8, 1.0)  # what a navigation-grade INS is sold by
KM = 1000.0
LOCAL_M = 1000.0  # position errors below this are drawn in metres
FEW_DECADES = 100.0  # below this an axis of logarithms has numbers at 2 and 5, too
ROOM = 1.6  # an axis is cut at so many times the largest curve that does not dwarf the main ones: by eye
PHASE_TINTS = ("#f2f2f2", "#ffffff")


@styled
def flight_path(
    *,
    time_s: np.ndarray,
    latitude_deg: np.ndarray,
    longitude_deg: np.ndarray,
    height_m: np.ndarray,
    outages: Spans = (),
) -> Figure:
    """Path over ground and height against time, all (n,); GPS outages, spans in s, are marked on both."""
    time_s, lat, lon = (np.asarray(a, dtype=float) for a in (time_s, latitude_deg, longitude_deg))
    east_per_deg = max(np.cos(np.deg2rad(lat.mean())), 0.01)
    extent_north, extent_east = np.ptp(lat), np.ptp(lon) * east_per_deg
    thin = min(extent_north, extent_east) * PATH_STRETCH_LIMIT < max(extent_north, extent_east)
    note = f"{len(outages)} GPS outages marked. " if outages else ""
    note += "The two axes have different scales." if thin else "Equal scales north and east."
    figure, (ground, profile) = sheet(3.6, "Path over ground and height", note, columns=2, width_ratios=[3, 2])

    # A path is not a function of time, so its points are thinned evenly, but for the outages.
    outside = np.ones(time_s.size, dtype=bool)
    for start, end in outages:
        outside &= (time_s < start) | (time_s > end)
    step = max(1, time_s.size // 1500)
    ground.plot(lon[::step], lat[::step], color=INK, linewidth=1.0, label="path")
    for k, (start, end) in enumerate(outages):
        lost = (time_s >= start) & (time_s <= end)
        every = max(1, int(lost.sum()) // 100)
        ground.plot(
            lon[lost][::every],
            lat[lost][::every],
            color="#d08a00",
            linewidth=3.0,
            solid_capstyle="butt",
            label="GPS outage" if k == 0 else "_",
        )
    ground.plot(lon[0], lat[0], "o", color=INK, markersize=5, label="start")
    ground.plot(lon[-1], lat[-1], "s", color=INK, markersize=5, fillstyle="none", label="end")
    if not thin:
        ground.set_aspect(1.0 / east_per_deg, adjustable="datalim")
    ground.set(xlabel="longitude [°]", ylabel="latitude [°]", title="over ground")
    ground.ticklabel_format(useOffset=False)

    profile.plot(*decimate(time_s, np.asarray(height_m) / 1000.0), color=INK, linewidth=1.0, label="path")
    for start, end in outages:
        profile.axvspan(start, end, color="#d08a00", alpha=0.5, linewidth=0)
    profile.set(xlabel=TIME_LABEL, ylabel="height [km]", title="height")
    profile.set_ylim(bottom=0.0)
    legend_below(figure, ground, columns=4)
    return figure


@styled
def temperature_and_rate(
    *,
    time_s: np.ndarray,
    temperature_c: np.ndarray | None,
    reading_c: np.ndarray,
    rate_c_per_min: np.ndarray,
    phases: Sequence[tuple[str, float, float]] = (),
) -> Figure:
    """True temperature (None where unknown), its reading and the filtered rate of the reading, (n,) each.

    `phases` holds (name, start in s, end in s), shaded in turn.
    """
    note = "Rate: the causal filtered derivative of the reading that every compensation uses."
    figure, (upper, lower) = sheet(
        4.2, "Temperature of the IMU and its rate", note, rows=2, sharex=True, height_ratios=[3, 2]
    )
    upper.plot(*decimate(time_s, reading_c, 600), color="#fdb863", linewidth=3.0, label="reading")
    if temperature_c is not None:
        upper.plot(*decimate(time_s, temperature_c, 400), color=INK, linewidth=1.0, label="true temperature")
    lower.plot(*decimate(time_s, rate_c_per_min, 800), color="#5e3c99", linewidth=1.0, label="rate of the reading")
    lower.axhline(0.0, color=QUIET, linewidth=0.6)
    for k, (name, start, end) in enumerate(phases):
        for ax in (upper, lower):
            ax.axvspan(start, end, color=PHASE_TINTS[k % 2], linewidth=0, zorder=0.1)
            ax.axvline(start, color=QUIET, linewidth=0.5, linestyle=(0, (2, 3)))
        upper.text(
            0.5 * (start + end),
            1.01,
            name,
            transform=upper.get_xaxis_transform(),
            ha="center",
            va="bottom",
            fontsize=8.5,
            color=QUIET,
        )
    upper.set_ylabel("temperature [°C]")
    lower.set(xlabel=TIME_LABEL, ylabel="rate [°C/min]")
    upper.set_xlim(float(time_s[0]), float(time_s[-1]))
    legend_below(figure, upper, lower)
    return figure


@styled
def velocity_error(
    *,
    time_s: np.ndarray,
    errors_mps: Series,
    component: Literal["north", "east", "down"],
    bridged: np.ndarray | None = None,
    outages: Spans = (),
    raw_mps: Series | None = None,
    rms_mps: Mapping[str, float] | None = None,
    reference: str = "GPS",
) -> Figure:
    """One component of velocity, INS minus `reference`, for each compensation.

    `errors_mps` name -> (m,) at `time_s` (m,); `bridged` (m,) bool marks values that were regressed over a gap
    and count in no statistic; `raw_mps` name -> (m,) are the unsmoothed differences whose vertices Paper A's
    Fig. 12 shows, drawn in a second, smaller panel; `rms_mps` enters the legend.
    """
    note = f"One flight, INS minus {reference}." if reference == "GPS" else f"INS minus {reference}."
    if rms_mps:
        note += f" RMS over the {_window(time_s)} s shown" + (", outage epochs excluded." if len(outages) else ".")
    if len(outages):
        note += " Dotted: bridged by regression over a GPS outage."
    suffix = {name: f", RMS {value:.2f} m/s" for name, value in (rms_mps or {}).items()}
    title = f"{component.capitalize()} velocity error"
    if raw_mps:
        figure, (main, small) = sheet(4.6, title, note, rows=2, sharex=True, height_ratios=[3, 1.2])
        _traces(small, time_s, raw_mps, None, {})
        small.set(ylabel="raw [m/s]", xlabel=TIME_LABEL)
        small.set_title(
            f"raw: {reference} interpolated straight across its outages, which makes the vertices",
            loc="left",
            fontsize=8.5,
            color=QUIET,
        )
        shade(small, outages, "GPS outage")
    else:
        figure, main = sheet(3.6, title, note)
        main.set_xlabel(TIME_LABEL)
    _traces(main, time_s, errors_mps, bridged, suffix)
    shade(main, outages, "GPS outage")
    _schuler(main)
    main.set_ylabel(f"{component} velocity error [m/s]")
    legend_below(figure, main, columns=3 if rms_mps else 4)
    return figure


@styled
def angle_error(
    *,
    time_s: np.ndarray,
    errors_arcmin: Series,
    component: Literal["latitude", "longitude"],
    metres_per_arcmin: float | None = None,
    bridged: np.ndarray | None = None,
    outages: Spans = (),
    reference: str = "GPS",
    title: str = "",
) -> Figure:
    """Latitude or longitude error in arc-minutes for each compensation, name -> (m,), with kilometres on the right.

    In metres where `metres_per_arcmin` is known and the errors are small.
    """
    note = _position_note(reference, outages)
    figure, ax = sheet(3.6, title or f"{component.capitalize()} error", note)
    near = bool(metres_per_arcmin) and metres_per_arcmin * _largest(errors_arcmin) < LOCAL_M
    size = metres_per_arcmin if near else 1.0
    _traces(ax, time_s, {name: size * np.asarray(error) for name, error in errors_arcmin.items()}, bridged, {})
    shade(ax, outages, "GPS outage")
    _schuler(ax)
    ax.set(xlabel=TIME_LABEL, ylabel=f"{component} error [{'m' if near else 'arc-minute'}]")
    if metres_per_arcmin and not near:
        _second_axis(ax, metres_per_arcmin, "north" if component == "latitude" else "east")
    legend_below(figure, ax)
    return figure


@styled
def position_error(
    *,
    time_s: np.ndarray,
    errors_m: Series,
    bridged: np.ndarray | None = None,
    outages: Spans = (),
    reference: str = "GPS",
    floor_m: float | None = None,
    title: str = "Horizontal position error",
) -> Figure:
    """Horizontal radial error r = sqrt(dN^2 + dE^2) of each compensation, name -> (m,) in m; nmi left, km right.

    In metres where they are small.
    """
    note = _position_note(reference, outages)
    if floor_m is not None:
        note += f" Numeric floor {small(floor_m, 'm')}."
    figure, ax = sheet(3.6, title, note)
    unit, size = ("m", 1.0) if _largest(errors_m) < LOCAL_M else ("nmi", NMI)
    _traces(ax, time_s, {name: np.asarray(r) / size for name, r in errors_m.items()}, bridged, {})
    shade(ax, outages, "GPS outage")
    ax.set(xlabel=TIME_LABEL, ylabel=f"radial error [{unit}]")
    ax.set_ylim(bottom=0.0)
    _rates_and_schuler(ax, NMI / size)
    if unit == "nmi":
        _second_axis(ax, NMI)
    legend_below(figure, ax)
    return figure


@styled
def attitude(
    *,
    time_s: np.ndarray,
    roll_deg: np.ndarray,
    pitch_deg: np.ndarray,
    heading_deg: np.ndarray,
) -> Figure:
    """Roll, pitch and heading (n,) in degrees, one panel each."""
    note = "As navigated from the alignment onward; heading is continuous, not folded at 360°."
    figure, panels = sheet(4.4, "Attitude during navigation", note, rows=3, sharex=True)
    heading_deg = np.rad2deg(np.unwrap(np.deg2rad(np.asarray(heading_deg, dtype=float))))
    for ax, name, angle in zip(panels, ("roll", "pitch", "heading"), (roll_deg, pitch_deg, heading_deg), strict=True):
        ax.plot(*decimate(time_s, angle), color=INK, linewidth=1.0, label="navigated")
        ax.set_ylabel(f"{name} [°]")
        ax.ticklabel_format(useOffset=False)
    panels[2].set_xlabel(TIME_LABEL)
    panels[2].set_xlim(float(time_s[0]), float(time_s[-1]))
    legend_below(figure, *panels)
    return figure


@styled
def attitude_error(*, time_s: np.ndarray, errors_deg: Series) -> Figure:
    """Errors (m, 3) in degrees about north, east and down of each compensation, one panel each."""
    figure, panels = sheet(4.4, "Attitude error", "INS against the attitude of the reference.", rows=3, sharex=True)
    for k, (ax, about) in enumerate(zip(panels, ("about north", "about east", "heading"), strict=True)):
        _traces(ax, time_s, {name: values[:, k] for name, values in errors_deg.items()}, None, {})
        ax.set_ylabel(f"{about} [°]")
    panels[2].set_xlabel(TIME_LABEL)
    legend_below(figure, panels[0])
    return figure


@styled
def activity(
    *,
    time_s: np.ndarray,
    force_mps2: np.ndarray,
    rate_deg_per_s: np.ndarray,
    stretch_s: tuple[float, float],
    navigation_s: tuple[float, float] | None = None,
) -> Figure:
    """Agitation of a recording: deviation of specific force and rate from their local means, (n,), against time.

    `stretch_s` is the stretch used for the alignment.
    """
    note = f"Alignment uses {fixed(stretch_s[0], 0)} to {fixed(stretch_s[1], 0)} s of the recording (shaded)."
    if navigation_s is not None:
        note += f" Navigation runs from {navigation_s[0]:.0f} to {navigation_s[1]:.0f} s."
    figure, (upper, lower) = sheet(3.9, "Quiet stretch found for the alignment", note, rows=2, sharex=True)
    for ax, values, unit, name in (
        (upper, force_mps2, "[m/s²]", "specific force"),
        (lower, rate_deg_per_s, "[°/s]", "angular rate"),
    ):
        positive = np.where(np.asarray(values) > 0.0, values, np.nan)
        ax.plot(*decimate(time_s, positive), color=INK, linewidth=0.8, label="standard deviation")
        if np.isfinite(positive).any() and np.nanmax(positive) > 10.0 * np.nanmin(positive):
            ax.set_yscale("log")  # of less than a decade a logarithmic axis would label nothing
            few = np.nanmax(positive) < FEW_DECADES * np.nanmin(positive)
            ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if few else (1.0,)))
            ax.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
            ax.yaxis.set_minor_formatter(NullFormatter())
        ax.axvspan(*stretch_s, color="#d7e8d4", linewidth=0, zorder=0.4, label="aligned here")
        if navigation_s is not None:
            ax.axvline(navigation_s[0], color=QUIET, linewidth=0.8, linestyle=(0, (4, 2)), label="navigation starts")
        ax.set_ylabel(f"σ of {name}\n{unit}")
    lower.set_xlabel("time in the recording [s]")
    lower.set_xlim(float(time_s[0]), float(time_s[-1]))
    legend_below(figure, upper)
    return figure


def _traces(ax: Axes, time_s, series: Series, bridged, suffix: Mapping[str, str]) -> None:
    """One line a compensation; bridged epochs dotted."""
    points = int(np.clip(3000 / max(len(series), 1), 400, 1000))  # keeps the file small however many lines
    time_s, limit = np.asarray(time_s, dtype=float), _limit(series)
    for name, text in distinct(series).items():
        values = np.asarray(series[name], dtype=float)
        style: dict[str, Any] = {"color": colour(name), "linewidth": 1.8 if is_own(name) else 1.0}
        seen = values if bridged is None else np.where(bridged, np.nan, values)
        beyond = " (goes beyond)" if limit is not None and np.nanmax(np.abs(values)) > limit else ""
        style["label"] = text + suffix.get(name, "") + beyond
        ax.plot(*decimate(time_s, seen, points), **style)
        if bridged is not None and np.any(bridged):
            edge = np.convolve(np.asarray(bridged, dtype=float), np.ones(3), mode="same") > 0  # joins the solid line
            ax.plot(*decimate(time_s, np.where(edge, values, np.nan), points), **style, linestyle=(0, (1, 1.2)))
    ax.axhline(0.0, color=QUIET, linewidth=0.6, zorder=1)
    ax.set_xlim(float(time_s[0]), float(time_s[-1]))
    if limit is not None:
        ax.set_ylim(-limit, limit)


def _sizes(series: Series) -> dict[str, float]:
    curves = {name: np.asarray(one, dtype=float) for name, one in series.items()}
    return {name: float(np.nanmax(np.abs(one))) for name, one in curves.items() if np.isfinite(one).any()}


def _largest(series: Series) -> float:
    """The largest size that is drawn of any curve."""
    return _limit(series) or max(_sizes(series).values(), default=0.0)


def _limit(series: Series) -> float | None:
    """Where an axis is cut because a curve dwarfs the main ones and would leave them flat; None where none does."""
    sizes = _sizes(series)
    kept = in_scale(sizes)
    return ROOM * max(sizes[name] for name in kept) if len(kept) < len(sizes) else None


def _rates_and_schuler(ax: Axes, nmi: float) -> None:
    """Lines of 0.8 and 1 nmi/h, where they lie among the curves, and marks of the Schuler period; `nmi` on the axis."""
    (begin_s, end_s), top = ax.get_xlim(), ax.get_ylim()[1]
    _schuler(ax)
    for rate in RATES_NMI_PER_H:
        if 0.05 * top < rate * nmi * end_s / HOUR < 20.0 * top:
            times = np.linspace(begin_s, end_s, 50)
            style = {"color": QUIET, "linewidth": 0.8, "linestyle": (0, (5, 3)) if rate == 1.0 else (0, (2, 2))}
            ax.plot(times, rate * nmi * times / HOUR, **style, zorder=1.5, label=f"{rate:g} nmi/h")


def _schuler(ax: Axes) -> None:
    """A mark at each Schuler period."""
    for k in range(1, int(ax.get_xlim()[1] // SCHULER_PERIOD_S) + 1):
        label = "Schuler period, 84.4 min" if k == 1 else "_"
        ax.axvline(k * SCHULER_PERIOD_S, color=QUIET, linewidth=0.6, linestyle=(0, (1, 3)), zorder=1.5, label=label)


def _second_axis(ax: Axes, metres: float, side: str = "") -> None:
    """The same in km on the right; 1 on the left is so many `metres`."""
    right = ax.secondary_yaxis("right", functions=(lambda y: y * metres / KM, lambda y: y * KM / metres))
    right.set_ylabel(f"{side} [km]".strip())
    right.spines["right"].set_visible(True)


def _window(time_s: np.ndarray) -> str:
    return f"{time_s[0]:.0f} to {time_s[-1]:.0f}"


def _position_note(reference: str, outages: Spans) -> str:
    note = f"One flight, INS minus {reference}." if reference == "GPS" else f"INS minus {reference}."
    return note + (" Dotted: bridged by regression over a GPS outage." if len(outages) else "")
