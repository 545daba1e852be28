"""What is believed of other recordings, on sums whose columns are orthogonal: each coefficient can be told by hand."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from ins_eval.diagnosis.answer.verdict import Diagnosis
from ins_eval.diagnosis.estimate.linearisation import WITHIN_PRIOR, Linearisation
from tests.diagnosis import linearisations
from tests.diagnosis.linearisations import ALIKE, CENTRE, INFORMATION

SURE, LIKELY, LARGE = 2.5, 0.5, 15.0  # coefficients: 10, 2 and 60 sigma
CLOSE = 1.0  # of its own sigmas: how far from what a large effect is named with it may be believed
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
    ("alignment.heading", None, {}),  # of one recording
    ("alignment.heading", None, {}),  # of another
    ("composed", "x", {"driver": "supply_v", "form": "accelerometer = change of supply_v"}),
    ("temperature.lag", None, {}),
)
BIAS_Z, BIAS_X, _, CONSTANT, QUADRATIC, GYRO, STEP, CREEP_FAST, CREEP_SLOW, HEADING, OTHER_HEADING, COMPOSED, LAG = (
    range(13)
)


def linearisation(seen: dict[int, float], alike: tuple[int, int] | None = None) -> Linearisation:
    return linearisations.linearisation(EFFECTS, seen, alike)


def told(found: Linearisation) -> dict[int, float]:
    """Coefficients of what is believed, by its number."""
    return {found.hypotheses.index(one): coefficient for one, coefficient in found.predicted}


def drawn(coefficient: float, sigma: float = 1.0) -> float:
    """The mean of a coefficient that is told so by itself, under a prior of `sigma`."""
    return coefficient * INFORMATION / (INFORMATION + sigma**-2.0)


def test_what_is_written_are_values_in_their_units() -> None:
    found = linearisation({BIAS_Z: SURE, BIAS_X: LIKELY})
    one_case = SimpleNamespace(name="first")
    written = Diagnosis.predicted.fget(
        SimpleNamespace(described=(), effects=(object(),), linearisation=found, cases=(one_case,))
    )
    assert {(one.name, one.axis): one.value for one in written} == {
        (found.hypotheses[k].candidate.name, found.hypotheses[k].candidate.axis): pytest.approx(coefficient)
        for k, coefficient in told(found).items()  # their nominal size is 1
    }
    assert Diagnosis.predicted.fget(SimpleNamespace(described=(), effects=(), linearisation=None, cases=())) == []


def test_beside_a_sure_thermal_effect_a_likely_one_is_believed_and_drawn_towards_nothing() -> None:
    found = linearisation({BIAS_Z: SURE, BIAS_X: LIKELY})
    assert found.best.members == (BIAS_Z,)  # only one is sure
    assert told(found) == pytest.approx({BIAS_Z: drawn(SURE), BIAS_X: drawn(LIKELY)})


def test_what_is_large_and_sure_is_believed_as_it_is_named() -> None:
    """Its prior is wide enough for it, so that it is not taken for many others of usual size that fit as well."""
    found = linearisation({BIAS_Z: SURE, GYRO: LARGE}, alike=(BIAS_X, GYRO))
    mean, covariance = found.coefficients
    named, sigma = mean[found.best.members.index(GYRO)], covariance.diagonal()[found.best.members.index(GYRO)] ** 0.5
    believed = told(found)
    assert set(believed) == {BIAS_Z, GYRO}
    assert abs(believed[GYRO] - named) < CLOSE * sigma
    alone = told(linearisation({BIAS_Z: LARGE}))[BIAS_Z]
    assert alone == pytest.approx(drawn(LARGE, LARGE / WITHIN_PRIOR), rel=1e-4)


def test_a_constant_is_believed_beside_thermal_effects_only() -> None:
    assert told(linearisation({BIAS_Z: SURE, CONSTANT: LIKELY}))[CONSTANT] == pytest.approx(drawn(LIKELY))
    assert CONSTANT not in told(linearisation({QUADRATIC: SURE, CONSTANT: LIKELY}))


def test_what_has_no_part_in_it_has_to_be_sure() -> None:
    """A gyro and another error of the accelerometer that are as likely as a thermal one are not believed."""
    assert set(told(linearisation({BIAS_Z: SURE, GYRO: LIKELY, QUADRATIC: LIKELY}))) == {BIAS_Z}
    assert QUADRATIC in told(linearisation({BIAS_Z: SURE, QUADRATIC: SURE}))


@pytest.mark.parametrize(("other", "partners"), [(GYRO, 2), (OTHER_HEADING, 2), (STEP, 1), (COMPOSED, 1)])
def test_what_is_not_believed_takes_its_part_all_the_same(other, partners) -> None:
    """What a gyro could have done as well is believed of the accelerometer by half.

    A jump and what is composed of a column have to be sure for that.
    """
    found = linearisation({BIAS_Z: SURE}, alike=(BIAS_X, other))
    found.here.projection[[BIAS_X, other]] = INFORMATION * SEEN
    believed = told(found)
    assert other not in believed
    assert believed[BIAS_X] == pytest.approx(INFORMATION * SEEN / (INFORMATION * (1.0 + ALIKE * (partners - 1)) + 1.0))


def test_what_physics_fixes_is_believed_where_it_is_named_only() -> None:
    """It is drawn towards what it is fixed to, and so would stand wherever nothing is known of it."""
    assert told(linearisation({BIAS_Z: SURE, LAG: SURE}))[LAG] == pytest.approx(
        drawn(SURE) + CENTRE["temperature.lag"] / (INFORMATION + 1.0)
    )
    unknown = linearisation({BIAS_Z: SURE})
    unknown.here.normal[LAG, LAG] = unknown.here.projection[LAG] = 0.0
    assert LAG not in told(unknown)


def test_of_times_that_could_be_the_likelier_is_believed() -> None:
    believed = told(linearisation({BIAS_Z: SURE, CREEP_FAST: LIKELY, CREEP_SLOW: 1.2 * LIKELY}))
    assert CREEP_FAST not in believed
    assert believed[CREEP_SLOW] == pytest.approx(drawn(1.2 * LIKELY))


def test_what_is_known_of_one_recording_says_nothing_of_another() -> None:
    """The heading of one recording takes its part, named or not, whatever is named of the other."""
    for seen in ({}, {HEADING: SURE}):
        found = linearisation({BIAS_Z: SURE, **seen}, alike=(BIAS_X, OTHER_HEADING))
        found.here.projection[[BIAS_X, OTHER_HEADING]] = INFORMATION * SEEN
        assert told(found)[BIAS_X] == pytest.approx(INFORMATION * SEEN / (INFORMATION * (1.0 + ALIKE) + 1.0))


def test_without_a_thermal_effect_it_is_the_answer() -> None:
    found = linearisation({QUADRATIC: SURE, BIAS_Z: LIKELY})
    (mean,), _ = found.coefficients
    assert told(found) == {QUADRATIC: mean}


def test_what_is_named_stays_where_others_fit_as_well() -> None:
    """However little is left of it where a smaller one of the same kind does all of it."""
    found = linearisation({BIAS_Z: SURE}, alike=(BIAS_Z, BIAS_X))
    assert found.best.members == (BIAS_Z,)
    found.here.projection[[BIAS_Z, BIAS_X]] = 0.0, INFORMATION
    assert told(found)[BIAS_Z] < 0.0 < told(found)[BIAS_X]
