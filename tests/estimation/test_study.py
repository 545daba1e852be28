"""Recordings of one instrument together: their sums and their evidence against explicit densities and quadrature."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.special import logsumexp
from scipy.stats import multivariate_normal

from ins_eval.error_model.columns import Column, Drive, Measured
from ins_eval.error_model.library import Candidate
from ins_eval.estimation import study
from ins_eval.estimation.blocks import EACH, Blocks
from ins_eval.estimation.evidence import SCALES, log_evidence_with
from ins_eval.estimation.linearisation import Linearisation, log_evidence_of_best
from ins_eval.estimation.own_noise import _beside, with_own_noise
from ins_eval.estimation.search import search
from ins_eval.estimation.study import Hypothesis
from ins_eval.estimation.whitening import Whitened
from ins_eval.policy import Policy

ROUNDING = 1e-7
LAPLACE = 0.05  # nats: a parabola in place of a log posterior that is nearly one
OFF_THE_TOP = 0.2  # prior sigmas by which the noise may stand beside its best
LAPLACE_ASIDE = 0.25  # nats, from there
ONE_SCALE = 0.1  # nats: noise fitted with one prior scale of the effect, its most probable, in place of all
RANGE = (-3.0, 4.5, 46)  # prior sigmas of a level and points of the quadrature


@dataclass(frozen=True, eq=False)
class Noise:
    noise_point: np.ndarray


@dataclass(eq=False)
class Regression:
    """A recording as a plain regression: e = N u + X p + white noise, a level for each part of the rows.

    A column stands in `start`; noise of part l is exp(spread_l position_l).
    """

    name: str
    data: np.ndarray
    anyway: np.ndarray
    spreads: tuple[float, ...] = (0.0,)
    candidates: tuple[Candidate, ...] = ()
    blocks: Blocks = EACH
    asked: list[Blocks] = field(default_factory=list)
    fits: list[int] = field(default_factory=list)  # of the noise, with so many columns

    @property
    def nuisances(self) -> tuple[Column, ...]:
        return tuple(Column("", start=tuple(one)) for one in self.anyway.T)

    @property
    def noise(self) -> SimpleNamespace:
        return SimpleNamespace(free=[f"level {k}" for k, one in enumerate(self.spreads) if one > 0.0])

    def sigma(self, position: np.ndarray) -> np.ndarray:
        """(n,)"""
        part = np.arange(self.data.size) * len(self.spreads) // self.data.size
        moved = np.zeros(len(self.spreads))
        moved[np.array(self.spreads) > 0.0] = position
        return np.exp(np.array(self.spreads) * moved)[part]

    def whitened(self, columns, position, blocks=EACH, lasting=0) -> Whitened:
        self.asked.append(blocks)
        s = self.sigma(position)
        x = np.column_stack([self.anyway, *(np.array(one.start) for one in columns)]) / s[:, None]
        e = self.data / s
        return Whitened(x.T @ x, x.T @ e, float(e @ e), 2.0 * float(np.log(s).sum()), e.size, np.empty(0))

    def fitted(self, columns, start, gain) -> Noise:
        self.fits.append(len(columns))

        def height(position: np.ndarray) -> float:
            prior = prior_of_noise([position])
            return log_evidence_with(self.whitened(columns, position), self.anyway.shape[1], gain) + prior

        return Noise(minimize(lambda position: -height(position), start.noise_point, tol=1e-4).x)

    def ready(self, columns):
        return lambda position: self.whitened(columns, position, self.blocks)


def hypothesis(*columns: np.ndarray | None) -> Hypothesis:
    made = tuple(None if one is None else Column("", start=tuple(one)) for one in columns)
    return Hypothesis(Candidate("accelerometer.bias_drift", "x", "ug/h", 1.0, next(filter(None, made))), made)


def recordings(spreads=(0.0,), rows: int = 30) -> tuple[list[Regression], list[Hypothesis]]:
    """Two recordings; the first effect shows in both, the second and third in one of them each."""
    rng = np.random.default_rng(9)
    x = rng.standard_normal((2, rows, 3)) @ np.array([[1.0, 0.5, 0.2], [0.0, 1.0, 0.3], [0.0, 0.0, 1.0]])
    anyway = rng.standard_normal((2, rows, 2))
    p = np.array([1.5, -0.8, 0.0])
    shown = np.array([[1.0, 1.0, 0.0], [1.0, 0.0, 1.0]])
    cases = [
        Regression(f"r{r}", x[r] @ (p * shown[r]) + anyway[r] @ [0.3, -1.0] + rng.standard_normal(rows), anyway[r],
                   spreads)
        for r in range(2)
    ]  # fmt: skip
    ones = [hypothesis(*(x[r, :, k] if shown[r, k] else None for r in range(2))) for k in range(3)]
    return cases, ones


def stacked(cases, hypotheses, positions) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Data (n,), columns (n, k) and the covariance (n, n) under the belief, all recordings under one another."""
    n = [case.data.size for case in cases]
    x = np.concatenate([
        np.column_stack([np.zeros(n[r]) if one.columns[r] is None else one.columns[r].start for one in hypotheses])
        for r in range(len(cases))
    ])  # fmt: skip
    whole = np.zeros((sum(n), sum(n)))
    first = 0
    for case, position in zip(cases, positions, strict=True):
        part = slice(first, first + case.data.size)
        whole[part, part] = np.diag(case.sigma(position) ** 2) + case.anyway @ case.anyway.T
        first = part.stop
    return np.concatenate([case.data for case in cases]), x, whole


def prior_of_noise(positions) -> float:
    return -0.5 * float(sum(np.sum(np.square(one)) for one in positions))


def test_sums_of_recordings_add() -> None:
    cases, ones = recordings((0.4,))
    positions = [np.array([0.7]), np.array([-0.5])]
    found = study.sums(cases, positions, ones)
    y, x, whole = stacked(cases, ones, positions)
    inverse = np.linalg.inv(whole)
    np.testing.assert_allclose(found.normal, x.T @ inverse @ x, rtol=ROUNDING, atol=ROUNDING)
    np.testing.assert_allclose(found.projection, x.T @ inverse @ y, rtol=ROUNDING, atol=ROUNDING)
    expected = multivariate_normal.logpdf(y, cov=whole) + prior_of_noise(positions)
    assert found.log_null == pytest.approx(expected, abs=ROUNDING)
    assert found.normal[1, 2] == 0.0  # effects that no recording shows together


def test_what_was_taken_off_is_added_back() -> None:
    """Sums of recordings navigated with effects, against sums around the belief."""
    cases, ones = recordings()
    positions = [np.zeros(0)] * 2
    around = study.sums(cases, positions, ones)
    point = np.array([1.2, -0.4, 3.0])
    navigated = [replace(case, data=case.data - taken(ones, point, r)) for r, case in enumerate(cases)]
    found = study.sums(navigated, positions, ones, point)
    np.testing.assert_allclose(found.normal, around.normal)
    np.testing.assert_allclose(found.projection, around.projection, rtol=ROUNDING)
    assert found.log_null == pytest.approx(around.log_null, abs=ROUNDING)
    apart = study.sums(navigated, positions, ones)
    assert np.abs(apart.projection - around.projection).max() > 10.0


def test_the_coarse_pass_is_asked_for_in_blocks() -> None:
    cases, ones = recordings()
    cases[0].blocks = Blocks(7)
    study.sums(cases, [np.zeros(0)] * 2, ones, coarse=True)
    study.sums(cases, [np.zeros(0)] * 2, ones)
    assert cases[0].asked == [Blocks(7), EACH]


@pytest.mark.parametrize(("spreads", "count"), [((0.5,), 2), ((0.5, 0.4), 1)])
@pytest.mark.parametrize("model", [[], [0], [0, 1]])
def test_noise_is_integrated_out(spreads, count: int, model) -> None:
    """log Z around the noise that a model likes best, against a dense quadrature, at every scale of the effects."""
    cases, ones = recordings(spreads)
    cases, ones = cases[:count], [replace(one, columns=one.columns[:count]) for one in ones[:2]]
    expected = quadrature(cases, ones, model)
    top = most_probable(cases, ones, model)
    found = study.marginal(cases, top, ones, [model], np.zeros(2))[0]
    assert found == pytest.approx(expected, abs=LAPLACE)
    aside = [one + OFF_THE_TOP for one in top]
    assert study.marginal(cases, aside, ones, [model], np.zeros(2))[0] == pytest.approx(expected, abs=LAPLACE_ASIDE)


def test_a_model_that_likes_other_noise_is_never_overstated() -> None:
    """The null at the noise of the effects that are there: far from its own, and far too low, so it is taken there."""
    cases, ones = recordings((0.5,))
    at = most_probable(cases, ones, [0, 1])
    null, full = study.marginal(cases, at, ones, [[], [0, 1]], np.zeros(3))
    assert full == pytest.approx(quadrature(cases, ones, [0, 1]), abs=LAPLACE)
    assert null < quadrature(cases, ones, [])


def test_noise_is_integrated_out_around_recordings_navigated_with_effects() -> None:
    cases, ones = recordings((0.5,))
    ones, point = ones[:2], np.array([1.2, -0.4])
    navigated = [replace(case, data=case.data - taken(ones, point, r)) for r, case in enumerate(cases)]
    top = most_probable(cases, ones, [0, 1])
    found = study.marginal(navigated, top, ones, [[0, 1]], np.zeros(2), point)[0]
    assert found == pytest.approx(quadrature(cases, ones, [0, 1]), abs=LAPLACE)


def linearised(cases, at: list[np.ndarray], ones, coefficients: np.ndarray) -> Linearisation:
    families = study.space(ones, Policy())
    here = study.sums(cases, at, ones, coefficients)
    sets = tuple(search(here.normal, here.projection, families, 0.0, Policy()))
    return Linearisation(tuple(cases), tuple(ones), families, coefficients, tuple(map(Noise, at)), here, sets)


def test_what_an_effect_gains_beside_all_that_was_found_is_no_ground_against_one_of_them() -> None:
    """Two that have nothing in common, of which one was found."""
    rng = np.random.default_rng(5)
    x = np.column_stack([np.tile([1.0, 1.0], 20), np.tile([1.0, -1.0], 20)])
    case = Regression("r", x @ [2.0, 1.0] + 0.5 * rng.standard_normal(40), rng.standard_normal((40, 1)), (0.8,))
    ones = [replace(one, candidate=replace(one.candidate, axis=axis))
            for axis, one in zip("xy", map(hypothesis, x.T), strict=True)]  # fmt: skip
    (at,) = most_probable([case], ones, [0])
    found = linearised([case], [at], ones, np.zeros(2)).own_first(1)
    both = evidence([case], ones, [0, 1], at) - evidence([case], ones, [0], at)
    assert both > 5.0
    assert _beside(found, 1, (Noise(at),)) == pytest.approx(both, abs=ONE_SCALE)


def test_another_effect_is_weighed_at_a_noise_of_its_own() -> None:
    """Two that are much alike, navigated with the right one: at its noise the other seems farther off than it is.

    Beside a third, which explains nothing, the noise is not fitted.
    """
    rng = np.random.default_rng(4)
    x = np.column_stack([rng.standard_normal((40, 2)) @ np.array([[1.0, 1.0], [0.0, 0.06]]), np.tile([1.0, -1.0], 20)])
    case = Regression("r", 3.0 * x[:, 0] + 0.2 * rng.standard_normal(40), rng.standard_normal((40, 1)), (0.8,))
    ones = [replace(one, candidate=replace(one.candidate, axis=axis))
            for axis, one in zip("xyz", map(hypothesis, x.T), strict=True)]  # fmt: skip
    own, theirs = (most_probable([case], ones, [k]) for k in (0, 1))
    point = np.array([3.0, 0.0, 0.0])
    navigated = replace(case, data=case.data - taken(ones, point, 0))
    found = linearised([navigated], own, ones, point).own_first(1)
    of_family, _ = found.places(0)
    navigated.fits.clear()
    known = with_own_noise(found, Policy())
    weighed, _ = known.places(0)
    assert navigated.fits == [1, 2]  # without any, and with the other
    expected = evidence([case], ones, [0], own[0]) - evidence([case], ones, [1], theirs[0])
    assert of_family[0] - of_family[1] > expected + 3.0
    assert weighed[0] - weighed[1] == pytest.approx(expected, abs=ONE_SCALE)
    assert weighed[0] == of_family[0]
    assert weighed[2] == of_family[2]
    y, x, covariance = stacked([case], ones, theirs)  # at its noise it fits less badly, at any size, than at the other
    precision = np.linalg.inv(covariance)
    taken_off = (x.T @ precision @ y) ** 2 / np.diag(x.T @ precision @ x)
    behind = 0.5 * (taken_off[0] - taken_off[1])
    here, least = known.unlikelier(0)
    assert least[:2] == pytest.approx([0.0, behind], abs=ONE_SCALE)
    assert here[1] > behind + 1.0
    assert [list(one) for one in found.unlikelier(0)] == [list(here), list(here)]
    _, showing = known.unlikelier(
        0, 2.0 * taken_off[0]
    )  # at a noise where the first itself hardly counts all are alike
    assert list(showing) == list(here)
    in_its_place = known.exchanged(0, 1)  # at its own noise, and the first then at that
    assert in_its_place.best.members == (1,)
    assert log_evidence_of_best(found) - log_evidence_of_best(in_its_place) == pytest.approx(expected, abs=ONE_SCALE)
    assert in_its_place.gain([1]) - in_its_place.gain([0]) > found.gain([1]) - found.gain([0]) + 1.0


def test_hypotheses_of_all_recordings() -> None:
    """A shared effect is one; a step at the same time in each belongs to each; what one cannot show is None there."""
    column = Column("", start=(1.0,))
    shared = Candidate("accelerometer.bias_drift", "x", "ug/h", 1.0, column)
    memory = [
        Candidate("accelerometer.bias_creep", "x", "ug/degC", 1.0, column, {"time_constant_s": tau})
        for tau in (600.0, 2400.0)
    ]
    step = Candidate("accelerometer.bias_step", "x", "ug", 1.0, column, {"at_s": 900.0})
    of_earth = Candidate("earth.coriolis", None, "", 0.1, column, centre=10.0)
    composed = Candidate("composed", "z", "ug", 1.0, column, {"driver": "u", "form": "accelerometer bias = value * u"})
    cases = [SimpleNamespace(candidates=(shared, *memory, step, composed)),
             SimpleNamespace(candidates=(shared, *memory, step, of_earth))]  # fmt: skip
    found = study.union(cases)
    known = [tuple(one is not None for one in h.columns) for h in found]
    both, first, second = (True, True), (True, False), (False, True)
    assert known == [both, both, both, first, first, second, second]
    space = study.space(found, Policy(handicap=3.0))
    family = {h.candidate.name: space.families[k] for k, h in enumerate(found)}
    assert space.families[1] == space.families[2]
    assert len(set(family.values())) == 5
    assert [space.centre[k] for k, h in enumerate(found) if h.candidate is of_earth] == [10.0]
    assert {h.candidate.name: space.handicap[k] for k, h in enumerate(found) if space.handicap[k]} == {"composed": 3.0}


def test_a_wider_prior() -> None:
    column = Column("", (Drive("gyro", 0, "1", 2.0), Measured("delay", 0.5)), start=(1.0, -3.0))
    one = Hypothesis(Candidate("gyro.bias_drift", "x", "(deg/h)/h", 1.0, column), (column, None)).scaled(4.0)
    wide, none = one.columns
    assert none is None
    assert [term.weight for term in wide.terms] == [8.0, 2.0]
    assert wide.start == (4.0, -12.0)


def taken(ones, point: np.ndarray, r: int) -> np.ndarray:
    """What effects with these coefficients are in recording `r` (n,)."""
    shown = [(p, one.columns[r]) for p, one in zip(point, ones, strict=True) if one.columns[r] is not None]
    return sum(p * np.array(column.start) for p, column in shown)


def evidence(cases, ones, model, flat: Sequence[float]) -> float:
    """log of density times prior of the noise, the mean over scales, with all levels in `flat`."""
    levels = len(cases[0].noise.free)
    positions = [np.array(flat[r * levels : (r + 1) * levels]) for r in range(len(cases))]
    y, x, whole = stacked(cases, ones, positions)
    root = np.linalg.cholesky(whole)
    e, w = np.linalg.solve(root, y), np.linalg.solve(root, x[:, model])
    a, b = w.T @ w, w.T @ e
    each = [0.0]
    if model:
        scales = [np.array(s) for s in product(SCALES, repeat=len(model))]
        inner = [np.eye(s.size) + s[:, None] * a * s for s in scales]
        each = [
            0.5 * (s * b) @ np.linalg.solve(m, s * b) - 0.5 * np.linalg.slogdet(m)[1]
            for s, m in zip(scales, inner, strict=True)
        ]
    null = -0.5 * e @ e - np.log(np.diag(root)).sum() - 0.5 * y.size * np.log(2.0 * np.pi)
    return null + float(logsumexp(each)) - np.log(len(each)) + prior_of_noise(positions)


def most_probable(cases, ones, model) -> list[np.ndarray]:
    levels = len(cases[0].noise.free)
    found = minimize(lambda flat: -evidence(cases, ones, model, flat), np.zeros(levels * len(cases)), tol=1e-3)
    return list(found.x.reshape(len(cases), levels))


def quadrature(cases, ones, model) -> float:
    """Integral over a standard normal prior of each level: the trapezoid on a grid over all that is probable."""
    levels = len(cases[0].noise.free) * len(cases)
    grid = np.linspace(*RANGE)
    heights = [evidence(cases, ones, model, at) for at in product(grid, repeat=levels)]
    return float(logsumexp(heights)) + levels * (np.log(grid[1] - grid[0]) - 0.5 * np.log(2.0 * np.pi))
