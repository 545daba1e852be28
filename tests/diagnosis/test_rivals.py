"""What else it could be: rivals and twins by hand-made sums, against quadrature and least squares."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ins_eval.diagnosis.answer.rivals import rivals
from ins_eval.estimation.evidence import SCALES
from ins_eval.policy import Policy
from tests.diagnosis.linearisations import INFORMATION, NAMES, linearisation, random_linearisation

LARGE, HALF = 6.0, 1.0  # coefficients: 24 sigma; one that fits nearly as well as another that is alike
SMALL = 0.3  # share of hypotheses, and their largest size
NEGLIGIBLE_NATS = 0.01
STEP_S = 20.0  # between instants that were tried


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


@pytest.mark.parametrize("beside", [False, True])
@pytest.mark.parametrize("largest", [1.0, 5.0])
def test_a_twin_larger_than_any_sensor_is_listed_by_the_sizes_that_sensors_have(largest: float, beside: bool) -> None:
    """By quadrature over normal priors that end there; the one that nearly reaches the size that it needs leads, and is
    no rival all the same. What stands beside them, and shares nothing with them, changes nothing."""
    effects = [("gyro.bias", "x", {}), ("gyro.g_sensitivity", "x", {}), *([("gyro.bias", "y", {})] if beside else [])]
    found = linearisation(effects, {0: 6.0, 2: 20.0}, (0, 1))
    found = replace(found, space=replace(found.space, largest=np.array([np.inf, largest, np.inf])[: len(effects)]))
    assert np.isneginf(found.places(0)[0][1])
    (rival,) = (one for one in rivals(found, Policy(twin=np.inf)) if one.of is found.hypotheses[0])
    a, b = found.here.normal[1, 1], found.here.projection[1]
    c = np.linspace(-largest, largest, 20_001)
    priors = [np.exp(-0.5 * (c / s) ** 2) for s in SCALES]
    each = [np.trapezoid(p * np.exp(b * c - 0.5 * a * c**2), c) / np.trapezoid(p, c) for p in priors]
    expected = found.gain([0]) - np.log(np.mean(each))
    assert rival.below_best == pytest.approx(max(expected, Policy.near), rel=1e-3)
    assert not rival.below_best < Policy.near
    assert rival.value > largest * rival.hypothesis.candidate.nominal


def test_sums_count_as_far_as_scatter_is_noise_for_effects_and_rivals_alike() -> None:
    """An effect that scatters twice as far as noise allows for: a quarter of the log likelihood, by quadrature."""
    found = linearisation([("gyro.bias", "x", {}), ("gyro.g_sensitivity", "x", {})], {0: LARGE}, (0, 1))
    assert not rivals(found, Policy())
    (k,) = found.best.members
    found.__dict__["scatter"] = 4.0 * np.diag(found.coefficients[1])
    assert found.trust(k) == pytest.approx(0.25)
    (rival,) = rivals(found, Policy(near=np.inf, listed=np.inf))
    assert rival.sigma == pytest.approx(2.0 * rival.hypothesis.candidate.nominal / np.sqrt(INFORMATION), rel=0.05)
    c = np.linspace(-600.0, 600.0, 200_001)
    priors = [np.exp(-0.5 * (c / s) ** 2) / (s * np.sqrt(2.0 * np.pi)) for s in SCALES]
    heights = [0.25 * (found.here.projection[j] * c - 0.5 * INFORMATION * c**2) for j in (k, 1 - k)]
    nats = np.log([np.mean([np.trapezoid(p * np.exp(height), c) for p in priors]) for height in heights])
    assert rival.below_best == pytest.approx(nats[0] - nats[1], rel=1e-3)
    assert rival.probability == pytest.approx(
        np.exp(nats[1]) / (np.exp(nats).sum() + np.exp(found.space.cost)), rel=1e-2
    )


def test_among_many_instants_one_that_scatters_still_costs_its_choice() -> None:
    """A constant, and a jump at one of fifty instants that fits alike: log 50 less likely, whatever the trust."""
    count = 50
    effects = [("gyro.bias", "x", {}), *(("gyro.bias_step", "x", {"at_s": 100.0 + k}) for k in range(count))]
    found = linearisation(effects, {0: LARGE}, (0, 1))
    normal = found.here.normal.copy()
    normal[0, 1] = normal[1, 0] = (1.0 - 1e-6) * INFORMATION
    projection = found.here.projection.copy()
    projection[1] = projection[0]
    found = replace(found, here=replace(found.here, normal=normal, projection=projection))
    for scatter in (1.0, 4.0):
        found.__dict__["scatter"] = scatter * np.diag(found.coefficients[1])
        (rival,) = rivals(found, Policy(near=np.inf, listed=np.inf))
        assert rival.below_best == pytest.approx(np.log(count), abs=NEGLIGIBLE_NATS)


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


@pytest.mark.parametrize(("takes", "share", "listed"), [(2e4, 7e-4, True), (2e4, 1.6e-3, False), (28.0, 0.5, False)])
def test_a_twin_of_a_large_effect_may_differ_by_what_linear_sums_leave_open(takes, share, listed) -> None:
    """Two columns, of which one leaves so large a `share` of what the other `takes` off chi-square: 14, 32 and 14."""
    size = np.sqrt(takes / INFORMATION)
    found = linearisation([("gyro.bias", "x", {}), ("gyro.g_sensitivity", "x", {})], {0: size}, (0, 1))
    normal = INFORMATION * np.array([[1.0, np.sqrt(1.0 - share)], [np.sqrt(1.0 - share), 1.0]])
    found = replace(found, here=replace(found.here, normal=normal, projection=normal @ [size, 0.0]))
    assert share * takes > Policy.twin
    assert bool(rivals(found, Policy())) == listed


def test_a_rival_jumps_at_an_instant_that_is_known_to_the_steps_that_were_tried() -> None:
    """Of four instants one fits as the effect does nearly, and the others hardly: half way to its neighbours."""
    instants = [100.0 + STEP_S * k for k in range(4)]
    effects = [("gyro.bias", "x", {}), *(("gyro.bias_step", "x", {"at_s": at_s}) for at_s in instants)]
    found = linearisation(effects, {0: LARGE}, (0, 2))
    listed = {one.hypothesis.candidate.name: one for one in rivals(found, Policy(near=np.inf, listed=np.inf))}
    step = listed["gyro.bias_step"]
    assert step.hypothesis.candidate.parameters["at_s"] == instants[1]
    low, high = step.spread["at_s"]
    assert [low, high] == pytest.approx(instants[1] + 0.5 * STEP_S * np.array([-1.0, 1.0]), abs=0.01 * STEP_S)


def test_instants_of_another_recording_are_none_of_a_rival() -> None:
    """Steps are of one recording each; those of the second fit nearly as well as those of the first."""
    instants = [(100.0 + STEP_S * k, r) for r in range(2) for k in range(3)]
    effects = [("gyro.bias", "x", {}), *(("gyro.bias_step", "x", {"at_s": at_s + 5000.0 * r}) for at_s, r in instants)]
    found = linearisation(effects, {0: LARGE}, (0, 2))
    column = found.hypotheses[0].columns[0]
    columns = [(column, column), *((column, None) if r == 0 else (None, column) for _, r in instants)]
    ones = tuple(replace(one, columns=c) for one, c in zip(found.hypotheses, columns, strict=True))
    normal = found.here.normal.copy()
    normal[0, 5] = normal[5, 0] = normal[0, 2]
    projection = found.here.projection.copy()
    projection[5] = projection[2]
    found = replace(found, hypotheses=ones, here=replace(found.here, normal=normal, projection=projection))
    listed = {one.hypothesis.candidate.name: one for one in rivals(found, Policy(near=np.inf, listed=np.inf))}
    step = listed["gyro.bias_step"]
    at_s, (low, high) = step.hypothesis.candidate.parameters["at_s"], step.spread["at_s"]
    assert [low, high] == pytest.approx(at_s + 0.5 * STEP_S * np.array([-1.0, 1.0]), abs=0.01 * STEP_S)
