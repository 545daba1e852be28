"""The temperature that the elements had, as the readings of the thermometer tell it (`reading`)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ins_eval.effects.reading import thermometers, told
from ins_eval.recording import ChamberReadings, Recording
from ins_eval.recording.belief import AccelerometerBelief
from ins_eval.recording.form.names import AIR
from ins_eval.thermal import filtered_rate, lagged, thermometer_step

GRID_S = 1.0
LAGS_S = np.concatenate([[0.0], np.geomspace(10.0, 3600.0, 25)])  # of an element behind the chamber's air
GOOD_FIT_STEPS = 2.0


@dataclass(frozen=True, eq=False)
class SmoothedTemperature:
    """Smoothed temperature (n, 3) in degC of the three accelerometers at `time_s` (n,), and its rate.

    `runs` are the rows of each uninterrupted stretch, in each of which memory begins anew: all of a flight, each run of
    a chamber. `filter_s` is the time constant of the filter that defines the rate.
    """

    time_s: np.ndarray
    smooth_c: np.ndarray
    rate_c_per_min: np.ndarray
    reference_c: float
    filter_s: float = 180.0
    runs: tuple[slice | np.ndarray, ...] = (slice(None),)

    def at(self, values: np.ndarray, axis: int):
        """The function of time that goes through `values` (n, 3) of this axis."""
        return lambda time_s: np.interp(time_s, self.time_s, values[:, axis])

    def column(self, axis: int) -> int:
        """The first column that holds the temperature of this axis: a common thermometer stands in all three."""
        return next(k for k in range(axis + 1) if np.array_equal(self.smooth_c[:, k], self.smooth_c[:, axis]))

    def in_runs(self, of_run, axis: int) -> np.ndarray:
        """`of_run` (time_s, smooth_c) of each run of an axis, put together, (n,)."""
        out = np.empty(self.time_s.size)
        for rows in self.runs:
            out[rows] = of_run(self.time_s[rows], np.ascontiguousarray(self.smooth_c[rows, axis]))
        return out


def temperature(recording: Recording) -> SmoothedTemperature | None:
    """Temperature from the start of the recording on, so that memory begins where the convention says; or None."""
    reading = recording.imu.temperature_c
    if reading is None:
        return None
    time_s = recording.imu.time_s
    grid = np.arange(time_s[0], time_s[-1] + 0.5 * GRID_S, GRID_S)
    belief = recording.belief.accelerometer
    smooth = [of.at(grid) for of in thermometers(recording)]
    rates = [filtered_rate(grid, column, belief.rate_filter_s) for column in smooth]
    return _three(grid, smooth, rates, belief)


def chamber_temperature(readings: ChamberReadings, belief: AccelerometerBelief) -> SmoothedTemperature:
    """Temperature of an accelerometer in a chamber, each run for itself.

    Where the temperature of the chamber's air was recorded, it is that of a body that follows it with a lag.
    """
    runs = tuple(np.flatnonzero(readings.run == run) for run in dict.fromkeys(readings.run.tolist()))
    smooth, rate = np.empty(readings.time_s.size), np.empty(readings.time_s.size)
    for rows in runs:
        smooth[rows] = _smooth(readings, rows)
        rate[rows] = filtered_rate(readings.time_s[rows], smooth[rows], belief.rate_filter_s)
    return _three(readings.time_s, [smooth], [rate], belief, runs)


def _three(time_s, columns, rates, belief: AccelerometerBelief, runs=(slice(None),)) -> SmoothedTemperature:
    smooth, rate = (np.column_stack([of[k % len(of)] for k in range(3)]) for of in (columns, rates))
    return SmoothedTemperature(time_s, smooth, rate, belief.reference_temperature_c, belief.rate_filter_s, runs)


def _smooth(readings: ChamberReadings, rows: np.ndarray) -> np.ndarray:
    """The reading of one run without its steps and noise, (n,) degC."""
    time_s, reading_c = readings.time_s[rows], readings.temperature_c[rows]
    air = readings.further.get(AIR)
    if air is not None:
        fits = [lagged(time_s, air[rows], lag) if lag else np.array(air[rows]) for lag in LAGS_S]
        fits = [fit + np.mean(reading_c - fit) for fit in fits]
        best = min(fits, key=lambda fit: float(np.std(reading_c - fit)))
        if np.std(reading_c - best) < GOOD_FIT_STEPS * max(thermometer_step(reading_c), 0.01):
            return best
    return told(time_s, reading_c).at(time_s)
