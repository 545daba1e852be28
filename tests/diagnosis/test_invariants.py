"""An answer that contradicts itself is caught, and none is given, whatever was found."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from ins_eval.diagnosis.answer import invariants
from ins_eval.diagnosis.answer.answer import answer
from ins_eval.diagnosis.answer.decision import Decision, decide
from ins_eval.diagnosis.answer.findings import Findings
from ins_eval.diagnosis.answer.judge import consistent
from ins_eval.diagnosis.answer.verdict import (
    EXPLAINED,
    NO_MISMATCH,
    NOT_IDENTIFIABLE,
    PARTLY,
    Q95,
    UNEXPLAINED,
    Diagnosis,
    FoundEffect,
    Rival,
)
from ins_eval.diagnosis.unnamed.mismatch import Mismatch, UnnamedDisturbance
from ins_eval.effects.vocabulary import VOCABULARY
from ins_eval.error_model.columns import Column
from ins_eval.error_model.library import Candidate
from ins_eval.estimation.linearisation import Linearisation
from ins_eval.estimation.search import log_bayes_factor
from ins_eval.estimation.study import Hypothesis
from ins_eval.policy import Policy
from tests.diagnosis.linearisations import INFORMATION, NAMES, linearisation, random_linearisation

PROBLEMS = 150
SHRUNK = 0.1  # of a size, what a prior takes
CASE = SimpleNamespace(believed=object(), kind="flight", name="flight", unmeasured=lambda: {"gyro.z": 1.0})
STUCK = SimpleNamespace(believed=object(), kind="flight", name="flight", unmeasured=lambda: {"accelerometer.x": 0.06})
PLACE = Mismatch(0, "gyro.x", "x", 0.0, 100.0, "", 9.0)
NOTHING_LEFT, LEFT = UnnamedDisturbance(None, 0.0, 1.0), UnnamedDisturbance(PLACE, 40.0, 9.0)


def hypothesis(name: str, centre: float = 0.0) -> Hypothesis:
    return Hypothesis(Candidate(name, "x", "ug", 2.0, Column("", ()), {}, centre), (Column("", ()),))


EFFECT = FoundEffect(hypothesis("accelerometer.bias_drift"), 10.0, 1.0, 0.97, 40.0, 1e-4)
NEAR = Rival(EFFECT.hypothesis, hypothesis("accelerometer.bias_temperature"), 0.3, 1.0, False)
SOUND = Diagnosis(
    (CASE,), EXPLAINED, (EFFECT,), (), (PLACE,), NOTHING_LEFT, (), (), (), {},
    {"before": 2.0, "after": 1.0, "placebo": 2.0, "harm_nats": -30.0, "placebo_nats": -30.0}, (), None, Policy(),
)  # fmt: skip
FIXED = replace(EFFECT, hypothesis=hypothesis("earth.coriolis", 1.0), value=2.0, sigma=3.0)


@pytest.mark.parametrize("sound", [
    SOUND,
    replace(SOUND, verdict=PARTLY, unnamed=LEFT),
    replace(SOUND, verdict=NOT_IDENTIFIABLE, rivals=(NEAR,), effects=(replace(EFFECT, probability=0.3),)),
    replace(SOUND, rivals=(replace(NEAR, below_best=4.0),)),  # a twin that only priors keep apart
    replace(SOUND, effects=(FIXED,)),  # is supported by the value that physics fixes
    replace(SOUND, verdict=UNEXPLAINED, unnamed=LEFT, effects=()),
    replace(SOUND, verdict=NO_MISMATCH, effects=(), mismatches=()),
])  # fmt: skip
def test_a_sound_answer_violates_nothing(sound: Diagnosis) -> None:
    assert not invariants.violations(sound)
    assert invariants.tells_one_story(sound)


def spoiled(**changes) -> Diagnosis:
    return replace(SOUND, effects=(replace(EFFECT, **changes),))


CROWD = ("bias_drift", "quadratic", "cubic", "bias_temperature", "scale_temperature")  # of one accelerometer
CROWDED = linearisation([(f"accelerometer.{name}", "x", {}) for name in CROWD], dict.fromkeys(range(5), 6.0))
ONE = linearisation([("gyro.bias", "x", {})], {0: 6.0})
BESIDE = replace(SOUND, verdict=PARTLY, unnamed=LEFT, departure_sigma=LEFT.significance_sigma, linearisation=ONE)
BAD = [
    (
        invariants.few,
        replace(
            SOUND, linearisation=CROWDED, effects=tuple(replace(EFFECT, hypothesis=one) for one in CROWDED.hypotheses)
        ),
    ),
    (invariants.probable, spoiled(probability=0.3)),
    (invariants.probable, replace(spoiled(probability=0.1), verdict=NOT_IDENTIFIABLE, rivals=(NEAR,))),
    (invariants.probable, spoiled(probability=np.nan)),
    (invariants.accounting, spoiled(log_evidence_gain=0.0)),
    (invariants.predictive, replace(SOUND, held_out=SOUND.held_out | {"harm_nats": 6.0})),
    (invariants.predictive, replace(SOUND, held_out=SOUND.held_out | {"placebo_nats": 6.0})),
    (invariants.clearer, replace(BESIDE, effects=(replace(EFFECT, log_evidence_gain=ONE.space.cost + 4.0),))),
    (invariants.measuring, replace(SOUND, cases=(CASE, STUCK))),
    (invariants.sized, spoiled(sigma=6.0)),
    (invariants.sized, spoiled(value=np.nan)),
    (invariants.sized, spoiled(hypothesis=hypothesis("accelerometer.scale"), value=1e9)),
    (invariants.leading, replace(SOUND, rivals=(replace(NEAR, below_best=-389.5),))),
    (invariants.sufficient, replace(SOUND, unnamed=replace(NOTHING_LEFT, significance_sigma=47.5))),
    (invariants.sufficient, replace(SOUND, unnamed=LEFT)),
    (invariants.one_story, replace(SOUND, rivals=(NEAR,))),
    (invariants.one_story, replace(SOUND, verdict=NOT_IDENTIFIABLE)),
    (invariants.one_story, replace(SOUND, verdict=PARTLY)),
    (invariants.one_story, replace(SOUND, verdict=NO_MISMATCH)),
    (invariants.one_story, replace(SOUND, verdict=UNEXPLAINED, unnamed=LEFT)),
]


@pytest.mark.parametrize(("invariant", "bad"), BAD)
def test_a_bad_answer_is_caught(invariant, bad: Diagnosis) -> None:
    assert invariant(bad) == bad.effects
    assert invariants.violations(bad)


def test_every_invariant_is_tried() -> None:
    assert {invariant for invariant, _ in BAD} == set(invariants.INVARIANTS)


def test_what_is_withdrawn_is_left_unexplained_and_logged() -> None:
    """Where more is asked of a probability than the second effect has."""
    found = linearisation([("gyro.bias", "x", {}), ("accelerometer.bias_drift", "y", {})], {0: 6.0, 1: 1.5})
    other = replace(PLACE, channel="accelerometer.y", significance_sigma=7.0)
    shown = tuple(PLACE if k == 0 else other for k in found.best.members)
    findings = Findings((CASE,), (), (), (), found, found.best.log_bayes_factor, NOTHING_LEFT, NOTHING_LEFT, shown)
    decision = Decision(EXPLAINED, NOTHING_LEFT, shown, named=True)
    large, small = consistent(findings, decision, Policy()).effects
    assert small.probability < large.probability
    told = consistent(findings, decision, Policy(probable=0.5 * (small.probability + large.probability)))
    assert told.verdict == PARTLY
    assert [one.hypothesis.candidate.name for one in told.effects] == ["gyro.bias"]
    assert told.unnamed.mismatch == other
    (entry,) = answer(replace(told, cases=(), mismatches=()))["withdrawn"]
    assert (entry["name"], entry["axis"]) == ("accelerometer.bias_drift", "y")
    assert "probability" in entry["reason"]
    nothing = consistent(findings, decision, Policy(probable=1.1))
    assert (nothing.verdict, nothing.effects, len(nothing.withdrawn)) == (UNEXPLAINED, (), 2)
    assert nothing.unnamed.mismatch == PLACE


def test_what_is_withdrawn_does_not_count_against_what_stays() -> None:
    """A scale factor of 7 sigma that no sensor has beside a bias of 3; before, nothing was left without a name."""
    found = linearisation([("gyro.bias", "x", {}), ("accelerometer.scale", "y", {})], {0: 1.0, 1: 2.5})
    bias, scale = found.hypotheses
    impossible = replace(scale, candidate=replace(scale.candidate, nominal=1e6))
    found = replace(found, hypotheses=(bias, impossible), space=replace(found.space, largest=np.array([np.inf, 0.1])))
    shown = tuple(replace(PLACE, significance_sigma=3.0 if k == 0 else 7.0) for k in found.best.members)
    findings = Findings((CASE,), (), (), (), found, found.best.log_bayes_factor, NOTHING_LEFT, NOTHING_LEFT, shown)
    told = consistent(findings, Decision(EXPLAINED, NOTHING_LEFT, shown, named=True), Policy())
    assert told.verdict == PARTLY
    assert [one.hypothesis for one in told.effects] == [bias]
    assert told.unnamed.significance_sigma == 7.0


def test_of_two_that_share_an_error_one_is_left_out_and_the_other_takes_it_over() -> None:
    """Beside one another either could be nothing; together they are not."""
    found = linearisation([("gyro.bias", "x", {}), ("gyro.bias_drift", "x", {})], {0: 0.95, 1: 0.7}, alike=(0, 1))
    found = found.own_first(2)
    found.__dict__["held_out"] = SOUND.held_out
    shown = (PLACE, PLACE)
    findings = Findings((CASE,), (), (), (), found, found.best.log_bayes_factor, NOTHING_LEFT, NOTHING_LEFT, shown)
    both, covariance = found.coefficients
    assert (np.abs(both) < Q95 * np.sqrt(np.diag(covariance))).all()
    told = consistent(findings, Decision(EXPLAINED, NOTHING_LEFT, shown, named=True), Policy())
    (effect,), (other,) = told.effects, told.withdrawn
    assert (effect.hypothesis, other.effect.hypothesis) == found.hypotheses
    together = found.here.projection[0] / INFORMATION
    assert effect.value == pytest.approx(together, rel=SHRUNK)
    assert any(one.__doc__.startswith(other.reason) for one in invariants.NOTHING)


def test_what_is_set_aside_stays_in_the_fit() -> None:
    """Two columns of much the same: the coefficient of one beside the other by normal equations, named or not."""
    found = linearisation([("gyro.bias", "x", {}), ("gyro.bias_drift", "x", {})], {0: 20.0, 1: 6.0}, alike=(0, 1))
    found = found.own_first(2)
    both, covariance = found.coefficients
    scales = log_bayes_factor(found.here.normal, found.here.projection, found.space.centre)[1]
    joint = np.linalg.solve(found.here.normal + np.diag(scales**-2.0), found.here.projection)
    np.testing.assert_allclose(both, joint)
    left = found.set_aside({1})
    assert left.best.members == (0,)
    np.testing.assert_allclose(left.coefficients[0], joint[:1])
    np.testing.assert_allclose(left.coefficients[1], covariance[:1, :1])
    of_family, _ = left.places(0)
    assert of_family[found.space.families[1]] == 0.0


@pytest.mark.parametrize(("late", "verdict"), [(30.0, PARTLY), (6.0, UNEXPLAINED)])
def test_what_describes_a_sensor_is_not_named_beside_what_explains_most(late: float, verdict: str) -> None:
    effects = [("gps.lever_arm", "x", {}), *((f"accelerometer.{name}", "z", {}) for name in CROWD)]
    found = linearisation(effects, dict.fromkeys(range(1, 6), 6.0) | {0: late})
    found.__dict__["held_out"] = SOUND.held_out
    shown = tuple(replace(PLACE, significance_sigma=7.0 + k) for k in found.best.members)
    gain = found.best.log_bayes_factor
    findings = Findings((CASE,), (), (), (), found, gain, NOTHING_LEFT, NOTHING_LEFT, shown, suspects=())
    told = consistent(findings, decide(findings, Policy()), Policy())
    assert told.verdict == verdict
    assert [one.hypothesis.candidate.name for one in told.effects] == (["gps.lever_arm"] if verdict == PARTLY else [])
    assert told.unnamed.mismatch is not None


def random_findings(rng: np.random.Generator) -> Findings:
    found = random_linearisation(rng)
    harms = rng.standard_normal(2) * 4.0 - 2.0
    found.__dict__["held_out"] = SOUND.held_out | dict(zip(("harm_nats", "placebo_nats"), harms, strict=True))
    shown = tuple(replace(PLACE, significance_sigma=float(rng.uniform(0.0, 20.0))) for _ in found.best.members)

    def unnamed() -> UnnamedDisturbance:
        sigma = float(10.0 ** rng.uniform(-1.0, 2.0))
        place = replace(PLACE, significance_sigma=sigma) if rng.random() < 0.5 else None
        return UnnamedDisturbance(place, float(rng.uniform(-20.0, 60.0)), sigma)

    instead = replace(unnamed(), mismatch=PLACE)
    return Findings((CASE,), (), (), (), found, found.best.log_bayes_factor, instead, unnamed(), shown)


@pytest.mark.parametrize(
    ("verdict", "left", "size", "then"),
    [
        (PARTLY, LEFT, 6.0, PARTLY),
        (EXPLAINED, NOTHING_LEFT, 30.0, EXPLAINED),
        (EXPLAINED, NOTHING_LEFT, 1.2, NOT_IDENTIFIABLE),
    ],
)
def test_an_effect_gives_its_place_to_a_rival_above_it(verdict: str, left, size: float, then: str) -> None:
    """Recordings were navigated with the less probable of two that are alike; the other may be far above it or near."""
    found = linearisation([("gyro.bias", "x", {}), ("gyro.g_sensitivity", "x", {})], {1: size}, (0, 1)).own_first(1)
    findings = Findings((CASE,), (), (), (), found, found.best.log_bayes_factor, NOTHING_LEFT, left, (PLACE,))
    found.__dict__["held_out"] = SOUND.held_out
    told = consistent(findings, Decision(verdict, left, (PLACE,), named=True), Policy())
    assert told.verdict == then
    assert [one.hypothesis.candidate.name for one in told.effects] == ["gyro.g_sensitivity"]
    assert not told.withdrawn


@pytest.mark.parametrize(
    ("shows", "left", "stands"), [(3.5, 4.5, False), (3.5, 2.5, True), (4.9, 9.0, False), (5.1, 9.0, True)]
)
def test_what_shows_less_than_what_no_name_explains_may_be_a_part_of_it(shows, left, stands) -> None:
    """As deviates sqrt(2 nats) beyond what the choice of an effect costs."""
    effect = replace(EFFECT, log_evidence_gain=ONE.space.cost + 0.5 * shows**2)
    found = replace(BESIDE, effects=(effect,), departure_sigma=left)
    assert invariants.clearer(found) == (() if stands else (effect,))
    assert not invariants.clearer(replace(found, verdict=EXPLAINED))


@pytest.mark.parametrize("block", range(5))
def test_no_answer_to_a_random_problem_contradicts_itself(block: int) -> None:
    verdicts = set()
    for seed in range(block * PROBLEMS // 5, (block + 1) * PROBLEMS // 5):
        findings = random_findings(np.random.default_rng([23, seed]))
        told = consistent(findings, decide(findings, Policy()), Policy())
        assert not invariants.violations(told), seed
        assert invariants.tells_one_story(told), (seed, told.verdict)
        verdicts.add(told.verdict)
    assert len(verdicts) > 2


def test_two_that_each_lie_above_the_other_do_not_change_places_for_ever(monkeypatch) -> None:
    """What others stand beside decides which of two leads; here each leads where the other stands."""
    found = linearisation([("gyro.bias", "x", {}), ("gyro.g_sensitivity", "x", {})], {0: 6.0}, (0, 1)).own_first(1)
    found.__dict__["held_out"] = SOUND.held_out
    findings = Findings((CASE,), (), (), (), found, found.best.log_bayes_factor, NOTHING_LEFT, LEFT, (PLACE,))
    asked = iter(range(10))

    def leading(one: Linearisation, *_: object) -> tuple[Rival, ...]:
        next(asked)  # ends where it is asked for ever
        (k,) = one.best.members
        return (Rival(one.hypotheses[k], one.hypotheses[1 - k], 0.4, -1.0, False),)

    monkeypatch.setattr("ins_eval.diagnosis.answer.judge.rivals", leading)
    told = consistent(findings, Decision(PARTLY, LEFT, (PLACE,), named=True), Policy())
    assert len(told.withdrawn) == 1 and not told.effects


def test_an_effect_at_another_time_begins_where_the_recordings_were_navigated() -> None:
    """Not with nothing: what was as large as a delay of half a second would be as far off as before it was found."""
    effects = [("gyro.bias_step", "z", {"at_s": at_s}) for at_s in (100.0, 140.0)] + [("gyro.bias", "x", {})]
    found = linearisation(effects, {1: 6.0, 2: 6.0})
    point = np.array([4.0, 0.0, 0.0])
    assert set(found.best.members) == {1, 2}
    begin = dict(zip(found.best.members, replace(found, point=point).where_it_was, strict=True))
    assert begin == {1: 4.0, 2: 0.0}


def test_effects_of_the_vocabulary_only() -> None:
    assert set(NAMES) <= set(VOCABULARY)
