"""A fitted compensation model as a TOML file, and the model that a recording believes in.

    format = "ins-compensation/1"
    name = "hysteresis_refined"

    [x.scale_pulse_per_g_s]       # K1: the terms of eq. (11), a term that is absent is 0
    reference_temperature_c = 22.0
    mu = -32.76
    gamma = 320320.0

    [x.bias_ug]                   # K0: a curve with a falling and a rising branch
    knots_c = [-60.0, 22.0, 70.0]
    falling = [100.0, 300.0, 500.0]
    rising = [100.0, 280.0, 500.0]

    [x.residual_mps2]             # what an oven run added, optional

and likewise [y...] and [z...], or [accelerometer...] where the file is of a single one. The unit of a curve is in the
name of its table; its terms are per degC and per degC/min. Either curve may be of either kind. `covariance`, where it
is known, is that of its terms in the order of eq. (11), or of falling and then rising.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from ins_eval.calibration.branches import BranchCurve
from ins_eval.calibration.fits import LINE, REFERENCE_C, Polynomial
from ins_eval.compensation import CompensationModel, Curve
from ins_eval.compensation.refined import Refined
from ins_eval.compensation.scale_and_bias import ScaleAndBias
from ins_eval.errors import UsageError
from ins_eval.files import write_whole
from ins_eval.recording.belief import Belief
from ins_eval.recording.form.toml import dumps
from ins_eval.scale_factor import TERMS
from ins_eval.tables import Strict, parse, read_toml

FORMAT = "ins-compensation/1"
SINGLE = "accelerometer"
AXES = ("x", "y", "z")
BELIEVED = "believed"
HEAD = """A fitted compensation model: a = g0 (E / K1 - K0) - residual in m/s^2, E in pulse/s, g0 = 9.80665 m/s^2.
A curve is alpha r^2 + beta dT^2 + eta r dT + epsilon r + mu dT + gamma with dT = T - reference_temperature_c in degC
and its rate r in degC/min, or straight between knots_c, on a branch for falling and one for rising temperature.
The unit of a curve is in the name of its table."""

Numbers = Annotated[tuple[float, ...], Field(min_length=1)]


class CurveTable(Strict):
    """A `Polynomial` or a `BranchCurve`, whichever keys it has."""

    reference_temperature_c: float = REFERENCE_C
    alpha: float | None = None
    beta: float | None = None
    eta: float | None = None
    epsilon: float | None = None
    mu: float | None = None
    gamma: float | None = None
    residual_rms: Annotated[float, Field(ge=0.0)] | None = None
    # of the terms that are given, in the order of eq. (11), or of the values of falling and then rising
    covariance: tuple[tuple[float, ...], ...] | None = None
    knots_c: Numbers | None = None
    falling: Numbers | None = None
    rising: Numbers | None = None

    @model_validator(mode="after")
    def _one_kind(self) -> CurveTable:
        branched = {"knots_c", "falling", "rising"} & self.model_fields_set
        if branched and (others := self.model_fields_set - branched - {"covariance"}):
            odd = sorted(others)[0]
            raise ValueError(f"'{odd}' and '{sorted(branched)[0]}' stand in one curve; keep terms or branches")
        if branched:
            if len(branched) < 3 or not len(self.knots_c) == len(self.falling) == len(self.rising):
                raise ValueError("a curve with branches needs knots_c, falling and rising of one length")
            if any(high <= low for low, high in pairwise(self.knots_c)):
                raise ValueError("the temperatures knots_c do not increase; sort the knots")
        elif not self.terms:
            raise ValueError(f"the curve has no term; give some of {', '.join(TERMS)}, or knots_c, falling and rising")
        over = f"the terms {', '.join(self.terms)}" if not branched else "the values of falling and rising"
        count = 2 * len(self.knots_c) if branched else len(self.terms)
        if self.covariance is not None and [len(row) for row in self.covariance] != [count] * count:
            raise ValueError(f"the covariance is not square over {over}")
        return self

    @property
    def terms(self) -> tuple[str, ...]:
        """The terms that are given, in the order of eq. (11)."""
        return tuple(term for term in TERMS if getattr(self, term) is not None)

    def curve(self) -> Curve:
        """The curve itself; its covariance is None and the RMS of its residuals NaN where they are not known."""
        covariance = None if self.covariance is None else np.array(self.covariance)
        if self.knots_c is not None:
            return BranchCurve(np.array(self.knots_c), np.array(self.falling), np.array(self.rising), covariance)
        return Polynomial(
            terms=self.terms,
            values=np.array([getattr(self, term) for term in self.terms]),
            covariance=covariance,
            residual_rms=np.nan if self.residual_rms is None else self.residual_rms,
            reference_c=self.reference_temperature_c,
        )


class ModelTable(Strict):
    """One accelerometer."""

    scale_pulse_per_g_s: CurveTable
    bias_ug: CurveTable
    residual_mps2: CurveTable | None = None

    @model_validator(mode="after")
    def _residual_has_branches(self) -> ModelTable:
        if self.residual_mps2 is not None and self.residual_mps2.knots_c is None:
            raise ValueError("residual_mps2 has terms, expected knots_c, falling and rising")
        return self

    def model(self, name: str) -> CompensationModel:
        """The fitted model."""
        if self.residual_mps2 is None:
            return _fitted(name, self.scale_pulse_per_g_s.curve(), self.bias_ug.curve())
        inner = _fitted(name.removesuffix("_refined"), self.scale_pulse_per_g_s.curve(), self.bias_ug.curve())
        refined = Refined(inner)
        refined.name, refined.residual_ = name, self.residual_mps2.curve()
        return refined


class ModelFile(Strict):
    """The whole file: x, y and z, or a single accelerometer."""

    format: Literal["ins-compensation/1"]
    name: Annotated[str, Field(min_length=1)]
    accelerometer: ModelTable | None = None
    x: ModelTable | None = None
    y: ModelTable | None = None
    z: ModelTable | None = None

    @model_validator(mode="after")
    def _single_or_axes(self) -> ModelFile:
        axes = [axis for axis in AXES if getattr(self, axis) is not None]
        if bool(axes) == (self.accelerometer is not None):
            raise ValueError("give either one table [accelerometer] or tables [x], [y], [z]")
        return self


def write_model(path: str | Path, model: CompensationModel | Sequence[CompensationModel]) -> Path:
    """Write a fitted model of one accelerometer, or a sequence of three for x, y, z; returns the path.

    Every number is written to the last digit. Raises UsageError for a model that the format has no place for: a
    user's own class, a mirror of two models, one that is not fitted; and StorageError.
    """
    path = Path(path)
    triad = [model] if hasattr(model, "specific_force") else list(model)
    if len(triad) not in (1, 3):
        raise UsageError(f"{path}: {len(triad)} models given, expected one, or three for x, y and z; give those")
    names = sorted({one.name for one in triad})
    if len(names) > 1:
        raise UsageError(
            f"{path}: the models are called {' and '.join(names)}, expected one name; write a file of each"
        )
    keys = (SINGLE,) if len(triad) == 1 else AXES
    table = {"format": FORMAT, "name": names[0]}
    table |= {key: _table(one, path) for key, one in zip(keys, triad, strict=True)}
    return write_whole(path, dumps(table, HEAD).encode())


def read_model(path: str | Path, axis: str | None = None) -> CompensationModel:
    """Read the fitted model of one accelerometer: of `axis` "x", "y" or "z", or the single one in the file.

    A model read from a file gives specific force; it cannot be fitted anew.
    Raises UsageError with the key that is wrong.
    """
    return _of_axis(parse(ModelFile, read_toml(Path(path)), str(path)), path, axis)


def read_triad(path: str | Path) -> list[CompensationModel]:
    """Read the fitted models of x, y and z; the single one of the file three times. Raises UsageError."""
    file = parse(ModelFile, read_toml(Path(path)), str(path))
    if file.accelerometer is not None:
        return [_of_axis(file, path, None)] * 3
    return [_of_axis(file, path, axis) for axis in AXES]


def _of_axis(file: ModelFile, path: str | Path, axis: str | None) -> CompensationModel:
    if file.accelerometer is not None:
        return file.accelerometer.model(file.name)
    held = [key for key in AXES if getattr(file, key) is not None]
    if axis not in held:
        wanted = "which axis is meant was not said" if axis is None else f"there is none for axis {axis}"
        raise UsageError(f"{path}: holds models for {', '.join(held)}, but {wanted}; ask for one that it holds")
    return getattr(file, axis).model(file.name)


def believed_model(belief: Belief, axis: str, folder: str | Path) -> CompensationModel:
    """The model that a recording's table ``[accelerometer.x]`` (y, z) describes.

    K1 by eq. (11) and K0 = k0 + omega (T - T0) by eq. (4), T0 the believed reference temperature; or the model in
    the file that `compensation` names, relative to the `folder` of the recording.
    Raises UsageError where there is no such table or file.
    """
    believed = getattr(belief.accelerometer, axis)
    if believed is None:
        raise UsageError(
            f"{folder}: its recording.toml has no table [accelerometer.{axis}], expected scale and bias of that "
            "accelerometer or a compensation file; add it, choose a compensation model, or find one from its chamber "
            "recording with ins-eval calibrate"
        )
    if believed.compensation is not None:
        return read_model(Path(folder) / believed.compensation, axis)
    reference_c = belief.accelerometer.reference_temperature_c
    scale = _known(TERMS, believed.scale.coefficients, reference_c)
    bias_ug = _known(LINE, [believed.bias.omega_ug_per_c, believed.bias.k0_ug], reference_c)
    return _fitted(BELIEVED, scale, bias_ug)


def _known(terms: tuple[str, ...], values: Sequence[float], reference_c: float) -> Polynomial:
    """A polynomial that was not fitted here, so that nothing is known of its fit."""
    return Polynomial(terms, np.array(values, dtype=float), None, np.nan, reference_c)


def _fitted(name: str, scale: Curve, bias_ug: Curve) -> ScaleAndBias:
    model = ScaleAndBias(name, scale=_not_again, bias=_not_again)
    model.scale_, model.bias_ug_ = scale, bias_ug
    return model


def _not_again(temperature_c: np.ndarray, rate_c_per_min: np.ndarray, values: np.ndarray) -> Curve:
    raise UsageError(
        "a compensation model that was read from a file is fitted already and cannot be fitted anew; name a built-in "
        "model to fit one"
    )


def _table(model: CompensationModel, path: Path) -> dict[str, Any]:
    """The table of one accelerometer."""
    residual = None
    inner = model
    if isinstance(model, Refined):
        inner, residual = model.model, model.residual_
        if residual is None:
            raise UsageError(f"{path}: the model {model.name} has not been refined; refine it, or write it without")
    if type(inner) is not ScaleAndBias:
        raise UsageError(
            f"{path}: the model {model.name} is a {type(inner).__name__}, expected a scale factor and a bias (and an "
            "oven residual); keep a model of your own in its Python file"
        )
    if not hasattr(inner, "scale_"):
        raise UsageError(f"{path}: the model {model.name} is not fitted; fit it before it is written")
    scale, bias_ug = inner.curves_with_covariance()
    table = {
        "scale_pulse_per_g_s": _curve_table(scale, model.name, path),
        "bias_ug": _curve_table(bias_ug, model.name, path),
    }
    return table if residual is None else table | {"residual_mps2": _curve_table(residual, model.name, path)}


def _curve_table(curve: Curve, name: str, path: Path) -> dict[str, Any]:
    if isinstance(curve, BranchCurve):
        branched = {"knots_c": curve.knots_c, "falling": curve.falling, "rising": curve.rising}
        return branched if curve.covariance is None else branched | {"covariance": curve.covariance}
    if not isinstance(curve, Polynomial):
        raise UsageError(
            f"{path}: the model {name} has a curve of type {type(curve).__name__}, expected a polynomial or one with "
            "branches; keep a model of your own in its Python file"
        )
    order = sorted(range(len(curve.terms)), key=lambda k: TERMS.index(curve.terms[k]))
    table: dict[str, Any] = {"reference_temperature_c": curve.reference_c}
    table |= {curve.terms[k]: curve.values[k] for k in order}
    if np.isfinite(curve.residual_rms):
        table["residual_rms"] = curve.residual_rms
    if curve.covariance is not None:
        table["covariance"] = curve.covariance[np.ix_(order, order)]
    return table
