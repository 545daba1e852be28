"""Evidence of sets of effects against explicit Gaussian densities, and what the search makes of it."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import logsumexp
from scipy.stats import binom, chi2, multivariate_normal, truncnorm

from ins_eval.estimation.evidence import SCALES
from ins_eval.estimation.search import (
    NO_SENSOR,
    Space,
    chi_square_gains,
    conditional,
    log_bayes_factor,
    one_more,
    search,
)
from ins_eval.policy import Policy

ROUNDING = 1e-8
ONE_AT_A_TIME = 0.3  # nats of a sum over the scales of one effect at a time
FREE_PRIOR = 1e-4  # of chi-square, what a prior of any size leaves
DRAWS = 200
UNLIKELY = 1e-4  # probability that a right rate is refused
ROWS = 40
FAR = 10.0  # sigmas of the prior beyond its centre, where nothing is left of it


def density(y: np.ndarray, x: np.ndarray, centre: np.ndarray, scales) -> float:
    """log N(y; X c, I + X diag(s^2) X')."""
    covariance = np.eye(y.size) + (x * np.asarray(scales) ** 2) @ x.T
    return float(multivariate_normal.logpdf(y, x @ centre, covariance))


def explicit(y: np.ndarray, x: np.ndarray, centre: np.ndarray) -> tuple[float, tuple[float, ...]]:
    """log B over every combination of scales, and the combination with the highest density."""
    each = {s: density(y, x, centre, s) for s in product(*(SCALES if c == 0.0 else (1.0,) for c in centre))}
    null = density(y, x, np.zeros_like(centre), np.zeros(centre.size))
    return float(logsumexp(list(each.values())) - np.log(len(each)) - null), max(each, key=each.__getitem__)


def of(families, centre=None, handicap=None, sensor=None) -> Space:
    families = np.asarray(families)
    zeros = np.zeros(families.size)
    centre = zeros if centre is None else np.array(centre)
    handicap = zeros if handicap is None else handicap
    nothing = np.full(families.size, np.inf)
    nowhere = np.full(families.size, NO_SENSOR) if sensor is None else np.array(sensor)
    return Space(families, centre, handicap, np.zeros(families.size, dtype=bool), nowhere, Policy.odds, nothing)


@pytest.fixture(scope="module")
def regression() -> tuple[np.ndarray, np.ndarray]:
    """Six columns that are far from orthogonal (n, 6), and data (n,) that hold two of them."""
    rng = np.random.default_rng(11)
    x = rng.standard_normal((ROWS, 6)) @ (np.eye(6) + 0.4 * rng.standard_normal((6, 6)))
    return x, x[:, 1] * 2.0 - x[:, 3] * 0.7 + rng.standard_normal(ROWS)


@pytest.mark.parametrize("centre", [(0.0,), (2.5,), (0.0, 0.0), (0.0, -1.5), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)])
def test_a_set_against_the_density_of_the_data(regression, centre) -> None:
    x, y = regression
    x, centre = x[:, 1 : 1 + len(centre)], np.array(centre)
    found, scales = log_bayes_factor(x.T @ x, x.T @ y, centre)
    expected, best = explicit(y, x, centre)
    assert found == pytest.approx(expected, abs=ROUNDING)
    assert tuple(scales) == best


def test_the_empty_set_is_the_null() -> None:
    found, scales = log_bayes_factor(np.zeros((0, 0)), np.zeros(0), np.zeros(0))
    assert (found, scales.size) == (0.0, 0)


@pytest.mark.parametrize("centre", [(0.0,) * 6, (0.0, 1.5, 0.0, 0.0, 0.0, 0.0)])
def test_conditional_sums_are_those_of_a_joint_regression(regression, centre) -> None:
    """Rows that state the priors of the chosen columns are added; what they explain of all others is taken off."""
    x, y = regression
    centre, chosen = np.array(centre), [1, 3]
    _, scales = explicit(y, x[:, chosen], centre[chosen])
    prior = np.diag(1.0 / np.asarray(scales))
    design = np.concatenate([x[:, chosen], prior])
    everything = np.concatenate([x, np.zeros((2, 6))])
    data = np.concatenate([y, prior @ centre[chosen]])
    left = data - design @ np.linalg.lstsq(design, data)[0]
    others = [0, 2, 4, 5]
    own = everything[:, others] - design @ np.linalg.lstsq(design, everything[:, others])[0]
    a, b = conditional(x.T @ x, x.T @ y, chosen, centre)
    np.testing.assert_allclose(a[others], np.sum(own**2, axis=0), rtol=ROUNDING)
    np.testing.assert_allclose(b[others], own.T @ left, rtol=ROUNDING)
    a, b = conditional(x.T @ x, x.T @ y, [], centre)
    np.testing.assert_allclose(a, np.sum(x**2, axis=0))
    np.testing.assert_allclose(b, x.T @ y)


@pytest.mark.parametrize("chosen", [[], [1], [1, 3]])
def test_a_family_has_the_mean_over_its_members(regression, chosen) -> None:
    """Each member beside the chosen ones, by densities over every combination of scales; a chosen family is out."""
    x, y = regression
    space = of([2, 0, 1, 3, 1, 1], centre=[0.0, 0.0, 0.0, 0.0, 1.2, 0.0], handicap=np.array([0.0, 0, 0, 0, 0, 1.7]))
    of_family, best = one_more(x.T @ x, x.T @ y, chosen, space)
    beside = list(product(SCALES, repeat=len(chosen)))
    base = logsumexp([density(y, x[:, chosen], np.zeros(len(chosen)), scales) for scales in beside])

    def of_one_sign(k: int, scales: tuple[float, ...]) -> float:
        """The prior of physics is cut off at 0, by quadrature over the coefficient."""
        prior = truncnorm(-space.centre[k], np.inf, loc=space.centre[k])

        def weighted(p: float) -> float:
            centre = np.append(np.zeros(len(chosen)), p)
            return np.exp(density(y, x[:, [*chosen, k]], centre, (*scales, 0.0)) - base) * prior.pdf(p)

        return float(np.log(quad(weighted, 0.0, FAR, epsabs=0.0)[0]))

    def gain(k: int) -> float:
        if space.centre[k] != 0.0:
            return float(logsumexp([of_one_sign(k, scales) for scales in beside]) - space.handicap[k])
        centre = np.zeros(len(chosen) + 1)
        each = [density(y, x[:, [*chosen, k]], centre, (*scales, s)) for scales in beside for s in SCALES]
        return float(logsumexp(each) - np.log(len(SCALES)) - base - space.handicap[k])

    for family in range(4):
        members = np.flatnonzero(space.families == family)
        if set(members) & set(chosen):
            assert of_family[family] == -np.inf
            continue
        gains = [gain(k) for k in members]
        error = ONE_AT_A_TIME if chosen else ROUNDING
        assert of_family[family] == pytest.approx(logsumexp(gains) - np.log(members.size), abs=error)
        assert best[family] == members[int(np.argmax(gains))]


def test_an_effect_that_cancels_another_makes_it_large() -> None:
    """An offset that seems small without a drift, which it cancels in the middle: log B by densities."""
    t = np.linspace(-1.0, 3.0, ROWS)
    x = 10.0 * np.column_stack([np.ones(ROWS), t, t > 1.0])
    y = 9.0 * x[:, 1] - 8.97 * x[:, 0]
    nothing = np.zeros(1)
    alone, scales = explicit(y, x[:, :1], nothing)
    assert scales[0] < 1.0
    of_family, _ = one_more(x.T @ x, x.T @ y, [0], of(range(3)))
    for k in (1, 2):
        both, _ = explicit(y, x[:, [0, k]], np.zeros(2))
        assert of_family[k] == pytest.approx(both - alone, abs=ONE_AT_A_TIME)


@pytest.mark.parametrize("chosen", [[], [0], [0, 2]])
def test_what_a_column_takes_of_chi_square_at_any_size_is_that_of_least_squares(regression, chosen) -> None:
    x, y = regression
    gains = chi_square_gains(x.T @ x, x.T @ y, chosen, of(range(x.shape[1])))

    def left(columns: list[int]) -> float:
        return float(np.sum((y - x[:, columns] @ np.linalg.lstsq(x[:, columns], y)[0]) ** 2))

    for k in set(range(x.shape[1])) - set(chosen):
        assert gains[k] == pytest.approx(left(chosen) - left([*chosen, k]), abs=FREE_PRIOR)


def test_a_column_that_the_set_holds_already_adds_nothing(regression) -> None:
    x, y = regression
    x = np.column_stack([x, 5e3 * x[:, 1]])
    of_family, _ = one_more(x.T @ x, x.T @ y, [6], of(range(7)))
    assert abs(of_family[1]) < 0.2


def test_the_cost_of_an_effect() -> None:
    assert of([0, 0, 1, 2, 2]).cost == pytest.approx(np.log(3 / Policy.odds))


def decoyed(size: float) -> tuple[np.ndarray, np.ndarray]:
    """Data that hold the columns 0 and 1, with column 2 close to their sum, among 40 of noise."""
    rng = np.random.default_rng(5)
    q = np.linalg.qr(rng.standard_normal((60, 43)))[0]
    q[:, 2] = 0.93 * (q[:, 0] + q[:, 1]) / np.sqrt(2.0) + np.sqrt(1.0 - 0.93**2) * q[:, 2]
    return 20.0 * q, size * (q[:, 0] + q[:, 1]) + rng.standard_normal(60)


def test_the_beam_finds_a_pair_that_forward_selection_misses() -> None:
    x, y = decoyed(20.0)
    a, b, space = x.T @ x, x.T @ y, of(range(43))
    of_family, best = one_more(a, b, [], space)
    decoy = int(best[np.argmax(of_family)])
    assert decoy == 2
    ranked = search(a, b, space, Policy.share, Policy())
    assert set(ranked[0].members) == {0, 1}
    with_decoy = max(explicit(y, x[:, [decoy, k]], np.zeros(2))[0] for k in (0, 1))
    assert explicit(y, x[:, [0, 1]], np.zeros(2))[0] > with_decoy + 10.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_what_has_its_sign_from_physics_is_in_no_set_against_it(sign: float) -> None:
    """Two columns that are nearly one, of which the first is expected: alone it fits, with the other it would turn."""
    rng = np.random.default_rng(6)
    q = np.linalg.qr(rng.standard_normal((60, 3)))[0]
    x = 40.0 * np.column_stack([q[:, 0], 0.95 * q[:, 0] + np.sqrt(1.0 - 0.95**2) * q[:, 1], q[:, 2]])
    y = x @ [sign * 2.0, 3.0, 0.0] + rng.standard_normal(60)
    sets = {
        frozenset(one.members)
        for one in search(x.T @ x, x.T @ y, of(range(3), centre=[2.0, 0.0, 0.0]), Policy.share, Policy())
    }
    assert {frozenset({0}), frozenset({1})} <= sets
    assert (frozenset({0, 1}) in sets) == (sign > 0.0)


def test_what_a_set_gains_is_what_the_density_says() -> None:
    """Up to what its first effect loses by standing at one of the four scales."""
    x, y = decoyed(20.0)
    sets = [one for one in search(x.T @ x, x.T @ y, of(range(43)), Policy.share, Policy()) if 0 < len(one.members) < 3]
    for one in sets[:12]:
        members = list(one.members)
        expected, _ = explicit(y, x[:, members], np.zeros(len(members)))
        assert one.log_bayes_factor == pytest.approx(expected, abs=ROUNDING + np.log(len(SCALES)) * (len(members) - 1))
        assert one.log_posterior == pytest.approx(one.log_bayes_factor - len(members) * np.log(43 / Policy.odds))


def test_a_further_effect_must_bring_its_share() -> None:
    """A second effect that gains less than the share of the first is left out, the same one without a share kept."""
    rng = np.random.default_rng(8)
    q = np.linalg.qr(rng.standard_normal((100, 10)))[0]
    x, y = 20.0 * q, 60.0 * q[:, 0] + 6.0 * q[:, 1]
    a, b, space = x.T @ x, x.T @ y, of(range(10))
    assert set(search(a, b, space, 0.0, Policy())[0].members) == {0, 1}
    assert search(a, b, space, 0.05, Policy())[0].members == (0,)


@pytest.mark.parametrize(("second", "left_over"), [("accelerometer.z", True), ("gyro.z", False), (NO_SENSOR, True)])
def test_only_what_the_first_effect_may_leave_over_must_bring_a_share(second: str, left_over: bool) -> None:
    """A law of one sensor that is not quite right looks like a further one of it, or like a clock; not like a gyro."""
    q = np.linalg.qr(np.random.default_rng(8).standard_normal((100, 10)))[0]
    x, y = 20.0 * q, 60.0 * q[:, 0] + 6.0 * q[:, 1]
    space = of(range(10), sensor=["accelerometer.z", second, *["gyro.x"] * 8])
    best = set(search(x.T @ x, x.T @ y, space, 0.05, Policy())[0].members)
    assert best == ({0} if left_over else {0, 1})


def test_it_does_not_count_in_which_order_a_set_was_found() -> None:
    """The same three effects, of which the surest and the least share a sensor, whichever the beam begins with."""
    rng, begun = np.random.default_rng(8), set()
    for _ in range(20):
        x = 20.0 * (np.linalg.qr(rng.standard_normal((100, 10)))[0] + 0.02 * rng.standard_normal((100, 10)))
        y = x @ (np.array([3.0, 2.0, 0.4] + [0.0] * 7)) + rng.standard_normal(100)
        space = of(range(10), sensor=["accelerometer.z", "accelerometer.x", "accelerometer.z", *["gyro.x"] * 7])
        ranked = search(x.T @ x, x.T @ y, space, 0.1, Policy())
        whole = next(one for one in ranked if set(one.members) == {0, 1, 2})
        begun.add(whole.members[0])
        assert whole.judged < whole.log_posterior - 0.05 * max(one.log_bayes_factor for one in ranked[:20])
        assert set(ranked[0].members) == {0, 1}
    assert begun != {0}


def test_false_alarms_come_at_the_rate_that_the_cost_says() -> None:
    """Orthogonal columns in pure noise: an alarm where one column exceeds the cost, chi2 with one degree of freedom."""
    columns, a = 40, 30.0
    variance = np.square(SCALES)

    def above(t: float) -> float:
        each = 0.5 * t * variance * a / (1.0 + variance * a) - 0.5 * np.log1p(variance * a)
        return logsumexp(each) - np.log(len(SCALES)) - np.log(columns / Policy.odds)

    expected = 1.0 - chi2.cdf(brentq(above, 0.0, 100.0), 1) ** columns
    rng = np.random.default_rng(21)
    space = of(range(columns))
    alarms = 0
    for _ in range(DRAWS):
        b = np.sqrt(a) * rng.standard_normal(columns)
        alarms += bool(search(a * np.eye(columns), b, space, Policy.share, Policy())[0].members)
    low, high = binom.ppf([UNLIKELY / 2, 1.0 - UNLIKELY / 2], DRAWS, expected)
    assert low <= alarms <= high
    assert high < 0.1 * DRAWS


def test_sure_false_alarms_are_as_rare_as_markov_says() -> None:
    """Families of correlated columns in pure noise: sum over sets of E[B] exp(-cost) <= exp(Policy.odds) - 1."""
    rng = np.random.default_rng(22)
    sure = 3.0  # nats
    space = of(np.repeat(np.arange(10), 3))
    alarms = 0
    for _ in range(DRAWS):
        x = rng.standard_normal((ROWS, 30)) @ (np.eye(30) + 0.3 * rng.standard_normal((30, 30)))
        y = rng.standard_normal(ROWS)
        alarms += search(x.T @ x, x.T @ y, space, Policy.share, Policy())[0].log_posterior > sure
    assert alarms <= binom.ppf(1.0 - UNLIKELY, DRAWS, np.expm1(Policy.odds) * np.exp(-sure))


def test_nothing_is_grown_from_nothing() -> None:
    space = of(range(30))
    ranked = search(50.0 * np.eye(30), np.zeros(30), space, Policy.share, Policy())
    assert ranked[0].members == ()
    assert max(len(one.members) for one in ranked) == 1


def test_a_size_that_no_sensor_has_is_no_explanation():
    """Two columns alike: the better one would need 20 times what is possible, so the other one stands in the answer."""
    a = 100.0 * np.array([[1.0, 0.99], [0.99, 1.0]])
    b = a @ np.array([20.0, 0.0])
    free = of([0, 1])
    assert search(a, b, free, 0.0, Policy())[0].members == (0,)
    bounded = replace(free, largest=np.array([1.0, np.inf]))
    sets = [one.members for one in search(a, b, bounded, 0.0, Policy())]
    assert (0,) not in sets and (1,) in sets


def test_what_can_be_is_looked_at_beyond_what_cannot() -> None:
    """More families than a beam holds need a size that no sensor has; the one that can be gains less than they."""
    count = int(Policy.beam) + 3
    b = np.append(np.full(count, 40.0), 30.0)
    a = np.eye(count + 1)
    bounded = replace(of(range(count + 1)), largest=np.append(np.full(count, 1.0), np.inf))
    assert search(a, b, bounded, 0.0, Policy())[0].members == (count,)
    none = replace(bounded, largest=np.full(count + 1, 1.0))
    assert [one.members for one in search(a, b, none, 0.0, Policy())] == [()]
