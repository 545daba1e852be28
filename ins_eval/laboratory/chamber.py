"""The virtual laboratory: the four-point test of an accelerometer in a thermal chamber.

Steps 1-6 of Paper A, section 3.1. An index head holds the accelerometer so that its input axis feels +1, 0, -1 and
0 g. In each position: soak at 22 degC; down to -60 degC, up to +70 degC, back to 22 degC at one ramp, waiting at
each whole degree; then the next position; then all of it at the next ramp. Each position of each ramp is one
uninterrupted run, switched on afresh.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ins_eval.accelerometer import Accelerometer, ManyAccelerometers, SlowErrors, ThermalRun
from ins_eval.errors import UsageError
from ins_eval.output_equation import SENSOR_AXES
from ins_eval.recording import ChamberReadings
from ins_eval.thermal import Thermometer, lagged
from ins_eval.units import HOUR, MINUTE

# Specific force in g along input, pendulous and output axis. The positions are told apart by what the input axis
# feels, since the angles printed with the paper's eqs (3) and (4) contradict its Fig. 4. The index head turns about
# the output axis, which lies level; standard gravity.
POSITIONS = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0))


def _sourced(default: Any, source: str) -> Any:
    """A field with the source of its default value, as ``ins-eval presets`` prints it."""
    return field(default=default, metadata={"source": source})


class _Schedule(NamedTuple):
    """What all units share: one thermal run and the rows of its readings for each ramp, and the ready columns."""

    runs: tuple[ThermalRun, ...]
    recorded: tuple[slice, ...]
    time_s: np.ndarray
    run: np.ndarray
    input_g: np.ndarray
    rate_c_per_min: np.ndarray
    temperature_c: np.ndarray
    air_c: np.ndarray


@dataclass(frozen=True)
class Chamber:
    """A thermal chamber and its four-point programme.

    The surface of the accelerometer follows the air by a first-order lag and is warmer than it by the
    accelerometer's own heat (Paper A reads -54 to +81 degC in a chamber from -60 to +70 degC). A reading is the
    mean output over one interval; it is stamped in the middle of it, where the thermometer is read too.
    """

    rates_c_per_min: tuple[float, ...] = _sourced((0.3, 0.5, 0.7, 0.9), "Paper A, section 3.1, steps 2 and 6")
    soak_c: float = _sourced(22.0, "Paper A, section 3.1, step 1")
    soak_s: float = _sourced(120.0 * MINUTE, "Paper A, section 3.1, step 1")
    coldest_c: float = _sourced(-60.0, "Paper A, section 3.1, step 2")
    hottest_c: float = _sourced(70.0, "Paper A, section 3.1, step 3")
    dwell_s: float = _sourced(180.0, "Paper A, section 3.1, steps 2-4: at each whole degree; 0: a steady ramp")
    reading_s: float = _sourced(60.0, "assumed")
    surface_lag_s: float = _sourced(300.0, "assumed")
    self_heating_c: float = _sourced(8.0, "Paper A, section 3.1: surface -54 to 81 degC in air of -60 to 70 degC")
    thermometer: Thermometer = _sourced(
        Thermometer(), "DS18B20 (Paper A, section 3.1): 12-bit step of its data sheet; lag and period assumed"
    )

    def __post_init__(self) -> None:
        if not self.rates_c_per_min or min(self.rates_c_per_min) <= 0.0:
            raise UsageError(f"chamber: rates_c_per_min is {self.rates_c_per_min}; give sizes of ramps, all above 0")
        if not self.coldest_c < self.soak_c < self.hottest_c:
            raise UsageError(
                f"chamber: soak_c is {self.soak_c:g}, expected between coldest_c = {self.coldest_c:g} "
                f"and hottest_c = {self.hottest_c:g}"
            )
        if min(self.soak_s, self.dwell_s, self.self_heating_c) < 0.0 or min(self.reading_s, self.surface_lag_s) <= 0.0:
            raise UsageError("chamber: a duration, lag or self-heating is negative, or reading_s or surface_lag_s is 0")

    def profile(self, rate_c_per_min: float) -> tuple[np.ndarray, np.ndarray]:
        """Air temperature of one run: corners at times (m,) in s and temperatures (m,) in degC, straight between."""
        time_s, air_c = [0.0], [self.soak_c]
        if self.soak_s > 0.0:
            time_s.append(self.soak_s)
            air_c.append(self.soak_c)
        for goal in (self.coldest_c, self.hottest_c, self.soak_c):
            for stop in _whole_degrees(air_c[-1], goal) if self.dwell_s > 0.0 else (goal,):
                time_s.append(time_s[-1] + abs(stop - air_c[-1]) / rate_c_per_min * MINUTE)
                air_c.append(stop)
                if self.dwell_s > 0.0:
                    time_s.append(time_s[-1] + self.dwell_s)
                    air_c.append(stop)
        return np.array(time_s), np.array(air_c)

    def run_h(self, rate_c_per_min: float) -> float:
        """Duration of one run in hours, soak and dwells included."""
        return float(self.profile(rate_c_per_min)[0][-1] / HOUR)

    def mean_rate_c_per_min(self, rate_c_per_min: float) -> float:
        """Temperature travelled in the time it takes, dwells included, soak not."""
        time_s, air_c = self.profile(rate_c_per_min)
        return float(np.abs(np.diff(air_c)).sum() / (time_s[-1] - self.soak_s) * MINUTE)

    def thermal_run(self, rate_c_per_min: float) -> ThermalRun:
        """True surface temperature of one run, in the middle of each reading, from switch-on (start of the soak)."""
        corners_s, air_c = self.profile(rate_c_per_min)
        middle_s = self.reading_s * (np.arange(int(corners_s[-1] // self.reading_s)) + 0.5)
        time_s = np.union1d(corners_s, middle_s)  # the lag is exact where the air is straight between its points
        target_c = np.interp(time_s, corners_s, air_c) + self.self_heating_c
        surface_c = lagged(time_s, target_c, self.surface_lag_s, start=self.soak_c)
        return ThermalRun(middle_s, surface_c[np.searchsorted(time_s, middle_s)], "chamber")

    @property
    def air_c(self) -> np.ndarray:
        """Air temperature of the chamber at each row of `measure`, (n,) in degC."""
        return _schedule(self).air_c

    def measure(
        self, accelerometer: Accelerometer | ManyAccelerometers, streams: Any, unit_id: str = ""
    ) -> ChamberReadings:
        """Readings of one accelerometer over all ramps and positions, from the end of each soak on.

        `streams` is the node of the instrument; each run is a fresh switch-on with draws of its own. The columns
        other than `output` are shared between units and read-only. Of m accelerometers at once, with `ManyStreams`,
        `output` is (n, m).
        """
        schedule = _schedule(self)
        output = []
        for index, (run, rows) in enumerate(zip(schedule.runs, schedule.recorded, strict=True)):
            for position, force in enumerate(POSITIONS):
                node = streams.at("chamber", len(POSITIONS) * index + position)
                slow = SlowErrors(*(value[rows] for value in accelerometer.slow(run, node)))
                interval_s = np.full(len(slow.scale), self.reading_s)
                force_b = np.empty(3)
                force_b[list(SENSOR_AXES[accelerometer.axis])] = force
                output.append(accelerometer.counts(interval_s, force_b, slow, node) / self.reading_s)
        return ChamberReadings(
            schedule.time_s,
            schedule.run,
            schedule.input_g,
            schedule.rate_c_per_min,
            schedule.temperature_c,
            np.concatenate(output),
            unit_id,
            axis=accelerometer.axis,
        )


@functools.lru_cache(maxsize=4)
def _schedule(chamber: Chamber) -> _Schedule:
    runs = tuple(chamber.thermal_run(rate) for rate in chamber.rates_c_per_min)
    first = math.ceil(chamber.soak_s / chamber.reading_s)
    columns: list[tuple[np.ndarray, ...]] = []
    start_s = 0.0
    for rate, run in zip(chamber.rates_c_per_min, runs, strict=True):
        time_s = run.time_s[first:]
        reading_c = chamber.thermometer.read(run.time_s, run.temperature_c)[first:]
        air_c = np.interp(time_s, *chamber.profile(rate))
        for force in POSITIONS:
            same = np.ones(time_s.size)
            columns.append((start_s + time_s, same * len(columns), same * force[0], same * rate, reading_c, air_c))
            start_s += run.time_s.size * chamber.reading_s
    time_s, number, *further = (np.concatenate(column) for column in zip(*columns, strict=True))
    shared = (time_s, number.astype(np.int64), *further)
    for column in shared:
        column.setflags(write=False)
    return _Schedule(runs, (slice(first, None),) * len(runs), *shared)


def _whole_degrees(start_c: float, goal_c: float) -> list[float]:
    """Whole degrees that are passed from `start_c` (left out) to `goal_c` (always the last)."""
    if goal_c < start_c:
        return [-stop for stop in _whole_degrees(-start_c, -goal_c)]
    return [float(d) for d in range(math.floor(start_c) + 1, math.ceil(goal_c))] + [goal_c]
