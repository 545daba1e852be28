"""Figures of a recording that was compared with its reference."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from ins_eval import figures
from ins_eval.analysis.compare import RecordingComparison
from ins_eval.channels import Windows
from ins_eval.units import DEG, DEG_PER_H, UG

SHOWN_EPOCHS = 300  # of the stretch that is drawn closely
COARSE_GYRO, COARSE_ACCELEROMETER = 0.01 * DEG, 1e-3  # rad/s, m/s^2: from here on in °/s and m/s²


class DisplayUnit(NamedTuple):
    """A readable unit; a value in SI divided by `size` is in it."""

    text: str
    size: float


def units(found: RecordingComparison) -> dict[str, DisplayUnit]:
    """The unit of the differences of each sensor, by their size."""
    largest = {
        sensor: max(max(abs(one.fitted.mean_difference.value), one.fitted.rms_after) for one in triad)
        for sensor, triad in found.channels.items()
    }
    coarse = largest["accelerometer"] >= COARSE_ACCELEROMETER
    return {
        "gyro": DisplayUnit("°/s", DEG) if largest["gyro"] >= COARSE_GYRO else DisplayUnit("°/h", DEG_PER_H),
        "accelerometer": DisplayUnit("m/s²", 1.0) if coarse else DisplayUnit("µg", UG),
    }


def comparison_figures(comparison: RecordingComparison) -> dict[str, Figure]:
    """Every figure by its name."""
    close, windows, fitted = comparison.close, comparison.windows, comparison.fitted
    size = np.repeat([unit.size for unit in units(comparison).values()], 3)
    shown = _liveliest(close)
    names = tuple(unit.text for unit in units(comparison).values())
    drawn = {
        "sensor_signals": figures.sensor_signals(
            time_s=close.time_s[shown],
            recorded=close.recorded[shown] / size,
            implied=close.implied[shown] / size,
            units=names,
            window_s=close.length_s,
        ),
        "sensor_residuals": figures.sensor_residuals(
            time_s=windows.time_s,
            before=windows.difference / size,
            after=np.column_stack([channel.remaining for channel in fitted]) / size,
            units=names,
            window_s=windows.length_s,
        ),
    }
    if any(channel.terms[channel.axis] for channel in fitted):
        own = np.column_stack([channel.remaining + channel.level_and_slope(windows) for channel in fitted])
        drawn["sensor_scatter"] = figures.sensor_scatter(
            implied=windows.implied / size,
            difference=own / size,
            fitted=[
                (channel.bias.value / unit, channel.terms[channel.axis].value) if channel.terms[channel.axis] else None
                for channel, unit in zip(fitted, size, strict=True)
            ],
            units=names,
            window_s=windows.length_s,
        )
    return drawn


def _liveliest(windows: Windows) -> slice:
    """The stretch of at most `SHOWN_EPOCHS` windows in which the gyros move most."""
    count = min(SHOWN_EPOCHS, windows.time_s.size)
    power = np.square(windows.implied[:, :3]).sum(axis=1)
    total = np.concatenate([[0.0], np.cumsum(power)])
    first = int(np.argmax(total[count:] - total[:-count]))
    return slice(first, first + count)
