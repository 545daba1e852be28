"""An effect of the sensors as a sum of parts, each multiplier x slow factor: the one form in which it is used.

    error of a sensor = value * sum of weight * multiplier(t) * slow(t)

A column of the diagnosis is made of the parts with the slow factors at its epochs, and a believed effect is taken off
a recording with them at every sample.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ins_eval.compensation.file import believed_model
from ins_eval.effects import composed, lag
from ins_eval.effects.effect import ACCELEROMETER, AXES, GYRO, Effect
from ins_eval.effects.slow import Conditions, OfTime, known, of_column, slow_factor
from ins_eval.effects.temperature import SmoothedTemperature, chamber_temperature, temperature
from ins_eval.recording import ChamberReadings, Recording
from ins_eval.recording.belief import Belief

TEMPERATURE_COLUMN = "temperature_c"
SENSORS = (ACCELEROMETER, GYRO)


class EffectPart(NamedTuple):
    """weight x multiplier x slow factor, in SI for a value of 1; `key` is the same for the same slow factor."""

    sensor: str
    axis: str
    multiplier: str
    weight: float
    key: str
    slow: OfTime


def conditions(recording: Recording, folder: str | Path = ".", seen: SmoothedTemperature | None = None) -> Conditions:
    """What a recording tells; `seen` is its temperature where that has been smoothed already."""
    imu = recording.imu
    pulses = imu.accelerometer_form == "pulse"
    columns = dict(imu.further)
    if imu.temperature_c is not None:
        columns[TEMPERATURE_COLUMN] = imu.temperature_c if imu.temperature_c.ndim == 1 else imu.temperature_c[:, 0]
    return Conditions(
        start_s=recording.start.time_s,
        end_s=float(imu.time_s[-1]),
        temperature=temperature(recording) if seen is None else seen,
        time_s=imu.time_s,
        columns=columns,
        models=cache(lambda axis: believed_model(recording.belief, axis, folder)) if pulses else None,
        bias_sigma=_bias_sigma(recording.belief),
    )


def chamber_conditions(
    readings: ChamberReadings, belief: Belief, folder: str | Path = ".", seen: SmoothedTemperature | None = None
) -> Conditions:
    """What a chamber recording tells."""
    return Conditions(
        start_s=float(readings.time_s[0]),
        end_s=float(readings.time_s[-1]),
        temperature=chamber_temperature(readings, belief.accelerometer) if seen is None else seen,
        time_s=readings.time_s,
        columns={TEMPERATURE_COLUMN: readings.temperature_c, **readings.further},
        models=cache(lambda axis: believed_model(belief, axis, folder)),
        axes=(readings.axis or AXES[0],),
        bias_sigma=_bias_sigma(belief),
    )


def _bias_sigma(belief: Belief) -> dict[str, float]:
    return {ACCELEROMETER: belief.accelerometer.bias_sigma_ug, GYRO: belief.gyro.bias_sigma_deg_per_h}


def possible(effect: Effect, given: Conditions) -> bool:
    """Whether the recording has what an effect of the sensors is made of."""
    if effect.enters == "temperature":
        return given.temperature is not None and given.models is not None
    return effect.enters in SENSORS and known(effect.slow, given)


def parts(
    effect: Effect, axis: str | None, parameters: Mapping[str, float | str], given: Conditions
) -> list[EffectPart]:
    """The parts of an effect of the sensors, for a value of 1 in its unit.

    `parameters` hold what the vocabulary asks for: `other_axis`, `time_constant_s`, `branch_width_c`, `branch_begin`,
    `at_s`, `lag_s`
    (the lag at which the error is taken), `driver` and `form`.
    """
    if effect.enters == "temperature":
        return _of_lag(float(parameters["lag_s"]), given)
    if effect.name == composed.NAME:
        return _composed(str(parameters["form"]), axis, given)
    multiplier = effect.multiplier(axis, parameters.get("other_axis"))
    column = given.temperature.column(AXES.index(axis)) if given.temperature is not None else 0
    key = effect.slow
    if effect.slow not in ("1", "t"):
        numbers = [f"{parameters[one.name]:.9g}" for one in effect.parameters if one.name in parameters]
        key = " ".join([effect.slow, *numbers, *([AXES[column]] if effect.slow != "step" else [])])
    slow = slow_factor(effect.slow, given, column, parameters)
    return [EffectPart(effect.enters, axis, multiplier, effect.si, key, slow)]


def _of_lag(lag_s: float, given: Conditions) -> list[EffectPart]:
    found = []
    seen = given.temperature
    for axis in given.axes:
        scale, bias = lag.lag_factors(given.models(axis), seen, AXES.index(axis), lag_s)
        for multiplier, values in (("f", scale), ("1", bias)):
            key = f"lag {lag_s:.9g} {multiplier} {axis}"
            found.append(EffectPart(ACCELEROMETER, axis, multiplier, 1.0 / lag_s, key, _through(seen.time_s, values)))
    return found


def _composed(form: str, axis: str, given: Conditions) -> list[EffectPart]:
    target, shape, driver, argument = composed.parse_form(form)
    slow = _through(*of_column(shape, given, driver, argument))
    return [EffectPart(target.sensor, axis, target.multiplier, target.si, f"{shape} {driver} {argument:.9g}", slow)]


def _through(time_s: np.ndarray, values: np.ndarray) -> OfTime:
    return lambda at_s: np.interp(at_s, time_s, values)
