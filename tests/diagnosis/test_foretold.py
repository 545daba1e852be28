"""What is believed of other recordings, on sums whose columns are orthogonal: each coefficient can be told by hand."""

from __future__ import annotations

import pytest

from ins_eval.diagnosis.stage import Stage
from tests.diagnosis import stages
from tests.diagnosis.stages import ALIKE, INFORMATION

SURE, LIKELY = 3.0, 0.5  # coefficients: 12 and 2 sigma
SEEN = 0.6  # that two columns show together: by half it is still written
EFFECTS = (
    ("accelerometer.bias_temperature", "z", {}),
    ("accelerometer.bias_temperature", "x", {}),
    ("accelerometer.bias_temperature", "y", {}),
    ("accelerometer.bias", "x", {}),
    ("accelerometer.quadratic", "x", {}),
    ("gyro.bias_temperature", "x", {}),
    ("accelerometer.bias_step", "x", {"at_s": 100.0}),
    ("accelerometer.bias_creep", "z", {"time_constant_s": 600.0}),
    ("accelerometer.bias_creep", "z", {"time_constant_s": 2400.0}),
)
BIAS_Z, BIAS_X, _, CONSTANT, QUADRATIC, GYRO, STEP, CREEP_FAST, CREEP_SLOW = range(len(EFFECTS))


def stage(seen: dict[int, float], alike: tuple[int, int] | None = None) -> Stage:
    return stages.stage(EFFECTS, seen, alike)


def told(found: Stage) -> dict[int, float]:
    """Coefficients of what is believed, by its number."""
    return {found.hypotheses.index(one): coefficient for one, coefficient in found.foretold}


def drawn(coefficient: float, sigma: float = 1.0) -> float:
    """The mean of a coefficient that is told so by itself, under a prior of `sigma`."""
    return coefficient * INFORMATION / (INFORMATION + sigma**-2.0)


def test_beside_a_sure_thermal_effect_a_likely_one_is_believed_and_drawn_towards_nothing() -> None:
    found = stage({BIAS_Z: SURE, BIAS_X: LIKELY})
    assert found.best.members == (BIAS_Z,)  # only one is sure
    (as_wide_as_found,), _ = found.coefficients
    expected = {BIAS_Z: drawn(SURE, float(as_wide_as_found)), BIAS_X: drawn(LIKELY)}
    assert told(found) == pytest.approx(expected)


def test_a_constant_is_believed_beside_thermal_effects_only() -> None:
    assert told(stage({BIAS_Z: SURE, CONSTANT: LIKELY}))[CONSTANT] == pytest.approx(drawn(LIKELY))
    assert CONSTANT not in told(stage({QUADRATIC: SURE, CONSTANT: LIKELY}))


def test_what_has_no_part_in_it_has_to_be_sure() -> None:
    """A gyro and another error of the accelerometer that are as likely as a thermal one are not believed."""
    assert set(told(stage({BIAS_Z: SURE, GYRO: LIKELY, QUADRATIC: LIKELY}))) == {BIAS_Z}
    assert QUADRATIC in told(stage({BIAS_Z: SURE, QUADRATIC: SURE}))


@pytest.mark.parametrize(("other", "partners"), [(GYRO, 2), (STEP, 1)])
def test_what_is_not_believed_takes_its_part_all_the_same(other, partners) -> None:
    """What a gyro could have done as well is believed of the accelerometer by half; a jump has to be sure for that."""
    found = stage({BIAS_Z: SURE}, alike=(BIAS_X, other))
    found.here.projection[[BIAS_X, other]] = INFORMATION * SEEN
    believed = told(found)
    assert other not in believed
    assert believed[BIAS_X] == pytest.approx(INFORMATION * SEEN / (INFORMATION * (1.0 + ALIKE * (partners - 1)) + 1.0))


def test_of_times_that_could_be_the_likelier_is_believed() -> None:
    believed = told(stage({BIAS_Z: SURE, CREEP_FAST: LIKELY, CREEP_SLOW: 1.2 * LIKELY}))
    assert CREEP_FAST not in believed
    assert believed[CREEP_SLOW] == pytest.approx(drawn(1.2 * LIKELY))


def test_without_a_thermal_effect_it_is_the_answer() -> None:
    found = stage({QUADRATIC: SURE, BIAS_Z: LIKELY})
    (mean,), _ = found.coefficients
    assert told(found) == {QUADRATIC: mean}


def test_what_is_named_stays_where_others_fit_as_well() -> None:
    """A likely effect that does nearly what the sure one does stands beside it, not in its place."""
    assert BIAS_Z in told(stage({BIAS_Z: SURE}, alike=(BIAS_Z, BIAS_X)))
