"""Loops of the scale factor against temperature: the magnet's own, and what else opens them in the chamber.

The magnet (`accelerometer.magnet_hysteresis`) is led through turning points of temperature, one after another: full
loops, minor loops inside them, at any ramp. Fig. 1 of Paper A (Sensors 2021, 21, 294) shows loops of this kind for
another magnet, over the field instead of the temperature, as an illustration; only the kind can be compared.

Falling minus rising scale factor at one reading of the thermometer comes from three things that are separated by
switching them off: the magnet, the rate terms of eq. (11), and a thermometer that reads the surface late.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ins_eval.accelerometer import Absent, Accelerometer, Population, ThermalRun
from ins_eval.accelerometer.magnet_hysteresis import MagnetHysteresis
from ins_eval.accelerometer.scale_polynomial import RATE_POWER
from ins_eval.errors import UsageError
from ins_eval.laboratory.chamber import Chamber
from ins_eval.streams import Streams
from ins_eval.units import MINUTE

FULL_LOOP_C = (22.0, -60.0, 70.0, -60.0)  # from the soak of Paper A's step 1 to its ends, and once around
STEP_C = 0.25  # between points of a loop
WINDOW_C = 2.0  # readings this close to a temperature decide the scale factor at it, by a straight line


class HysteresisLoop(NamedTuple):
    """The magnet's part of the scale factor along a path of temperature, (n,) each."""

    time_s: np.ndarray
    temperature_c: np.ndarray
    scale_ppm: np.ndarray


class Opening(NamedTuple):
    """Falling minus rising scale factor at one reading in ppm of gamma, (m,) each: one for each ramp of a chamber.

    `magnet_ppm`, `rate_ppm` and `reading_ppm` add up to `total_ppm`.
    """

    ramp_c_per_min: np.ndarray
    total_ppm: np.ndarray
    magnet_ppm: np.ndarray
    rate_ppm: np.ndarray
    reading_ppm: np.ndarray


def loop(
    turns_c: Sequence[float] = FULL_LOOP_C,
    magnet: MagnetHysteresis | None = None,
    half_opening_ppm: float | None = None,
    ramp_c_per_min: float = 0.5,
) -> HysteresisLoop:
    """Lead a fresh magnet through the temperatures `turns_c`, the first of which is where it starts.

    By default the magnet of the population jb-kt8 with its median amplitude.
    """
    if len(turns_c) < 2 or np.any(np.diff(turns_c) == 0.0) or ramp_c_per_min <= 0.0:
        raise UsageError(
            f"magnet: turns_c = {tuple(turns_c)}, ramp_c_per_min = {ramp_c_per_min:g}; "
            "give two or more temperatures, neighbours different, and a ramp above 0"
        )
    magnet = magnet or Population.load()["magnet_hysteresis"]
    legs = [
        np.linspace(start, end, max(int(np.ceil(abs(end - start) / STEP_C)), 1) + 1)
        for start, end in zip(turns_c[:-1], turns_c[1:], strict=True)
    ]
    temperature_c = np.concatenate([legs[0][:1], *(leg[1:] for leg in legs)])
    travelled_c = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(temperature_c)))))
    run = ThermalRun(travelled_c / ramp_c_per_min * MINUTE, temperature_c, "chamber")
    amplitude = magnet.half_opening_ppm if half_opening_ppm is None else half_opening_ppm
    # the magnet draws nothing during a run
    ppm = magnet.contribution(amplitude, run, Streams(0)).scale_ppm
    return HysteresisLoop(run.time_s, run.temperature_c, np.asarray(ppm))


def opening(accelerometer: Accelerometer, chamber: Chamber | None = None, at_c: float = 22.0) -> Opening:
    """What opens the loop of an accelerometer's scale factor in the chamber, at the reading `at_c`.

    Without what is redrawn at each switch-on: the opening is a property of the accelerometer and the programme.
    Raises: UsageError where a branch does not pass through `at_c`.
    """
    chamber = chamber or Chamber()
    whole = _with_only(accelerometer, "scale_polynomial", "magnet_hysteresis")
    without_magnet = _with_only(accelerometer, "scale_polynomial")
    polynomial = np.where(RATE_POWER > 0, 0.0, accelerometer.units["scale_polynomial"])
    neither = replace(without_magnet, units={**accelerometer.units, "scale_polynomial": polynomial})
    total, no_magnet, no_rate = (
        np.array([_opening_ppm(unit, chamber, ramp, at_c) for ramp in chamber.rates_c_per_min])
        for unit in (whole, without_magnet, neither)
    )
    ramps = np.array(chamber.rates_c_per_min)
    return Opening(ramps, total, total - no_magnet, no_magnet - no_rate, no_rate)


def _with_only(accelerometer: Accelerometer, *names: str) -> Accelerometer:
    effects = tuple(e if e.name in names or isinstance(e, Absent) else Absent(of=e) for e in accelerometer.effects)
    return replace(accelerometer, effects=effects)


def _opening_ppm(accelerometer: Accelerometer, chamber: Chamber, ramp_c_per_min: float, at_c: float) -> float:
    run, reading_c = _read_run(chamber, ramp_c_per_min)
    scale = accelerometer.slow(run, Streams(0)).scale  # what is left on draws nothing during a run
    soaked = int(np.searchsorted(run.time_s, chamber.soak_s))
    coldest, hottest = soaked + np.argmin(reading_c[soaked:]), soaked + np.argmax(reading_c[soaked:])
    last_fall, rise, first_fall = slice(hottest, None), slice(coldest, hottest), slice(soaked, coldest)
    last, rising, first = (_at(reading_c[leg] - at_c, scale[leg]) for leg in (last_fall, rise, first_fall))
    falling = first if last is None else last
    if falling is None or rising is None:
        raise UsageError(
            f"magnet: the chamber's readings do not pass through {at_c:g} degC both falling and rising; choose a "
            f"temperature between {reading_c[coldest]:.0f} and {reading_c[hottest]:.0f} degC, away from the ends"
        )
    return 1e6 * (falling - rising) / accelerometer.gamma


@functools.lru_cache(maxsize=8)
def _read_run(chamber: Chamber, ramp_c_per_min: float) -> tuple[ThermalRun, np.ndarray]:
    run = chamber.thermal_run(ramp_c_per_min)
    return run, chamber.thermometer.read(run.time_s, run.temperature_c)


def _at(difference_c: np.ndarray, scale: np.ndarray) -> float | None:
    """Scale factor where the difference is 0, from the readings near it, which must lie to both sides."""
    near = np.abs(difference_c) <= WINDOW_C
    if not (np.any(difference_c[near] < -0.5 * WINDOW_C) and np.any(difference_c[near] > 0.5 * WINDOW_C)):
        return None
    return float(np.polyfit(difference_c[near], scale[near], 1)[1])
