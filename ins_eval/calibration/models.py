"""A whole calibration: every model of an accelerometer that its chamber readings determine, and how sure it is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ins_eval.calibration.branches import BranchCurve, branches
from ins_eval.calibration.fits import Polynomial, anchored_line, constant, line, polynomial, quadratic
from ins_eval.calibration.four_point import FourPoint, four_point
from ins_eval.calibration.identifiability import Identifiability, identifiability
from ins_eval.calibration.labelings import Printed, labelings
from ins_eval.calibration.prediction import Prediction, RunErrors, errors_of_runs, predict
from ins_eval.calibration.sensitivity import sensitivity_ppm_per_c
from ins_eval.calibration.uncertainty import uncertainty
from ins_eval.errors import DataRefused
from ins_eval.recording import ChamberReadings

Curve = Polynomial | BranchCurve

# what draws the scale factor and what draws the bias of each model; `compensation` has the models of these names
FITS: dict[str, tuple[Callable[..., Curve], Callable[..., Curve]]] = {
    "none": (constant, constant),
    "simple": (line, line),
    "simple_anchored": (anchored_line, anchored_line),
    "quadratic": (quadratic, quadratic),
    "hysteresis": (polynomial, branches),
}
SCALE_UNIT = "pulse/(g s)"
BIAS_UNIT = "ug"
PER = {"alpha": "/(degC/min)^2", "beta": "/degC^2", "eta": "/(degC^2/min)", "epsilon": "/(degC/min)", "mu": "/degC"}


@dataclass(frozen=True)
class Coefficient:
    """One coefficient: a term of eq. (11), or a knot ("falling at -40 degC"); no interval where none can be given."""

    name: str
    unit: str
    value: float
    interval95: tuple[float, float] | None


@dataclass(frozen=True, eq=False)
class CalibratedModel:
    """One model: its curves with their coefficients and what it leaves, or the `reason` why there is none.

    `scale` in pulse/(g s) and `bias_ug` are None where the readings leave the model open. `residual_rms_ppm` and
    `sensitivity_ppm_per_c` are those of measured K1 / model K1, `residual_rms_ug` that of measured less model K0.
    `errors` are those of every run and `prediction` the interval of a reading in a new one, None where the runs are
    too few. `remarks` are sentences that belong beside the numbers.
    """

    name: str
    reason: str = ""
    scale: Curve | None = None
    bias_ug: Curve | None = None
    scale_coefficients: tuple[Coefficient, ...] = ()
    bias_coefficients: tuple[Coefficient, ...] = ()
    residual_rms_ppm: float = float("nan")
    residual_rms_ug: float = float("nan")
    sensitivity_ppm_per_c: float = float("nan")
    errors: tuple[RunErrors, ...] = ()
    prediction: Prediction | None = None
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Calibration:
    """All that the chamber readings of one accelerometer give.

    `sensitivity_ppm_per_c` is that of the scale factor itself, without any compensation. `printed` are the paper's
    equations on the readings nearest to the reference temperature, with either way to label the positions.
    """

    unit_id: str
    points: FourPoint
    identifiability: Identifiability
    models: dict[str, CalibratedModel]
    sensitivity_ppm_per_c: float
    printed: dict[str, Printed]


def calibrate(readings: ChamberReadings) -> Calibration:
    """Fit every model of `FITS` to the readings of one accelerometer.

    A model that the readings leave open is listed with its reason. Raises: DataRefused where the readings are no
    four-point calibration at all.
    """
    points = four_point(readings)
    found = identifiability(points)
    return Calibration(
        unit_id=readings.unit_id,
        points=points,
        identifiability=found,
        models={name: _calibrated(name, readings, points, found) for name in FITS},
        sensitivity_ppm_per_c=sensitivity_ppm_per_c(points.temperature_c, points.rate_c_per_min, points.scale),
        printed=_printed(points),
    )


def with_covariance(fit: Callable[..., Curve], curve: Curve, points: FourPoint, values: np.ndarray) -> Curve:
    """The `curve` that `fit` drew through `values` of the points, with its covariance where it can be given."""
    if not isinstance(curve, Curve) or curve.covariance is not None:
        return curve
    try:
        return replace(curve, covariance=uncertainty(fit, curve, points, values).covariance)
    except DataRefused:
        return curve


def _calibrated(name: str, readings: ChamberReadings, points: FourPoint, found: Identifiability) -> CalibratedModel:
    temperature, rate = points.temperature_c, points.rate_c_per_min
    curves, tables, remarks = [], [], []
    parts = zip(FITS[name], (points.scale, points.bias_ug), (SCALE_UNIT, BIAS_UNIT), strict=True)
    try:
        for fit, values, unit in parts:
            curve = fit(temperature, rate, values)
            half_width = None
            try:
                sure = uncertainty(fit, curve, points, values)
                curve, half_width = replace(curve, covariance=sure.covariance), sure.half_width95
            except DataRefused as refused:
                remarks.append(str(refused))
            curves.append(curve)
            tables.append(_table(curve, half_width, unit))
    except DataRefused as refused:
        return CalibratedModel(name, reason=str(refused))
    if FITS[name][0] is polynomial and found.words:
        remarks.append(found.words)
    scale, bias_ug = curves
    errors = tuple(errors_of_runs(readings, scale, bias_ug))
    prediction = None
    try:
        prediction = predict(list(errors))
    except DataRefused as refused:
        remarks.append(str(refused))
    ratio = points.scale / scale.evaluate(temperature, rate)
    return CalibratedModel(
        name,
        scale=scale,
        bias_ug=bias_ug,
        scale_coefficients=tables[0],
        bias_coefficients=tables[1],
        residual_rms_ppm=1e6 * _rms(ratio - 1.0),
        residual_rms_ug=_rms(points.bias_ug - bias_ug.evaluate(temperature, rate)),
        sensitivity_ppm_per_c=sensitivity_ppm_per_c(temperature, rate, ratio),
        errors=errors,
        prediction=prediction,
        remarks=tuple(dict.fromkeys(remarks)),
    )


def _table(curve: Curve, half_width: np.ndarray | None, unit: str) -> tuple[Coefficient, ...]:
    if isinstance(curve, BranchCurve):
        names = [f"{branch} at {knot:.1f} degC" for branch in ("falling", "rising") for knot in curve.knots_c]
        units = [unit] * len(names)
    else:
        names = list(curve.terms)
        units = [unit + PER.get(term, "") for term in names]
    values = curve.values.tolist()
    intervals: list[tuple[float, float] | None] = [None] * len(values)
    if half_width is not None:
        intervals = [(v - h, v + h) for v, h in zip(values, half_width.tolist(), strict=True)]
    return tuple(Coefficient(*row) for row in zip(names, units, values, intervals, strict=True))


def _printed(points: FourPoint) -> dict[str, Printed]:
    """Mean readings near the reference temperature, made again from K1 and K0, through the printed equations."""
    columns = points.temperature_c, points.rate_c_per_min
    at_reference, bias_ug = (float(constant(*columns, values).values[0]) for values in (points.scale, points.bias_ug))
    plus, level, minus = (at_reference * (1e-6 * bias_ug + force) for force in (1.0, 0.0, -1.0))
    return labelings(plus, minus, (level, level))


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))
