"""What is believed of other recordings, on sums whose columns are orthogonal: each coefficient can be told by hand."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ins_eval.diagnosis.columns import Column
from ins_eval.diagnosis.library import Candidate
from ins_eval.diagnosis.search import search
from ins_eval.diagnosis.stage import Stage
from ins_eval.diagnosis.study import Hypothesis, Sums, space
from ins_eval.diagnosis.verdict import EXPLAINED, Diagnosis, Effect

INFORMATION = 100.0  # each coefficient is known to a tenth of its nominal size
SURE, LIKELY, NOTHING = 3.0, 0.3, 0.05  # coefficients: 30, 3 and half a sigma
NAMES = (
    ("accelerometer.bias_temperature", "z"),
    ("accelerometer.bias_temperature", "x"),
    ("accelerometer.bias_temperature", "y"),
    ("accelerometer.bias", "z"),
    ("accelerometer.bias", "x"),
    ("accelerometer.bias", "y"),
    ("gyro.bias_temperature", "x"),
    ("accelerometer.scale", "x"),
)


def stage(**coefficients: float) -> Stage:
    """Recordings that tell these coefficients, by effect and axis as ``bias_temperature_z``, `NOTHING` of others."""
    hypotheses = tuple(
        Hypothesis(Candidate(name, axis, "ug", 1.0, Column("", ())), (Column("", ()),)) for name, axis in NAMES
    )
    keys = [f"{name.replace('.', '_')}_{axis}" for name, axis in NAMES]
    assert set(coefficients) <= set(keys)
    seen = np.array([coefficients.get(key, NOTHING) for key in keys])
    here = Sums(INFORMATION * np.eye(len(NAMES)), INFORMATION * seen, 0.0)
    families = space(hypotheses, 0.0)
    ranked = tuple(search(here.normal, here.projection, families))
    return Stage((), hypotheses, families, np.zeros(len(NAMES)), (), here, ranked)


def told(found: Stage) -> dict[tuple[str, str | None], float]:
    return {(one.candidate.name, one.candidate.axis): coefficient for one, coefficient in found.foretold}


def test_beside_a_sure_thermal_effect_a_likely_one_is_believed_and_drawn_towards_nothing() -> None:
    found = stage(accelerometer_bias_temperature_z=SURE, accelerometer_bias_temperature_x=LIKELY)
    assert [found.hypotheses[k].candidate.axis for k in found.best.members] == ["z"]  # only one is sure
    believed = told(found)
    assert believed["accelerometer.bias_temperature", "z"] == pytest.approx(SURE, rel=0.01)
    assert 0.8 * LIKELY < believed["accelerometer.bias_temperature", "x"] < LIKELY
    assert ("accelerometer.bias_temperature", "y") not in believed


def test_the_constant_is_free_where_the_bias_moves_with_temperature() -> None:
    believed = told(stage(accelerometer_bias_temperature_z=SURE))
    assert set(believed) == {("accelerometer.bias_temperature", "z"), ("accelerometer.bias", "z")}


def test_what_has_no_part_in_it_has_to_be_sure() -> None:
    """A gyro and a scale factor that are as likely as the accelerometer's thermal bias are not believed."""
    likely = dict.fromkeys(("gyro_bias_temperature_x", "accelerometer_scale_x"), LIKELY)
    believed = told(stage(accelerometer_bias_temperature_z=SURE, **likely))
    assert not {name for name, _ in believed} & {"gyro.bias_temperature", "accelerometer.scale"}


def test_without_a_thermal_effect_it_is_the_answer() -> None:
    found = stage(accelerometer_scale_x=SURE, accelerometer_bias_temperature_z=LIKELY)
    (mean,), _ = found.coefficients
    assert told(found) == {("accelerometer.scale", "x"): mean}


def test_what_is_named_stays_where_others_fit_as_well() -> None:
    """Two likely effects that together do what the sure one does stand beside it, not in its place."""
    found = stage(accelerometer_bias_temperature_z=SURE, accelerometer_bias_temperature_x=LIKELY)
    named, likely = (NAMES.index(("accelerometer.bias_temperature", axis)) for axis in "zx")
    found.here.normal[named, likely] = found.here.normal[likely, named] = 0.9 * INFORMATION
    assert {("accelerometer.bias_temperature", "z")} <= set(told(found))


@pytest.mark.parametrize(("recordings", "expected"), [(("first",), "first"), (("first", "second"), None)])
def test_a_constant_of_one_switch_on_stays_with_it_where_temperature_moves_the_sensors(recordings, expected) -> None:
    found = stage(accelerometer_bias_temperature_z=SURE, accelerometer_bias_y=SURE)
    assert believed(found, recordings)["accelerometer.bias", "y"].recording == expected
    assert believed(found, recordings)["accelerometer.bias", "z"].recording is None  # free, not named
    cold = stage(accelerometer_scale_x=SURE, accelerometer_bias_y=SURE)
    assert believed(cold, recordings)["accelerometer.bias", "y"].recording is None


def believed(found: Stage, recordings) -> dict:
    """Of the written belief of recordings with these names, by name and axis."""
    named = tuple(Effect(found.hypotheses[k], 0.0, 0.0, 1.0, 0.0, 0.0) for k in found.best.members)
    nothing = dict.fromkeys(("rivals", "mismatches", "null", "fitted", "innovations", "after"), ())
    diagnosis = Diagnosis(
        cases=tuple(SimpleNamespace(name=name) for name in recordings), verdict=EXPLAINED, effects=named,
        remainder=None, statistics={}, held_out={}, stage=found, **nothing,
    )  # fmt: skip
    return {(one.name, one.axis): one for one in diagnosis.foretold}
