"""When effects explain and when they only describe, on sums made by hand."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ins_eval.diagnosis.judge import FORM, OPEN_MARGIN, _Judge
from ins_eval.diagnosis.linearisation import Linearisation
from ins_eval.diagnosis.rivals import WITHIN
from ins_eval.diagnosis.verdict import Mismatch, UnnamedDisturbance
from tests.diagnosis.linearisations import linearisation

LARGE, SMALL = 6.0, 3.0  # coefficients that are both sure: 24 and 12 sigma
CONSTANT = ("accelerometer.scale", "z", {})
OF_Z = (
    ("accelerometer.bias_temperature", "z", {}),
    ("accelerometer.quadratic", "z", {}),
    ("accelerometer.bias_creep", "z", {"time_constant_s": 600.0}),
    ("accelerometer.misalignment", "z", {"other_axis": "x"}),
    ("accelerometer.scale_hysteresis", "z", {"branch_width_c": 3.0}),
)
COMPOSED = ("composed", "z", {"driver": "supply_v", "form": "accelerometer = change of supply_v"})
OTHER = ("accelerometer.bias_temperature", "x", {})


@pytest.fixture
def judge() -> _Judge:
    """Of one flight."""
    return _Judge((SimpleNamespace(believed=object(), kind="flight"),), lambda _: None, None)


def sure(*effects, sizes=None) -> Linearisation:
    """A stage whose best set are all these effects."""
    found = linearisation(effects, dict(enumerate(sizes or [LARGE] * len(effects))))
    assert set(found.best.members) == set(range(len(effects)))
    return found


def behind(judge: _Judge, found: Linearisation) -> float:
    """Nats by which a form without a name must stay behind, less what is open of large effects."""
    return FORM * found.best.log_posterior - judge._open_margin(found)


@pytest.mark.parametrize(
    ("count", "expected"), [(1, 0.0), (2, OPEN_MARGIN), (3, 2.0 * OPEN_MARGIN), (4, 3.0 * OPEN_MARGIN), (5, np.inf)]
)
def test_each_further_effect_of_one_sensor_has_to_lead_further_but_for_constants(judge, count, expected) -> None:
    assert behind(judge, sure(*OF_Z[:count])) == pytest.approx(expected)
    assert behind(judge, sure(*OF_Z[:count], CONSTANT)) == pytest.approx(expected)
    assert behind(judge, sure(*OF_Z[:count], OTHER)) == pytest.approx(expected)  # of another sensor


def test_what_is_composed_of_a_column_has_to_lead_as_an_effect_and_as_a_description(judge) -> None:
    assert behind(judge, sure(COMPOSED)) == pytest.approx(WITHIN)
    assert behind(judge, sure(COMPOSED, OF_Z[0])) == pytest.approx(OPEN_MARGIN + WITHIN)


@pytest.mark.parametrize(("left", "sizes", "described"), [
    ("accelerometer.x", (LARGE, SMALL), False),  # what is explained is z
    ("accelerometer.x", (SMALL, LARGE), True),
    ("accelerometer.y", (SMALL, LARGE), False),  # no law is named there
])  # fmt: skip
def test_a_law_explains_nothing_where_something_is_left_unless_others_explain_most(
    judge, left, sizes, described
) -> None:
    judge.beside = UnnamedDisturbance(Mismatch(0, left, "", 0.0, 100.0, "", 3.0), 10.0, 3.0)
    found = sure(OF_Z[0], OTHER, sizes=sizes)
    assert judge._only_described(found, found.best.log_bayes_factor, None) is described
