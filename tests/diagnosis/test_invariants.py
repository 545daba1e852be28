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
from ins_eval.diagnosis.answer.rivals import rivals
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
from ins_eval.estimation.evidence import SCALES
from ins_eval.estimation.linearisation import Linearisation
from ins_eval.estimation.search import log_bayes_factor, search
from ins_eval.estimation.study import Hypothesis, Sums, space
from ins_eval.policy import Policy
from tests.diagnosis.linearisations import INFORMATION, linearisation

PROBLEMS = 150
LARGE, HALF = 6.0, 1.0  # coefficients: 24 sigma; one that fits nearly as well as another that is alike
SHRUNK = 0.1  # of a size, what a prior takes
SMALL = 0.3  # share of hypotheses, and their largest size
NAMES = (
    "accelerometer.bias_temperature", "accelerometer.scale_temperature", "accelerometer.quadratic", "gyro.bias",
    "gyro.scale", "alignment.heading", "accelerometer.bias_drift", "earth.coriolis",
)  # fmt: skip
CASE = SimpleNamespace(believed=object(), kind="flight", name="flight")
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


def random_linearisation(rng: np.random.Generator, names: tuple[str, ...] = NAMES) -> Linearisation:
    """Columns that resemble each other more or less, effects or none, and a best set that may be a wrong one."""
    count = int(rng.integers(2, 10))
    drawn = [(str(rng.choice(names)), str(rng.choice(list("xyz")))) for _ in range(count)]
    hypotheses = tuple(
        Hypothesis(
            Candidate(name, axis, "ug", 1.0, Column("", ()), {}, 1.0 if name.startswith("earth.") else 0.0),
            (Column("", ()),),
        )
        for name, axis in dict.fromkeys(drawn)
    )
    m = len(hypotheses)
    x = rng.standard_normal((60, m)) + 10.0 ** rng.uniform(-1.0, 1.5) * rng.standard_normal((60, 1))
    x *= 10.0 ** rng.uniform(-1.0, 0.5, m)
    y = x @ (rng.standard_normal(m) * rng.integers(0, 2, m) * 10.0 ** rng.uniform(-1.0, 1.0)) + rng.standard_normal(60)
    here, families = Sums(x.T @ x, x.T @ y, 0.0), space(hypotheses, Policy())
    ranked = tuple(search(here.normal, here.projection, families, Policy.share, Policy()))
    found = Linearisation((), hypotheses, families, np.zeros(m), (), here, ranked)
    if rng.random() < 0.3:  # a set that was navigated with, and is not the best
        found = found.own_first(int(rng.integers(1, m + 1)))
    harms = rng.standard_normal(2) * 4.0 - 2.0
    found.__dict__["held_out"] = SOUND.held_out | dict(zip(("harm_nats", "placebo_nats"), harms, strict=True))
    return found


def random_findings(rng: np.random.Generator) -> Findings:
    found = random_linearisation(rng)
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


def test_a_rival_has_the_size_that_it_would_have() -> None:
    """Of two columns with the correlation `ALIKE` the other one, alone, under the widest prior of a search."""
    effects = [("gyro.bias", "x", {}), ("gyro.g_sensitivity", "x", {})]
    found = linearisation(effects, {0: 6.0}, (0, 1))
    (rival,) = rivals(found, Policy(near=np.inf, listed=np.inf))
    assert rival.hypothesis.candidate.name == "gyro.g_sensitivity"
    of = rival.hypothesis.candidate.nominal
    precision, pull = INFORMATION + 1.0 / SCALES[-1] ** 2, found.here.projection[1]
    assert rival.value == pytest.approx(of * pull / precision, rel=0.05)
    assert rival.sigma == pytest.approx(of / np.sqrt(precision), rel=0.05)


@pytest.mark.parametrize("largest", [1.0, 5.0])
def test_a_twin_larger_than_any_sensor_is_listed_by_the_sizes_that_sensors_have(largest: float) -> None:
    """By quadrature over normal priors that end there; the one that nearly reaches the size that it needs leads, and is
    no rival all the same."""
    effects = [("gyro.bias", "x", {}), ("gyro.g_sensitivity", "x", {})]
    found = linearisation(effects, {0: 6.0}, (0, 1))
    found = replace(found, space=replace(found.space, largest=np.array([np.inf, largest])))
    assert np.isneginf(found.places(0)[0][1])
    (rival,) = rivals(found, Policy(twin=np.inf))
    a, b = found.here.normal[1, 1], found.here.projection[1]
    c = np.linspace(-largest, largest, 20_001)
    priors = [np.exp(-0.5 * (c / s) ** 2) for s in SCALES]
    each = [np.trapezoid(p * np.exp(b * c - 0.5 * a * c**2), c) / np.trapezoid(p, c) for p in priors]
    expected = found.gain([0]) - np.log(np.mean(each))
    assert rival.below_best == pytest.approx(max(expected, Policy.near), rel=1e-3)
    assert not rival.below_best < Policy.near
    assert rival.value > largest * rival.hypothesis.candidate.nominal


def test_nats_count_as_far_as_scatter_is_noise_for_effects_and_rivals_alike() -> None:
    """An effect that scatters twice as far as noise allows for: a quarter of the nats, and probabilities of them."""
    found = linearisation([("gyro.bias", "x", {}), ("gyro.g_sensitivity", "x", {})], {0: LARGE}, (0, 1))
    assert not rivals(found, Policy())
    (k,), places = found.best.members, found.places(found.best.members[0])[0]
    found.__dict__["scatter"] = 4.0 * np.diag(found.coefficients[1])
    assert found.trust(k) == pytest.approx(0.25)
    (rival,) = rivals(found, Policy(near=np.inf, listed=np.inf))
    assert rival.below_best == pytest.approx(0.25 * abs(places[0] - places[1]))
    odds = np.exp(0.25 * (places - places.max()))
    nothing = np.exp(found.space.cost - 0.25 * places.max())
    assert rival.probability == pytest.approx(odds.min() / (odds.sum() + nothing))


@pytest.mark.parametrize(
    ("below", "alike", "listed"), [(1.0, None, True), (3.5, None, False), (3.5, (0, 3), True), (-0.1, None, False)]
)
def test_what_is_an_effect_at_another_noise_is_listed_where_it_is_near(
    monkeypatch, below: float, alike: tuple[int, int] | None, listed: bool
) -> None:
    """Within 3 nats, and within 4.6 where there is a rival anyway; the one that both have is none."""
    effects = [("gyro.bias", axis, {}) for axis in "xyz"] + [("gyro.g_sensitivity", "x", {})]
    ours = linearisation(effects, {0: HALF if alike else LARGE}, alike)
    other = linearisation(effects[:3], {0: LARGE, 1: LARGE, 2: -LARGE})
    monkeypatch.setattr("ins_eval.diagnosis.answer.rivals.more_probable", lambda a, b: below)
    of_noise = {one.hypothesis: one for one in rivals(ours, Policy(), None, [other]) if one.of is None}
    _, y, z = other.hypotheses
    assert set(of_noise) == ({y, z} if listed else set())
    for hypothesis, beside, size in ((y, z, LARGE), (z, y, -LARGE)) if listed else ():
        one = of_noise[hypothesis]
        assert one.beside == (beside,)
        assert one.value == pytest.approx(size, rel=0.05)
        assert one.probability == pytest.approx(1.0 / (1.0 + np.exp(below)))


def test_an_effect_at_another_time_begins_where_the_recordings_were_navigated() -> None:
    """Not with nothing: what was as large as a delay of half a second would be as far off as before it was found."""
    effects = [("gyro.bias_step", "z", {"at_s": at_s}) for at_s in (100.0, 140.0)] + [("gyro.bias", "x", {})]
    found = linearisation(effects, {1: 6.0, 2: 6.0})
    point = np.array([4.0, 0.0, 0.0])
    assert set(found.best.members) == {1, 2}
    begin = dict(zip(found.best.members, replace(found, point=point).where_it_was, strict=True))
    assert begin == {1: 4.0, 2: 0.0}


@pytest.mark.parametrize("seed", range(30))
def test_every_twin_is_listed(seed: int) -> None:
    """By least squares on the sums: what in the place of an effect leaves at most `Policy.twin` more of chi-square."""
    rng = np.random.default_rng([9, seed])
    found = random_linearisation(rng, NAMES[:-1])  # of free size
    a, b, m = found.here.normal, found.here.projection, found.best.members
    small = rng.random(b.size) < SMALL  # than which no sensor's are larger
    small[list(m)] = False
    found = replace(found, space=replace(found.space, largest=np.where(small, SMALL, np.inf)))
    listed = {(one.of, one.hypothesis) for one in rivals(found, Policy())}

    def taken(columns: list[int]) -> float:
        return float(b[columns] @ np.linalg.solve(a[np.ix_(columns, columns)], b[columns]))

    families = found.space.families
    for k in m:
        others = [j for j in m if j != k]
        for j in set(range(len(b))) - set(m):
            more = taken([*others, k]) - taken([*others, j])
            if families[j] not in families[list(m)] and more < Policy.twin - 0.01:
                assert (found.hypotheses[k], found.hypotheses[j]) in listed


def test_effects_of_the_vocabulary_only() -> None:
    assert set(NAMES) <= set(VOCABULARY)
