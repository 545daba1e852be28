"""Four-point calibration: scale factor and bias from an accelerometer at +1 g, -1 g and twice 0 g."""

from __future__ import annotations

import functools
from collections import defaultdict
from dataclasses import dataclass

import numpy as np

from ins_eval.errors import DataRefused
from ins_eval.recording import ChamberReadings
from ins_eval.thermal import filtered_rate

RATE_FILTER_S = 180.0
# The rate filter starts at rest in every run. Until three of its time constants have passed more than 5 % of
# that start is left in the rate, so those points would pull on every coefficient of the rate. Whatever else was
# recorded of a soak is kept: an instrument that stands still and warms up is what every flight begins with.
SETTLING_TIME_CONSTANTS = 3.0
POSITION_TOLERANCE_G = 0.1  # an index head stands within a few degrees, and local gravity within 0.5 %
TEMPERATURE_SPREAD_C = 5.0  # four runs that differ by more have not followed the same programme

_NEEDED = {1: 1, -1: 1, 0: 2}  # position in g: runs needed


@dataclass(frozen=True, eq=False)
class FourPoint:
    """Scale factor and bias at each instant of the temperature programme, all (n,).

    `temperature_c` is the mean reading of the positions and `rate_c_per_min` its filtered rate; `scale` is K1
    in pulse/(g s), `bias_ug` is K0 in micro-g, both (n, m) of m units in one programme; `ramp_c_per_min` is the
    commanded rate (its magnitude) and `elapsed_s` the time since the start of the run.
    """

    temperature_c: np.ndarray
    rate_c_per_min: np.ndarray
    scale: np.ndarray
    bias_ug: np.ndarray
    ramp_c_per_min: np.ndarray
    elapsed_s: np.ndarray


@dataclass(frozen=True, eq=False)
class Run:
    """One uninterrupted stay in one position; arrays (n,)."""

    number: int
    ramp_c_per_min: float  # commanded, its magnitude
    position: int  # nearest whole g
    input_g: float
    elapsed_s: np.ndarray
    temperature_c: np.ndarray
    output: np.ndarray


@functools.lru_cache(maxsize=8)  # by identity of the readings: every model of an instrument asks for the same points
def four_point(chamber: ChamberReadings, rate_filter_s: float = RATE_FILTER_S) -> FourPoint:
    """Scale factor and bias of every instant that all four positions share.

    K1 = (A(+1g) - A(-1g)) / (f(+1g) - f(-1g)),

    K0 = (A(0g,a) + A(0g,b)) / (2 K1) - (f(0g,a) + f(0g,b)) / 2

    A: output in pulse/s; f: specific force in g, so that K1 = (A(+1g) - A(-1g)) / 2 and K0 = (A(0g,a) +
    A(0g,b)) / (2 K1) where it is exactly +1, -1 and 0. Positions are known by specific force, never by the angle
    of the index head: with the angles that Paper A prints its eqs (3), (4) and (13) give -K1/2, K0 - 1/2 and 0.
    The 0 g pair keeps K0 free of the quadratic coefficient K2.

    Readings are matched by the time since the start of their run. Runs in the same position and with the same
    commanded rate are averaged.

    Raises: DataRefused where a position is missing or the runs of one rate cannot be matched.
    Source: Paper A, section 3.1, steps 1-6 and eqs (13), (14).
    """
    by_ramp: dict[float, list[Run]] = defaultdict(list)
    for run in runs_of(chamber):
        by_ramp[run.ramp_c_per_min].append(run)
    parts = [_points_of_ramp(ramp, runs, rate_filter_s) for ramp, runs in sorted(by_ramp.items())]
    return FourPoint(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def settled(elapsed_s: np.ndarray, rate_filter_s: float = RATE_FILTER_S) -> np.ndarray:
    """Which readings (n,) of a run come after the rate filter has forgotten its start."""
    return elapsed_s >= SETTLING_TIME_CONSTANTS * rate_filter_s


def runs_of(chamber: ChamberReadings) -> list[Run]:
    """The runs of the readings in their order. Raises: DataRefused where they cannot be separated."""
    columns = {
        name: np.asarray(getattr(chamber, name), dtype=float)
        for name in ("time_s", "run", "input_g", "rate_c_per_min", "temperature_c", "output")
    }
    if not columns["time_s"].size:
        raise DataRefused("chamber: it has no readings; a four-point calibration needs four positions")
    for name, column in columns.items():
        if not np.isfinite(column).all():
            row = int(np.flatnonzero(~np.isfinite(column))[0])
            raise DataRefused(f"chamber: row {row}: {name} is {column[row]}; every reading must be a number")

    starts = np.concatenate(([0], np.flatnonzero(np.diff(columns["run"])) + 1, [columns["run"].size]))
    found, numbers = [], set()
    for begin, end in zip(starts[:-1], starts[1:], strict=True):
        time, _, force, ramp, temperature, output = (column[begin:end] for column in columns.values())
        number = int(columns["run"][begin])
        if number in numbers:
            raise DataRefused(
                f"chamber: row {begin}: run {number} goes on after another run; "
                f"a run is one uninterrupted stay, so number the second part apart"
            )
        numbers.add(number)
        if np.ptp(force) > POSITION_TOLERANCE_G or abs(force[0] - round(force[0])) > POSITION_TOLERANCE_G:
            raise DataRefused(
                f"chamber: run {number}: input_g goes from {force.min():.3g} to {force.max():.3g}; "
                f"expected one position of +1, 0 or -1 g, within {POSITION_TOLERANCE_G} g"
            )
        if (np.diff(time) <= 0).any():
            raise DataRefused(f"chamber: run {number}: time_s does not increase; sort the readings of a run by time")
        commanded = round(float(np.abs(ramp).max()), 6)
        found.append(Run(number, commanded, round(force[0]), float(force.mean()), time - time[0], temperature, output))
    return found


def _points_of_ramp(ramp: float, runs: list[Run], rate_filter_s: float) -> tuple[np.ndarray, ...]:
    """The columns of `FourPoint` for the runs of one commanded rate."""
    where = f"chamber: commanded rate {ramp:g} degC/min"
    positions = {position: [run for run in runs if run.position == position] for position in _NEEDED}
    for position, needed in _NEEDED.items():
        if len(positions[position]) < needed:
            raise DataRefused(
                f"{where}: {len(positions[position])} of the {needed} run(s) at {position:+d} g found; "
                f"a four-point calibration needs +1 g, -1 g and twice 0 g at every rate"
            )
    runs = [run for of_position in positions.values() for run in of_position]
    elapsed = _shared_time(where, runs)
    temperatures = np.array([run.temperature_c for run in runs])
    spread = np.ptp(temperatures, axis=0)
    if spread.max() > TEMPERATURE_SPREAD_C:
        raise DataRefused(
            f"{where}: {elapsed[spread.argmax()]:.0f} s after the start the positions differ by "
            f"{spread.max():.1f} degC; all four must follow the same programme, to {TEMPERATURE_SPREAD_C:g} degC"
        )

    def mean_of(position: int) -> tuple[np.ndarray, float]:
        chosen = positions[position]
        return sum(run.output for run in chosen) / len(chosen), float(np.mean([run.input_g for run in chosen]))

    (up, force_up), (down, force_down), (level, force_level) = mean_of(1), mean_of(-1), mean_of(0)
    scale = (up - down) / (force_up - force_down)
    if scale.min() <= 0:
        raise DataRefused(
            f"{where}: the output at +1 g is not above that at -1 g; "
            f"check the sign of input_g, which is the specific force along the input axis"
        )
    temperature = temperatures.mean(axis=0)
    # the filter is linear, so the rate of the mean reading is the mean of the rates
    rate = filtered_rate(elapsed, temperature, rate_filter_s)
    keep = settled(elapsed, rate_filter_s)
    if not keep.any():
        raise DataRefused(
            f"{where}: the runs last {elapsed[-1]:.0f} s; the rate of temperature needs "
            f"{SETTLING_TIME_CONSTANTS * rate_filter_s:.0f} s to settle, so record longer"
        )
    columns = (temperature, rate, scale, 1e6 * (level / scale - force_level), np.full(elapsed.size, ramp), elapsed)
    return tuple(column[keep] for column in columns)


def _shared_time(where: str, runs: list[Run]) -> np.ndarray:
    """Time since the start of the run, where all runs have it in common."""
    first = runs[0]
    half_step = 0.5 * np.median(np.diff(first.elapsed_s)) if first.elapsed_s.size > 1 else 0.0
    for run in runs[1:]:
        if run.elapsed_s.size != first.elapsed_s.size:
            raise DataRefused(
                f"{where}: run {first.number} has {first.elapsed_s.size} readings and run {run.number} has "
                f"{run.elapsed_s.size}; the four positions must follow the same programme, so cut them to equal length"
            )
        apart = np.flatnonzero(np.abs(run.elapsed_s - first.elapsed_s) > half_step)
        if apart.size:
            raise DataRefused(
                f"{where}: reading {apart[0]} comes {first.elapsed_s[apart[0]]:.1f} s into run {first.number} "
                f"but {run.elapsed_s[apart[0]]:.1f} s into run {run.number}; "
                f"the four positions must be read at the same times"
            )
    return first.elapsed_s
