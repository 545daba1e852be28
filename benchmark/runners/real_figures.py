"""Figures of the real recordings: what they show without an error model, and the answer of the tool beside it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from benchmark.runners.figures import BAD, GOOD, NAMED
from benchmark.runners.real_studies import HANDLED_S, Z95
from benchmark.scores import independent
from benchmark.worlds.earth import W
from benchmark.worlds.into_data import DEG_PER_H
from benchmark.worlds.recorded import GYRO, Recorded
from ins_eval.figures.style import INK, QUIET, legend_below, sheet, styled
from ins_eval.report.diagnosis_words import alike

CAPTIONS = {
    "delay": "A scan of delays without navigation, and the delay that diagnose names.",
    "temperature": "Means of 20 s against temperature, without navigation, and the slope that diagnose names.",
    "rate": "Mean rates of the gyros at rest, without navigation.",
    "output": "Output of the accelerometer, and its temperature.",
}


def of(name: str, recorded: Recorded, studies: Sequence[dict]) -> dict[str, Figure]:
    """The figures of a recording by name; the first study is of the recording as it is."""
    effects = (studies[0]["answer"] or {}).get("effects") or () if studies else ()
    if name in ("plane", "quadcopter"):
        return {f"{name}_delay": delay(independent.velocity_scan(recorded), effects, "gps.time_offset",
                                       "changes of GPS velocity over 0.4 s against the specific force")}  # fmt: skip
    if name == "drive":
        return {"drive_delay": delay(independent.rate_scan(recorded), effects, "reference.time_offset",
                                     "turn rates of the better navigator against the gyros")}  # fmt: skip
    if name == "warm-up":
        return {"warm-up_temperature": temperature(independent.temperature_lines(recorded, HANDLED_S), effects)}
    if name == "laser":
        return {"laser_rate": rate(recorded)}
    return {f"{name}_output": output(recorded)}


@styled
def delay(scan: independent.Scan, effects: Sequence[dict], name: str, words: str) -> Figure:
    """RMS against the delay, its least value, and the interval of the answer."""
    note = f"RMS of {words}, with the time stamps corrected for the delay. Its minimum needs no error model."
    figure, ax = sheet(3.0, "How late are the time stamps?", note)
    ax.plot(scan.delay_s, scan.rms, color=INK)
    best, least, most = alike(scan.best_s, (scan.best_s - Z95 * scan.sigma_s, scan.best_s + Z95 * scan.sigma_s))
    ax.axvline(scan.best_s, color=NAMED, linestyle="--", label=f"minimum: {best} s [{least}, {most}]")
    for one in effects:
        if one["name"] == name:
            low, high = one["parameters"]["interval95"]
            value, *ends = alike(one["parameters"]["value"], (low, high))
            ax.axvspan(low, high, color=GOOD, alpha=0.35, label=f"diagnose: {value} s [{', '.join(ends)}]")
    ax.set(xlabel="delay [s]", ylabel=f"RMS [{scan.unit}]")
    legend_below(figure, ax)
    return figure


@styled
def temperature(lines: Sequence[independent.Line], effects: Sequence[dict]) -> Figure:
    """Six channels against temperature with the independent line and that of the answer."""
    note = (
        f"Means of {independent.MEAN_S:g} s less their mean. Dashed: straight line through them. Green: the slope that "
        "diagnose names, where it names one."
    )
    figure, ax = sheet(5.2, "Does the offset follow the temperature?", note)
    figure.delaxes(ax)
    axes = figure.subplots(2, 3)
    for ax, one in zip(axes.ravel(), lines, strict=True):
        warm = one.temperature_c - one.temperature_c.mean()
        values = one.values - one.values.mean()
        ax.plot(one.temperature_c, values, "o", color=QUIET, markersize=2.5)
        ax.plot(one.temperature_c, one.slope * warm, "--", color=INK, linewidth=1.0)
        for effect in effects:
            if (effect["name"], effect["axis"]) == (f"{one.name}.bias_temperature", one.axis):
                ax.plot(one.temperature_c, effect["parameters"]["value"] * warm, color=GOOD, linewidth=1.4)
        ax.set_title(f"{one.name} {one.axis} [{one.unit}]", fontsize=8)
    for ax in axes[1]:
        ax.set_xlabel("temperature [°C]")
    return figure


@styled
def rate(recorded: Recorded) -> Figure:
    """Magnitude of the mean rate of three gyros over stretches of a minute, and the Earth's."""
    note = "Magnitude of the mean rate of the three gyros in each minute. The line: rotation of the Earth, WGS-84."
    figure, ax = sheet(2.8, "Does the Earth turn?", note)
    rows = round(60.0 / float(np.median(recorded.step_s)))
    n = recorded.time_s.size // rows * rows
    sums = recorded.triad(GYRO)[:n].reshape(-1, rows, 3).sum(axis=1)
    mean = np.linalg.norm(sums, axis=1) / recorded.step_s[:n].reshape(-1, rows).sum(axis=1) / DEG_PER_H
    ax.plot(recorded.time_s[rows - 1 : n : rows] / 60.0, mean, "o", color=NAMED, markersize=3.5)
    ax.axhline(W / DEG_PER_H, color=BAD, linewidth=1.0)
    ax.set(xlabel="time [min]", ylabel="rate [deg/h]", ylim=(0.0, 1.3 * max(float(mean.max()), W / DEG_PER_H)))
    return figure


@styled
def output(recorded: Recorded) -> Figure:
    """Output and temperature over time."""
    note = "Means over 1 s of the vertical axis, as recorded, and the temperature of the sensor."
    figure, ax = sheet(2.8, "What the chamber recording shows", note)
    table = recorded.tables["chamber"]
    ax.plot(table["time_s"], table["output"] - table["output"].mean(), color=INK, linewidth=0.8)
    ax.set(xlabel="time [s]", ylabel="output less its mean [mg]")
    warm = ax.twinx()
    warm.plot(table["time_s"], table["temperature_c"], color=BAD, linewidth=1.0)
    warm.set_ylabel("temperature [°C]", color=BAD)
    warm.grid(visible=False)
    return figure
