"""From chamber readings to the models of an accelerometer, and how sure they are."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from ins_eval.analysis.calibration_numbers import (
    AccelerometerNumbers,
    BiasFit,
    CalibrationNumbers,
    ChamberFacts,
    ChosenModel,
    Determined,
    FittedModel,
    NewReading,
    NotDetermined,
    ScaleFit,
)
from ins_eval.calibration import FITS, CalibratedModel, Calibration, calibrate
from ins_eval.compensation import CompensationModel
from ins_eval.compensation.registry import RESERVED, load_model, model_names
from ins_eval.compensation.scale_and_bias import ScaleAndBias
from ins_eval.errors import DataRefused, UsageError, did_you_mean
from ins_eval.recording import ChamberReadings
from ins_eval.tree import as_tree

if TYPE_CHECKING:
    import pandas as pd

WANTED = "hysteresis"
INSTEAD = ("quadratic", "simple", "none")  # the first that the readings determine
SMALLEST_SPAN_C = 5.0
PREDICTED_AT_C = (-40.0, -20.0, 0.0, 22.0, 40.0, 60.0)
SEEN = 99.0  # percentile of the rate that counts as seen: at the turns it is never reached for long


@dataclass(frozen=True, eq=False)
class AccelerometerCalibration:
    """One accelerometer: where its readings came from, the readings and what they give."""

    folder: Path
    readings: ChamberReadings
    calibration: Calibration

    @property
    def name(self) -> str:
        return self.readings.unit_id or self.folder.resolve().name

    @property
    def directions(self) -> set[float]:
        return {float(np.sign(rate)) for rate in self.calibration.identifiability.rates_c_per_min} - {0.0}

    @property
    def determines_hysteresis(self) -> bool:
        return self.calibration.identifiability.sound and len(self.directions) == 2


@dataclass(frozen=True, eq=False)
class ChamberCalibration:
    """The accelerometers of one calibration: one, or those of x, y and z; `chosen` is the model for their file.

    `asked` is the model that was asked for, None where the best that the readings determine was to be taken; `file` is
    where the models were written.
    """

    accelerometers: tuple[AccelerometerCalibration, ...]
    chosen: str
    asked: str | None = None
    file: Path | None = None

    def models(self, name: str) -> list[CompensationModel]:
        """The chosen model of each accelerometer, called `name`, and never what a built-in one is called."""
        return [_model(one, self.chosen, name) for one in self.accelerometers]

    def to_frame(self) -> pd.DataFrame:
        """One row a coefficient of a model of an accelerometer, with its 95 % interval."""
        import pandas as pd

        rows = [
            {"accelerometer": one.name, "model": name, "curve": curve, **as_tree(coefficient)}
            for one in self.accelerometers
            for name, model in one.calibration.models.items()
            if not model.reason
            for curve, found in (("scale", model.scale_coefficients), ("bias", model.bias_coefficients))
            for coefficient in found
        ]
        return pd.DataFrame(rows).set_index(["accelerometer", "model", "curve"])

    @cached_property
    def tree(self) -> dict[str, Any]:
        """The tree ``ins-eval-calibration/1`` of ``metrics.json``."""
        return as_tree(self.numbers)

    @cached_property
    def numbers(self) -> CalibrationNumbers:
        """What was found, in numbers."""
        chosen = ChosenModel(self.chosen, self.asked, None if self.file is None else str(self.file))
        return CalibrationNumbers(chosen, tuple(_accelerometer(one, self.chosen) for one in self.accelerometers))


def calibrate_chambers(
    chambers: Sequence[tuple[Path, ChamberReadings]], compensation: str | None = None
) -> ChamberCalibration:
    """Calibrate one accelerometer, or those of the three axes; `chambers` are the folder and the readings of each.

    The model for their file is `compensation`, by default hysteresis or the best that the readings determine.
    Raises: UsageError, DataRefused.
    """
    if compensation is not None and compensation not in FITS:
        raise UsageError(f"--compensation {compensation}: no such model{did_you_mean(compensation, FITS)}")
    found = _in_order([_calibrated(*chamber) for chamber in chambers])
    chosen = compensation or _best(found)
    for one in found:
        if reason := one.calibration.models[chosen].reason:
            raise DataRefused(f"{one.folder}: {reason}")
    return ChamberCalibration(tuple(found), chosen, compensation)


def _calibrated(folder: Path, readings: ChamberReadings) -> AccelerometerCalibration:
    lowest, highest = readings.temperature_c.min(), readings.temperature_c.max()
    if highest - lowest < SMALLEST_SPAN_C:
        raise DataRefused(
            f"{folder}: the temperature stays between {lowest:.2f} and {highest:.2f} degC, and nothing can be said of "
            f"how the accelerometer follows it; expected a span of {SMALLEST_SPAN_C:g} degC or more, so vary it"
        )
    try:
        return AccelerometerCalibration(folder, readings, calibrate(readings))
    except DataRefused as refused:
        raise DataRefused(f"{folder}: {refused}") from None


def _in_order(found: Sequence[AccelerometerCalibration]) -> list[AccelerometerCalibration]:
    """The one accelerometer, or those of x, y and z; anything else is refused."""
    if len(found) == 1:
        return list(found)
    if len(found) != 3:
        raise UsageError(f"{len(found)} chamber recordings given, expected one, or three of the axes x, y and z")
    by_axis: dict[str, AccelerometerCalibration] = {}
    for one in found:
        axis = one.readings.axis
        if not axis:
            raise UsageError(
                f"{one.folder}: its recording.toml does not say which axis it is of; add an empty table "
                "[accelerometer.x] (or y, z), or calibrate it by itself"
            )
        if axis in by_axis:
            twin = by_axis[axis].folder
            raise UsageError(f"{twin} and {one.folder} are both of axis {axis}; expected one of each of x, y and z")
        by_axis[axis] = one
    return [by_axis[axis] for axis in "xyz"]


def _best(found: Iterable[AccelerometerCalibration]) -> str:
    """The model for the file where none was asked for, the same for all accelerometers."""
    if all(one.determines_hysteresis for one in found):
        return WANTED
    return next(name for name in INSTEAD if not any(one.calibration.models[name].reason for one in found))


def _model(one: AccelerometerCalibration, chosen: str, name: str) -> CompensationModel:
    """The chosen model with the curves of the calibration, called `name`, but never as a built-in one."""
    model, calibrated = cast("ScaleAndBias", load_model(chosen)), one.calibration.models[chosen]
    model.scale_, model.bias_ug_ = calibrated.scale, calibrated.bias_ug
    model.name = re.sub(r"[^\w.+ -]", "-", name)
    if model.name in (*model_names(), *RESERVED):
        model.name += " from file"
    return model


def _accelerometer(one: AccelerometerCalibration, chosen: str) -> AccelerometerNumbers:
    readings, calibration = one.readings, one.calibration
    points, found = calibration.points, calibration.identifiability
    return AccelerometerNumbers(
        name=one.name,
        axis=readings.axis,
        recording=ChamberFacts(
            folder=one.folder.resolve().name,
            readings=int(readings.time_s.size),
            runs=int(np.unique(readings.run).size),
            ramps_c_per_min=tuple(np.unique(np.abs(points.ramp_c_per_min)).tolist()),
            temperature_c=(float(readings.temperature_c.min()), float(readings.temperature_c.max())),
            further=tuple(sorted(readings.further)),
        ),
        determined=Determined(
            rank=found.rank,
            steady_rank=found.steady_rank,
            terms=len(found.terms),
            condition=_finite(found.condition),
            words=found.words,
            hysteresis=one.determines_hysteresis,
            directions=tuple("rising" if sign > 0.0 else "falling" for sign in sorted(one.directions)),
            mean_rates_c_per_min=tuple(sorted({round(abs(rate), 3) for rate in found.rates_c_per_min} - {0.0})),
            rate_seen_c_per_min=float(np.percentile(np.abs(points.rate_c_per_min), SEEN)),
        ),
        sensitivity_ppm_per_c=_finite(calibration.sensitivity_ppm_per_c),
        models={name: _fitted(model, calibration) for name, model in calibration.models.items()},
        new_run=_new_run(calibration.models[chosen], calibration),
        printed=calibration.printed,
    )


def _fitted(model: CalibratedModel, calibration: Calibration) -> FittedModel | NotDetermined:
    if model.reason:
        return NotDetermined(model.reason)
    residual_ppm, sensitivity = _finite(model.residual_rms_ppm), _finite(model.sensitivity_ppm_per_c)
    return FittedModel(
        ScaleFit(model.scale_coefficients, residual_ppm, sensitivity),
        BiasFit(model.bias_coefficients, _finite(model.residual_rms_ug)),
        model.remarks,
        _within(model, calibration),
    )


def _within(model: CalibratedModel, calibration: Calibration) -> dict[str, float] | None:
    """What 95 % of compensated readings of a new run stay within, by position: the mean over the programme."""
    if model.prediction is None:
        return None
    points, found = calibration.points, {}
    for position in (1, 0, -1):
        ends = model.prediction.interval95_ug(position, points.temperature_c, points.rate_c_per_min)
        found[f"{position:+d}"] = float(np.abs(ends).max(axis=0).mean())
    return found


def _new_run(model: CalibratedModel, calibration: Calibration) -> tuple[NewReading, ...]:
    """Intervals of a compensated reading at some temperatures, falling and rising at the middle one of the rates."""
    if model.prediction is None:
        return ()
    temperature, rates = calibration.points.temperature_c, np.array(calibration.identifiability.rates_c_per_min)
    rows = []
    for at_c in [t for t in PREDICTED_AT_C if temperature.min() <= t <= temperature.max()]:
        for direction, of_direction in (("falling", rates[rates < 0.0]), ("rising", rates[rates > 0.0])):
            if of_direction.size:
                rate, within = float(np.median(of_direction)), {}
                for position in (1, 0, -1):
                    low, high = model.prediction.interval95_ug(position, np.array([at_c]), np.array([rate]))
                    within[f"{position:+d}"] = float(low[0]), float(high[0])
                rows.append(NewReading(at_c, direction, rate, within))
    return tuple(rows)


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
