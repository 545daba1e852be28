"""When effects explain and when they only describe, on sums made by hand."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from ins_eval.diagnosis.answer.collect import NEAR, _unnamed_near, other_noise, quiet_but_one
from ins_eval.diagnosis.answer.decision import Decision, only_described, open_margin, outgained
from ins_eval.diagnosis.answer.findings import Findings
from ins_eval.diagnosis.answer.judge import exchanged
from ins_eval.diagnosis.answer.verdict import PARTLY, Rival
from ins_eval.diagnosis.unnamed.disturbance import QUIET
from ins_eval.diagnosis.unnamed.mismatch import Mismatch, UnnamedDisturbance
from ins_eval.estimation.evidence import SCALES
from ins_eval.estimation.linearisation import Linearisation
from ins_eval.estimation.noise_fit import Fitted
from ins_eval.policy import Policy
from ins_eval.recording.belief import Belief, GyroBelief
from tests.diagnosis.linearisations import INFORMATION, linearisation

LARGE, SMALL = 6.0, 3.0  # coefficients that are both sure: 24 and 12 sigma
BEYOND = 1.2 * Policy.unusual  # usual sizes
HALF = 1.0  # of two that are alike: together as one of 1.9, and either alone fits nearly as well
NEGLIGIBLE_NATS = 0.05  # of effects that are not there
GOOD_DEG_PER_H, COARSE_DEG_PER_H = 0.01, 500.0  # turn-on biases of gyros
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


def sure(*effects, sizes=None) -> Linearisation:
    """A stage whose best set are all these effects."""
    found = linearisation(effects, dict(enumerate(sizes or [LARGE] * len(effects))))
    assert set(found.best.members) == set(range(len(effects)))
    return found


def of_flight(found: Linearisation, left: Mismatch | None = None) -> Findings:
    """Findings in one flight."""
    case = SimpleNamespace(believed=object(), kind="flight")
    beside = UnnamedDisturbance(left, 10.0, 3.0)
    return Findings((case,), (), (), (), found, found.best.log_bayes_factor, beside=beside)


def behind(found: Linearisation) -> float:
    """Nats by which a form without a name must stay behind, less what is open of large effects."""
    return Policy.left_open * found.best.log_posterior - open_margin(of_flight(found), Policy())


@pytest.mark.parametrize(("count", "laws"), [(1, 0), (2, 1), (3, 2), (4, 3), (5, np.inf)])
def test_each_further_effect_of_one_sensor_has_to_lead_further_but_for_constants(count, laws) -> None:
    expected = laws * Policy.open_margin
    assert behind(sure(*OF_Z[:count])) == pytest.approx(expected)
    assert behind(sure(*OF_Z[:count], CONSTANT)) == pytest.approx(expected)
    assert behind(sure(*OF_Z[:count], OTHER)) == pytest.approx(expected)  # of another sensor


@pytest.mark.parametrize(("effects", "sizes", "laws"), [
    (OF_Z[:2], (BEYOND, LARGE), 1),  # one that is so large happens
    (OF_Z[:2], (BEYOND, -BEYOND), np.inf),
    ((*OF_Z[:1], CONSTANT), (BEYOND, BEYOND), 0),  # a constant is believed otherwise
    ((*OF_Z[:1], OTHER), (BEYOND, BEYOND), 0),
])  # fmt: skip
def test_two_effects_of_a_sensor_that_no_two_have_of_such_sizes_describe_it(effects, sizes, laws) -> None:
    assert behind(sure(*effects, sizes=sizes)) == pytest.approx(laws * Policy.open_margin)


def test_what_is_composed_of_a_column_has_to_lead_as_an_effect_and_as_a_description() -> None:
    assert behind(sure(COMPOSED)) == pytest.approx(Policy.near)
    assert behind(sure(COMPOSED, OF_Z[0])) == pytest.approx(Policy.open_margin + Policy.near)


@pytest.mark.parametrize(("left", "sizes", "described"), [
    ("accelerometer.x", (LARGE, SMALL), False),  # what is explained is z
    ("accelerometer.x", (SMALL, LARGE), True),
    ("accelerometer.y", (SMALL, LARGE), False),  # no law is named there
])  # fmt: skip
def test_a_law_explains_nothing_where_something_is_left_unless_others_explain_most(left, sizes, described) -> None:
    mismatch = Mismatch(0, left, "", 0.0, 100.0, "", 3.0)
    found = of_flight(sure(OF_Z[0], OTHER, sizes=sizes), mismatch)
    assert only_described(found, None, Policy()) is described


@pytest.mark.parametrize(("channel", "more", "described"), [
    ("accelerometer.x", -0.5, False),
    ("accelerometer.x", 0.5, True),  # it suggested an effect of another sensor
    ("accelerometer.z", 0.5, False),  # an effect of its own sensor is as good a description
    ("accelerometer.z", Policy.near + 0.5, True),
])  # fmt: skip
def test_a_sure_disturbance_that_gains_more_has_suggested_the_effects(channel, more, described) -> None:
    found = of_flight(sure(OF_Z[0]))
    surest = SimpleNamespace(gain=found.gain + more, interval=SimpleNamespace(channel=SimpleNamespace(name=channel)))
    assert only_described(found, surest, Policy()) is described


@pytest.mark.parametrize(("alike", "names"), [(None, 1), ((0, 1), 2)])
def test_effects_that_are_alike_are_as_probable_together_as_a_form_without_a_name(alike, names: int) -> None:
    """Either is half as likely where there are two: one nat less than log 2 is not enough for what has no name."""
    found = linearisation((OF_Z[0], OF_Z[1], OTHER), {0: HALF, 1: HALF} if alike else {0: HALF}, alike)
    assert len(found.best.members) == 1
    together = found.log_posterior_of_names - found.best.log_posterior
    assert together == pytest.approx(np.log(names), abs=NEGLIGIBLE_NATS)
    for lead, better in ((together - 0.1, False), (together + 0.1, True)):
        instead = UnnamedDisturbance(None, found.best.log_posterior + lead, 3.0)
        assert outgained(replace(of_flight(found), instead=instead), 0.0) is better


def test_an_error_larger_than_such_sensors_have_is_no_less_likely_than_what_has_no_name() -> None:
    """By the closed form of a prior as wide as it is; under the widest of the scales it would be 30 nats behind."""
    size = 8.0 * SCALES[-1]
    found = linearisation((OF_Z[0],), {0: size})
    within = 0.5 * INFORMATION * size**2 - 0.5 * np.log(INFORMATION * size**2) - 0.5
    within -= np.log(len(SCALES)) + found.space.cost
    assert found.best.log_posterior < within - 0.4 * (size / SCALES[-1]) ** 2
    usual = linearisation((OF_Z[0],), {0: 0.9 * SCALES[-1]})
    assert usual.log_posterior_of_names == pytest.approx(usual.best.log_posterior, abs=1e-9)
    for lead, better in ((-1.0, False), (1.0, True)):
        instead = UnnamedDisturbance(None, float(within + lead), 3.0)
        assert outgained(replace(of_flight(found), instead=instead), 0.0) is better
    lost = within - found.best.log_posterior
    other = SimpleNamespace(channel=SimpleNamespace(name="gyro.x"))
    for lead, described in ((0.9, False), (1.1, True)):
        surest = SimpleNamespace(gain=found.best.log_bayes_factor + lead * lost, interval=other)
        assert only_described(of_flight(found), surest, Policy(left_open=0.0)) is described


@pytest.mark.parametrize(("size", "kept"), [(0.9, False), (1.1, True)])
def test_an_effect_beside_others_gains_more_than_chance_does_once_in_twenty(size: float, kept: bool) -> None:
    """By the closed form of one Gaussian coefficient with each of the scales; columns are orthogonal."""
    found = linearisation(OF_Z[:3], {0: LARGE, 1: size, 2: LARGE}).own_first(3)
    variance = np.square(SCALES)
    pull = INFORMATION * size
    each = 0.5 * pull**2 * variance / (1.0 + variance * INFORMATION) - 0.5 * np.log1p(variance * INFORMATION)
    gain = np.log(np.mean(np.exp(each)))
    assert (gain > found.space.cost + np.log(20.0)) == kept
    assert set(found.sure(Policy()).best.members) == ({0, 1, 2} if kept else {0, 2})


def test_one_alone_is_left_however_little_it_gains() -> None:
    found = linearisation(OF_Z[:2], {0: SMALL / 10.0}).own_first(1)
    assert found.sure(Policy()) is found


def test_what_adds_nothing_beside_a_better_one_goes_with_the_place_in_which_it_showed() -> None:
    """Members 0 and 1; in the place of 0 stands 2, whose column is almost that of 1, and which does all."""
    found = linearisation(OF_Z[:3], {2: LARGE}, (1, 2)).own_first(2)
    places = tuple(Mismatch(0, "accelerometer.z", "z", begin_s, 100.0, "", 9.0) for begin_s in (0.0, 50.0))
    findings = replace(of_flight(found), shown=places)
    decision = Decision(PARTLY, findings.beside, places, named=True)
    rival = Rival(found.hypotheses[0], found.hypotheses[2], 0.5, -1.0, False)
    decision, findings = exchanged(findings, decision, rival, Policy())
    assert findings.linearisation.best.members == (2,)
    assert [one.begin_s for one in findings.shown] == [one.begin_s for one in decision.mismatches] == [0.0]


@pytest.mark.parametrize(("behind_nats", "near"), [(NEAR - 0.5, True), (NEAR + 0.5, False)])
def test_a_form_without_a_name_that_comes_near_is_weighed_at_its_own_noise(behind_nats: float, near: bool) -> None:
    found = of_flight(sure(OF_Z[0]))
    instead = UnnamedDisturbance(None, found.linearisation.best.log_posterior - behind_nats, 3.0)
    assert _unnamed_near(replace(found, instead=instead)) is near


@pytest.mark.parametrize("coarse", [True, False])
@pytest.mark.parametrize("sure_alone", [True, False])
def test_the_search_goes_on_from_sensors_that_are_quiet_whatever_is_sure_alone(sure_alone: bool, coarse: bool) -> None:
    """What is sure without a name may let the others wander, and an effect of theirs with them; coarse ones do wander.

    However it is navigated: a good unit that is started in a wrong heading is navigated in arcs.
    """
    belief = Belief(gyro=GyroBelief(bias_sigma_deg_per_h=COARSE_DEG_PER_H if coarse else GOOD_DEG_PER_H))
    case = SimpleNamespace(
        believed=SimpleNamespace(recording=SimpleNamespace(belief=belief), arcs=(None,)),
        kind="flight",
        noise=SimpleNamespace(free=("accelerometer_wander", "slow")),
    )
    fitted, alone = (Fitted(np.array(at), 0.0, None) for at in ([1.0, 0.5], [0.8, 0.1]))
    suspects = [SimpleNamespace(recording=0, fitted=alone)] if sure_alone else []
    found = [one[0].noise_point.tolist() for one in other_noise([case], SimpleNamespace(fitted=[fitted]), suspects)]
    assert found == [[QUIET, 0.5]] * (not coarse) + [[0.8, 0.1]] * sure_alone


def test_all_but_one_kind_of_sensor_are_quiet_and_coarse_ones_never() -> None:
    def points(deg_per_h: float, *at: float) -> list[list[float]]:
        belief = Belief(gyro=GyroBelief(bias_sigma_deg_per_h=deg_per_h))
        case = SimpleNamespace(
            believed=SimpleNamespace(recording=SimpleNamespace(belief=belief)),
            kind="flight",
            noise=SimpleNamespace(free=("accelerometer_wander", "slow_attitude", "gyro_wander", "slow_position")),
        )
        found = SimpleNamespace(cases=[case], fitted=[Fitted(np.array(at), 0.0, None)])
        return [one[0].noise_point.tolist() for one in quiet_but_one(found)]

    at = (1.0, 0.5, 2.0, 0.7)
    assert points(GOOD_DEG_PER_H, *at) == [[1.0, QUIET, QUIET, 0.7], [QUIET, QUIET, 2.0, 0.7]]
    assert points(GOOD_DEG_PER_H, 1.0, QUIET, QUIET, 0.7) == [[QUIET, QUIET, QUIET, 0.7]]
    assert points(COARSE_DEG_PER_H, *at) == [[1.0, QUIET, 2.0, 0.7]]
