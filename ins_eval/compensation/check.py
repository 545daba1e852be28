"""The contract of a compensation model, tested on a stranger's one.

The model is fitted to a textbook accelerometer, made here from eqs (4) and (11) without noise, and asked for the
specific force of samples whose true value is known. What is refused is what would make its results worthless,
never that it compensates badly. A compensation file is fitted already, to another accelerometer: each of its models
is tested, and of the unit only that more output is more force.
"""

from __future__ import annotations

import copy
import functools
from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np

from ins_eval.compensation import CompensationModel, Samples
from ins_eval.compensation.child import ChildModel, ModelFailed
from ins_eval.compensation.file import SINGLE
from ins_eval.compensation.registry import FromFile, describe_error, missing_parts
from ins_eval.errors import UsageError
from ins_eval.recording import ChamberReadings
from ins_eval.scale_factor import scale_factor
from ins_eval.thermal import filtered_rate
from ins_eval.units import STANDARD_GRAVITY

NOT_SEEN = (
    "not seen by this check: whether the model opens files or the environment, looks into other processes of the same "
    "user, or draws the simulated instruments again from their seed; in a run it has a process of its own, without the "
    "truth, that does not stop it from these"
)
SAME_MPS2 = 1e-9  # two answers that agree to this are the same; a tenth of a nano-g
SLOPE_TOLERANCE = 0.1  # no compensation at all errs by 0.01
RESIDUAL_TOLERANCE_MPS2 = 0.05 * STANDARD_GRAVITY  # nor by more than 0.01 g

# JB-KT8 #1 by Paper A eq. (15), T0 = 22 degC, in the order of scale_factor.TERMS; the bias by eq. (4)
_SCALE = np.array([273.0, 0.1008, -0.02409, 88.14, -32.76, 320320.0])
_BIAS_UG, _BIAS_UG_PER_C, _T0_C = 300.0, 40.0, 22.0


@dataclass(frozen=True)
class Finding:
    """One point of the contract; `refusal` is a sentence, or empty where the model keeps it."""

    check: str
    refusal: str = ""

    def __str__(self) -> str:
        return f"{self.check}: {f'refused: {self.refusal}' if self.refusal else 'ok'}"


def check_model(model: CompensationModel | Callable[[], CompensationModel]) -> list[Finding]:
    """Findings on a model or its class, in the order tested; it ends early where nothing further can be said."""
    if isinstance(model, ChildModel):  # where it is, so that it meets the very arrays of the check
        return _findings_in_child(model)
    trials = [_Trial(model, axis) for axis in (model.models if isinstance(model, FromFile) else ("",))]
    findings = []
    for name, check, go_on in _CHECKS:
        try:
            for trial in trials:
                check(trial)
            findings.append(Finding(name))
        except UsageError as refused:
            findings.append(Finding(name, str(refused)))
            if not go_on:
                break
    return findings


def _findings_in_child(model: ChildModel) -> list[Finding]:
    try:
        return [Finding(*each) for each in model.findings()]
    except ModelFailed as failed:
        return [
            Finding(
                "its process",
                f"{model.name} {failed.described} while it was checked; expected an answer to every call, so mend "
                "the model",
            )
        ]


def require_sound(model: CompensationModel | Callable[[], CompensationModel]) -> None:
    """Raise UsageError with the first refusal of `check_model`, if there is one."""
    for finding in check_model(model):
        if finding.refusal:
            raise UsageError(finding.refusal)


class _Trial:
    """The model under test with fresh copies of everything it is given, for the accelerometer `axis`."""

    def __init__(self, model: object, axis: str):
        self.given = model
        self.label = getattr(model, "__name__", None) or getattr(model, "name", None) or type(model).__name__
        self.label += f", {axis}" if axis else ""
        self.chamber = replace(_chamber(), axis="" if axis == SINGLE else axis)

    def new(self) -> CompensationModel:
        """An unfitted model that shares nothing with another."""
        make = self.given if isinstance(self.given, type) or not hasattr(self.given, "fit") else None
        if make is not None and callable(make):
            return self.call("()", make)
        return self.call(": copying it", copy.deepcopy, self.given)

    def call(self, what: str, function: Callable, *arguments: object) -> object:
        """The result of a stranger's function; its exception becomes a sentence."""
        try:
            return function(*arguments)
        except Exception as error:
            raise UsageError(
                f"{self.label}{what} {describe_error(error)}; expected it to work on a textbook chamber "
                f"(-60 to 70 degC, four positions, two rates) and samples of shape (n,)"
            ) from error

    @functools.cached_property
    def fitted(self) -> CompensationModel:
        model = self.new()
        self.call(".fit", model.fit, _copied(self.chamber))
        return model

    @functools.cached_property
    def force(self) -> np.ndarray:
        return self.ask(self.fitted, _samples()[0])

    def ask(self, model: CompensationModel, samples: Samples) -> object:
        return self.call(".specific_force", model.specific_force, _copied(samples))


def _complete(trial: _Trial) -> None:
    if lack := missing_parts(trial.new()):
        raise UsageError(f"{trial.label}: {lack}")


def _fits(trial: _Trial) -> None:
    model = trial.new()
    returned = trial.call(".fit", model.fit, _copied(trial.chamber))
    if returned is not model:
        raise UsageError(
            f"{trial.label}.fit returned {kind(returned)}; expected the model itself, so end it with 'return self'"
        )


def _chamber_unchanged(trial: _Trial) -> None:
    chamber = _copied(trial.chamber)
    trial.call(".fit", trial.new().fit, chamber)
    _refuse_change(trial, "fit", chamber, trial.chamber)


def _shape(trial: _Trial) -> None:
    count = _samples()[0].time_s.size
    if not isinstance(trial.force, np.ndarray) or trial.force.dtype.kind != "f":
        raise UsageError(
            f"{trial.label}.specific_force returned {kind(trial.force)}; expected a numpy array of floats, "
            f"so convert it with np.asarray(..., dtype=float)"
        )
    if trial.force.shape != (count,):
        raise UsageError(
            f"{trial.label}.specific_force returned shape {trial.force.shape} for {count} samples; "
            f"expected ({count},), so return one value for each sample"
        )


def _finite(trial: _Trial) -> None:
    bad = np.flatnonzero(~np.isfinite(trial.force))
    if bad.size:
        raise UsageError(
            f"{trial.label}.specific_force is not finite in {bad.size} of {trial.force.size} samples, first {bad[0]} "
            f"({trial.force[bad[0]]}); expected a number for every sample, so give the first ones a value too"
        )


def _unit(trial: _Trial) -> None:
    samples, truth = _samples()
    if isinstance(trial.given, FromFile):
        more = trial.ask(trial.fitted, replace(samples, output=samples.output + 1.0)) - trial.force
        if (bad := np.flatnonzero(~(more > 0.0))).size:
            raise UsageError(
                f"{trial.label}: at {samples.temperature_c[bad[0]]:.3g} degC and {samples.rate_c_per_min[bad[0]]:.2g} "
                "degC/min more output is not more specific force; expected a scale factor above 0, so correct the "
                f"file {trial.given.path}"
            )
        return
    centred = truth - truth.mean()
    slope = float(trial.force @ centred / (truth @ centred))  # a constant error is no matter of the unit
    likely = {
        "g": 1.0 / STANDARD_GRAVITY,
        "milli-g": 1e3 / STANDARD_GRAVITY,
        "micro-g": 1e6 / STANDARD_GRAVITY,
        "pulse/s": _SCALE[-1] / STANDARD_GRAVITY,
        "m/s over the sample": float(np.diff(samples.time_s).mean()),
        "the negative of it": -1.0,
    }
    if abs(slope - 1.0) > SLOPE_TOLERANCE:
        for unit, factor in likely.items():
            if abs(slope / factor - 1.0) < SLOPE_TOLERANCE:
                raise UsageError(
                    f"{trial.label}.specific_force looks like {unit}: 1 m/s^2 of a textbook accelerometer gave "
                    f"{slope:.4g}; expected m/s^2, so multiply by {1.0 / factor:.6g}"
                )
        raise UsageError(
            f"{trial.label}.specific_force does not follow the specific force: 1 m/s^2 of a textbook accelerometer "
            f"gave {slope:.4g}; expected 1 within {SLOPE_TOLERANCE:g}, so check scale factor and unit (m/s^2)"
        )
    residual = float(np.sqrt(np.mean((trial.force - truth) ** 2)))
    if residual > RESIDUAL_TOLERANCE_MPS2:
        raise UsageError(
            f"{trial.label}.specific_force is {residual:.3g} m/s^2 RMS off on a textbook accelerometer; expected "
            f"below {RESIDUAL_TOLERANCE_MPS2:.3g} (no compensation at all reaches it), so check the units of the bias"
        )


def _samples_unchanged(trial: _Trial) -> None:
    samples = _copied(_samples()[0])
    trial.call(".specific_force", trial.fitted.specific_force, samples)
    _refuse_change(trial, "specific_force", samples, _samples()[0])


def _repeatable(trial: _Trial) -> None:
    again = trial.ask(trial.fitted, _samples()[0])
    if not _same(again, trial.force):
        raise UsageError(
            f"{trial.label}.specific_force gave another answer to the same samples the second time; expected the same, "
            f"so keep nothing between calls and draw nothing at random"
        )
    other = trial.new()
    trial.call(".fit", other.fit, _copied(trial.chamber))
    if not _same(trial.ask(other, _samples()[0]), trial.force):
        raise UsageError(
            f"{trial.label}.fit gave another model from the same chamber readings the second time; expected the same, "
            f"so keep nothing outside the model and fix the seed of anything random"
        )


def _causal(trial: _Trial) -> None:
    samples, _ = _samples()
    for count in (samples.time_s.size // 2, samples.time_s.size // 3):
        part = Samples(*(getattr(samples, field.name)[:count] for field in fields(samples)))
        answer = trial.ask(trial.fitted, part)
        if not _same(answer, trial.force[:count]):
            changed = ""
            if np.shape(answer) == (count,):
                first = int(np.flatnonzero(~(np.abs(answer - trial.force[:count]) <= SAME_MPS2))[0])
                changed = f", from sample {first} on"
            raise UsageError(
                f"{trial.label} looks ahead: without the samples after {count} its answer for those before changed"
                f"{changed}; expected each value to depend on its own and earlier samples only"
            )


def _values_alone(trial: _Trial) -> None:
    other = trial.new()
    trial.call(".fit", other.fit, _among_others(trial.chamber))
    if not _same(trial.ask(other, _samples()[0]), trial.force):
        _refuse_hidden(trial, "fit", "chamber readings")
    if not _same(trial.call(".specific_force", trial.fitted.specific_force, _among_others(_samples()[0])), trial.force):
        _refuse_hidden(trial, "specific_force", "samples")


def _refuse_hidden(trial: _Trial, method: str, given: str) -> None:
    raise UsageError(
        f"{trial.label}.{method} reads more than the values of the {given}: the same values as columns of a larger "
        f"table, with further attributes, led to another answer; expected one that depends on the documented columns "
        f"alone, so leave the .base of an array and any other attribute alone"
    )


# name, check, whether anything further can be said after a refusal
_CHECKS: tuple[tuple[str, Callable[[_Trial], None], bool], ...] = (
    ("name and methods", _complete, False),
    ("fit", _fits, False),
    ("chamber readings left alone", _chamber_unchanged, True),
    ("specific_force", _shape, False),
    ("finite", _finite, False),
    ("unit m/s^2", _unit, True),
    ("samples left alone", _samples_unchanged, True),
    ("repeatable", _repeatable, False),
    ("causal", _causal, True),
    ("values alone", _values_alone, True),
)


def _refuse_change(trial: _Trial, method: str, after: object, before: object) -> None:
    for field in fields(before):
        if not np.array_equal(getattr(after, field.name), getattr(before, field.name)):
            raise UsageError(
                f"{trial.label}.{method} changed its input '{field.name}'; expected it untouched, since other models "
                f"get the same arrays, so work on a copy"
            )


def _same(answer: object, expected: np.ndarray) -> bool:
    return np.shape(answer) == expected.shape and bool(np.all(np.abs(answer - expected) <= SAME_MPS2))


def kind(thing: object) -> str:
    return f"an array of {thing.dtype}" if isinstance(thing, np.ndarray) else type(thing).__name__


def _copied(table: ChamberReadings | Samples) -> ChamberReadings | Samples:
    arrays = {field.name: getattr(table, field.name) for field in fields(table)}
    return replace(table, **{name: value.copy() for name, value in arrays.items() if isinstance(value, np.ndarray)})


def _among_others(table: ChamberReadings | Samples) -> ChamberReadings | Samples:
    """The same values, each array a column between two others of a larger one, with any further attribute, too."""
    rng = np.random.default_rng(1)

    def column(values: np.ndarray) -> np.ndarray:
        wide = np.empty((values.size, 3), values.dtype, order="F")  # a column is contiguous, as it is in a run
        wide[:, 1] = values
        wide[:, 0], wide[:, 2] = 2 * rng.permutation(values) + 1, 3 * rng.permutation(values) - 1
        return wide[:, 1]

    class Wider(type(table)):
        def __getattr__(self, name: str) -> np.ndarray:
            if name.startswith("__"):
                raise AttributeError(name)
            return rng.normal(size=table.time_s.size)

    Wider.__name__ = type(table).__name__
    given = {field.name: getattr(table, field.name) for field in fields(table)}
    wider = Wider(**{name: column(v) if isinstance(v, np.ndarray) else v for name, v in given.items()})
    vars(wider)["truth"] = wider.truth
    return wider


def _output(temperature_c: np.ndarray, rate_c_per_min: np.ndarray, force_g: np.ndarray | float) -> np.ndarray:
    """Pulses a second by Paper A eq. (12): K1 (K0 + a)."""
    bias_ug = _BIAS_UG + _BIAS_UG_PER_C * (temperature_c - _T0_C)
    return scale_factor(_SCALE, temperature_c - _T0_C, rate_c_per_min) * (1e-6 * bias_ug + force_g)


@functools.cache
def _chamber() -> ChamberReadings:
    """Steps 1-6 of Paper A, section 3.1, at 0.3 and 0.9 degC/min without dwells, one reading a minute."""
    columns = []
    begin = run = 0
    for ramp in (0.3, 0.9):
        turns_min = np.cumsum([0.0, 120.0, 82.0 / ramp, 130.0 / ramp, 48.0 / ramp])
        time_s = np.arange(0.0, 60.0 * turns_min[-1], 60.0)
        temperature = np.interp(time_s, 60.0 * turns_min, [22.0, 22.0, -60.0, 70.0, 22.0])
        rate = filtered_rate(time_s, temperature)
        for force_g in (1.0, 0.0, -1.0, 0.0):
            same = np.ones_like(time_s)
            output = _output(temperature, rate, force_g)
            columns.append((begin + time_s, run * same, force_g * same, ramp * same, temperature, output))
            begin += time_s[-1] + 3600.0
            run += 1
    time_s, runs, *rest = (np.concatenate(column) for column in zip(*columns, strict=True))
    return ChamberReadings(time_s, runs.astype(np.int64), *rest, unit_id="textbook")


@functools.cache
def _samples() -> tuple[Samples, np.ndarray]:
    """Half an hour of lively samples in mid-range, and the specific force in m/s^2 that they are of."""
    time_s = 0.25 * np.arange(1, 8001)  # not 0.1 s, lest an increment look like g
    temperature = 14.0 - 0.012 * time_s + 4.0 * np.sin(time_s / 300.0) + 0.05 * np.sin(1.7 * time_s)
    rate = filtered_rate(time_s, temperature)
    force = STANDARD_GRAVITY * (0.8 * np.sin(time_s / 110.0) + 0.15 * np.cos(0.45 * time_s))
    return Samples(time_s, _output(temperature, rate, force / STANDARD_GRAVITY), temperature, rate), force
