"""The finalist once more: its times, widths and lags where the data put them, and the recordings navigated with it.

First-order responses hold while an effect is small. So what was found is taken off in the full mechanization, the
residual and all columns are made anew around it, and what was taken off is added back to the sums linearly, so that
every prior stays around the belief. Done until the coefficients stay; then they and their intervals are those of the
nonlinear problem (Gauss-Newton). A step after which the recordings are less probable than before it led past what is
linear: it is halved, or, where no part of it is better, left out.

Source: Nocedal and Wright 2006, Numerical Optimization, 3.1 and 10.3 (damped Gauss-Newton).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ins_eval.diagnosis.estimate.arcs import Diverged
from ins_eval.diagnosis.estimate.search import log_bayes_factor, posterior
from ins_eval.diagnosis.estimate.study import Hypothesis, fit_noise, sums
from ins_eval.effects.lag import NAME as LAG
from ins_eval.effects.vocabulary import VOCABULARY
from ins_eval.recording.belief import EffectBelief

if TYPE_CHECKING:
    from ins_eval.diagnosis.estimate.case import Case
    from ins_eval.diagnosis.estimate.noise import NoiseModel
    from ins_eval.diagnosis.estimate.noise_fit import Fitted
    from ins_eval.diagnosis.model.library import Candidate
    from ins_eval.effects.effect import Parameter

TURNS = 3  # whole steps at most
NAVIGATED = 12  # times that the recordings are navigated at most
HALVINGS = 5  # of one step
LESS = 3.0  # nats by which recordings may become less probable: what rounding and a moved measurement do
SAME, SAME_S, SAME_SHARE = 0.02, 2.0, 0.05
STEADY = 0.3  # sigmas that a coefficient may still move
ZOOMS = (1.0, 0.3, 0.1)  # half width of the values tried, in steps of the first grid
VALUES = 9  # tried in each
FINE = 100  # points of an integral from one value tried to the next
FAR = 4.5  # nats below the best at which the interval of a time or width is looked for no further
WIDER = 1.6
FURTHER, STEEP = 4, 1.0  # more zooms where the best stands more than so many nats above its neighbours
Q95 = 1.96
PLACED = 0.03  # of the prior with which a lag is searched for: a placed one has the size for which its column is made


class Impossible(Exception):
    """A set of effects with which recordings cannot be navigated, and the `key` of the one to leave out."""

    def __init__(self, key: tuple):
        super().__init__(key)
        self.key = key


@dataclass(frozen=True, eq=False)
class RefinedFit:
    """Recordings navigated with the finalist, and where.

    `model` its effects with columns around that point, `point` (k,) their coefficients there, `spread` the 95 %
    interval of each time, width and lag of each effect, `bent` (k,) the variance that all of these add to each
    coefficient.
    """

    cases: tuple[Case, ...]
    model: tuple[Hypothesis, ...]
    point: np.ndarray
    fitted: tuple[Fitted, ...]
    spread: tuple[dict[str, tuple[float, float]], ...]
    bent: np.ndarray


def refine(
    cases: Sequence[Case], model: Sequence[Hypothesis], fitted: Sequence[Fitted], point: np.ndarray | None = None
) -> RefinedFit:
    """Gauss-Newton on the effects of `model`, from coefficients `point` (k,) or from the belief.

    Raises Impossible where an effect outgrows what sensors have, or the recordings cannot be navigated with it.
    """
    original = tuple(cases)
    model = tuple(again(one, original) for one in model)  # they may come from other navigated recordings
    point, fitted = np.zeros(len(model)) if point is None else point, tuple(fitted)
    cases, fixed = original, np.array([one.candidate.name.startswith("earth.") for one in model])
    like = original  # whose noise is kept: what is white is read off once, else no two fits could be compared
    if fixed.any():  # there is nothing between a term that is there and one that is not
        point = np.where(fixed, [one.candidate.centre for one in model], point)
        cases, model = _navigated(original, model, point)
        like = cases
        fitted = tuple(fit_noise(cases, model, fitted))
    elif point.any():
        cases, model = _navigated(original, model, point, like)
    at, steps = _Point(cases, model, point, fitted), _Steps(original, like)
    while steps.left:
        moved = list(at.taken)
        for k in range(len(model)):
            moved[k] = _placed(at, moved, k).effect
        mean, sigma, scales = at.estimate(moved)
        same = all(_alike(a, b) for a, b in zip(at.taken, moved, strict=True))
        if same and bool((np.abs(mean - at.point) < STEADY * sigma)[~fixed].all()):
            break
        there = steps.take(at, tuple(moved), np.where(fixed, at.point, mean), scales)
        if there is None:
            break
        at = there
    cases, model, point = at.cases, at.taken, at.point
    scaled = [one.scaled(max(1.0, abs(float(p)))) for one, p in zip(model, point, strict=True)]
    fitted = tuple(fit_noise(cases, scaled, fitted))
    at = _Point(cases, model, point, fitted)  # at the noise of the answer
    placed = [_placed(at, model, k) for k in range(len(model))]
    bent = sum((one.bent for one in placed), np.zeros(len(model)))
    return RefinedFit(cases, model, point, fitted, tuple(one.spread for one in placed), bent)


class _Steps:
    """Steps from point to point at one noise: each is halved until recordings and prior are more probable after it."""

    def __init__(self, original: tuple[Case, ...], like: tuple[Case, ...]):
        self.original, self.like = original, like
        self.whole = self.navigated = 0

    @property
    def left(self) -> bool:
        return self.whole < TURNS and self.navigated < NAVIGATED

    def take(self, at: _Point, model: tuple[Hypothesis, ...], to: np.ndarray, scales: np.ndarray) -> _Point | None:
        """The point `to` (k,) of `model`, or the first on the way back to `at` that is more probable than that.

        None where there is none: then `at` is the best. From the belief the least bad is taken. Raises Impossible
        where an effect outgrows what sensors have, or the recordings cannot be navigated with it.
        """
        highest, best = -np.inf, None
        failed: Impossible | None = None
        for halvings in range(HALVINGS):
            point = at.point + 0.5**halvings * (to - at.point)
            try:
                there = self._at(model, point, at.fitted)
            except Impossible as error:
                failed = failed or error
                continue
            gain = _more_probable(at, there, scales)
            if gain > -LESS:
                self.whole += halvings == 0
                return there
            if best is None or gain > highest:
                highest, best = gain, there
        if best is None:
            raise failed or Impossible(model[0].key)
        if at.point.any():
            return None
        self.whole = TURNS
        return best

    def _at(self, model: tuple[Hypothesis, ...], point: np.ndarray, fitted: tuple[Fitted, ...]) -> _Point:
        for one, size in zip(model, point, strict=True):
            if abs(size) > one.candidate.largest:
                raise Impossible(one.key)
        self.navigated += 1
        return _Point(*_navigated(self.original, model, point, self.like), point, fitted)


def _more_probable(at: _Point, there: _Point, scales: np.ndarray) -> float:
    """By how many nats recordings and coefficients are more probable `there` than `at`, with `scales` (k,) of a prior.

    On the measurements that both have; where the nodes differ, as if there were as many of them there.
    """
    centre = np.array([one.candidate.centre for one in there.taken])
    less = np.where(centre == 0.0, at.point**2 - there.point**2, 0.0) / (2.0 * scales**2)
    gain = float(less.sum())
    for before, after, one in zip(at.cases, there.cases, at.fitted, strict=True):
        known = [np.isfinite(case.seen.residual) for case in (before, after)]
        if known[0].shape == known[1].shape:
            known = [known[0] & known[1]] * 2
        heights = []
        for case, here in zip((before, after), known, strict=True):
            seen = replace(case.seen, residual=np.where(here, case.seen.residual, np.nan))
            heights.append(sums([replace(case, seen=seen)], [one.noise_point], []).log_null)
        gain += heights[1] * np.count_nonzero(known[0]) / max(np.count_nonzero(known[1]), 1) - heights[0]
    return gain if np.isfinite(gain) else -np.inf


def _navigated(
    original: Sequence[Case],
    model: Sequence[Hypothesis],
    point: np.ndarray,
    like: Sequence[Case] | None = None,
) -> tuple[tuple[Case, ...], tuple[Hypothesis, ...]]:
    """The recordings with the effects of `model` taken off, at the noise of `like` or their own, and the effects."""
    effects = [believed_effect(one, float(p), original) for one, p in zip(model, point, strict=True) if p != 0.0]
    try:
        cases = tuple(case.again(effects) for case in original)
    except Diverged as error:
        raise Impossible(model[int(np.argmax(np.abs(point)))].key) from error
    if like is not None:
        cases = tuple(replace(a, noise=_same_white(a, b)) for a, b in zip(cases, like, strict=True))
    return cases, tuple(again(one, cases) for one in model)


def _same_white(case: Case, before: Case) -> NoiseModel:
    """The noise of `case` with priors and white level of that of `before`.

    What motion adds to it is that of the nodes of `case`: a clock that is set right moves measurements along.
    """
    if np.array_equal(case.model.nodes_s, before.model.nodes_s):
        return before.noise
    typical = []
    for one in (before, case):
        known = np.where(np.isfinite(one.seen.residual), one.noise.white, np.nan)
        typical.append([np.nanmedian(column) if np.isfinite(column).any() else 1.0 for column in known.T])
    white = case.noise.white * np.divide(*typical)
    return replace(case.noise, priors=before.noise.priors, down=before.noise.down, white=white)


def again(one: Hypothesis, cases: Sequence[Case], parameters: dict | None = None) -> Hypothesis:
    """The same effect, perhaps with other `parameters`, around the point at which `cases` were navigated.

    A lag has the sharp prior of one that is placed.
    """
    old = one.candidate
    chosen = old.parameters if parameters is None else parameters
    made: list[Candidate | None] = [
        None if had is None else case.member(old.name, old.axis, chosen)
        for had, case in zip(one.columns, cases, strict=True)
    ]
    found = Hypothesis(next(c for c in made if c is not None), tuple(None if c is None else c.column for c in made))
    if old.name != LAG:
        return found
    candidate = found.candidate
    placed = replace(candidate, nominal=PLACED * candidate.nominal, centre=candidate.centre / PLACED)
    return replace(found.scaled(PLACED), candidate=placed)


def believed_effect(one: Hypothesis, coefficient: float, cases: Sequence[Case]) -> EffectBelief:
    """An effect as a belief states it, of a hypothesis with its coefficient."""
    candidate = one.candidate
    value = coefficient * candidate.nominal
    known = {name: p for name, p in candidate.parameters.items() if name in EffectBelief.model_fields}
    local = None
    if candidate.local:
        local = next(case.name for case, column in zip(cases, one.columns, strict=True) if column is not None)
    if candidate.name.startswith("earth."):
        value = 1.0
    if candidate.name == LAG:
        value = max(value, 0.0)
    return EffectBelief(name=candidate.name, axis=candidate.axis, value=value, recording=local, **known)


@dataclass(frozen=True, eq=False)
class _Point:
    """Recordings navigated with the effects `taken` off, at their coefficients `point` (k,), each at a fitted noise."""

    cases: tuple[Case, ...]
    taken: tuple[Hypothesis, ...]
    point: np.ndarray
    fitted: tuple[Fitted, ...]

    def sums(self, asked: Sequence[Hypothesis]) -> tuple[np.ndarray, np.ndarray]:
        """A (n, n) and b (n,) of the hypotheses `asked`, what was taken off added back with what it was taken with."""
        n = len(asked)
        taken = np.append(np.zeros(n), self.point)
        here = sums(self.cases, [one.noise_point for one in self.fitted], [*asked, *self.taken], taken)
        return here.normal[:n, :n], here.projection[:n]

    def estimate(self, model: Sequence[Hypothesis]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Coefficients (n,) of `model`, their sigma and the scales of their prior."""
        a, b = self.sums(model)
        centre = np.array([one.candidate.centre for one in model])
        _, scales = log_bayes_factor(a, b, centre)
        mean, covariance = posterior(a, b, centre, scales)
        return mean, np.sqrt(np.diag(covariance)), scales


def _alike(a: Hypothesis, b: Hypothesis) -> bool:
    """Whether times, widths and lags have stayed: an instant to `SAME_S`, a share to `SAME_SHARE`, others to `SAME`."""
    least = {"at_s": SAME_S, "branch_begin": SAME_SHARE}
    for name, x in a.candidate.parameters.items():
        if isinstance(x, float | int):
            y = float(b.candidate.parameters[name])
            if abs(x - y) > least.get(name, SAME * abs(x)):
                return False
    return True


@dataclass(frozen=True)
class _Placed:
    """An effect with its times, widths and lags where the sums like them best.

    `spread` their 95 % intervals, `bent` (k,) the variance that not knowing them adds to each coefficient.
    """

    effect: Hypothesis
    spread: dict[str, tuple[float, float]]
    bent: np.ndarray


def _placed(at: _Point, model: Sequence[Hypothesis], k: int) -> _Placed:
    """Effect `k` of `model`, each of its further parameters placed in turn."""
    one = model[k]
    parameters = [p for p in VOCABULARY[one.candidate.name].parameters if p.name in one.candidate.parameters]
    spread: dict[str, tuple[float, float]] = {}
    bent = np.zeros(len(model))
    for parameter in parameters:
        profile = _Profile(at, (*model[:k], one, *model[k + 1 :]), k, parameter)
        one, spread[parameter.name], added = profile.best()
        bent += added
    return _Placed(one, spread, bent)


class _Profile:
    """The evidence of a model along one parameter of effect `k`: values tried, more of them where it is highest."""

    def __init__(self, at: _Point, model: tuple[Hypothesis, ...], k: int, parameter: Parameter):
        self.at, self.model, self.k, self.parameter = at, model, k, parameter
        r = next(i for i, column in enumerate(model[k].columns) if column is not None)
        start_s, end_s = (float(at.cases[r].model.nodes_s[i]) for i in (0, -1))
        logs = parameter.low is not None and not parameter.even
        to: Callable[..., Any] = np.log if logs else np.asarray
        self.back: Callable[..., Any] = np.exp if logs else np.asarray
        self.step = float(np.diff(to(parameter.grid(start_s, end_s)))[0])
        bounds = (start_s + 1.0, end_s - 1.0) if parameter.low is None else (parameter.low, parameter.high)
        self.low, self.high = (float(to(x)) for x in bounds)
        self.centre = float(to(model[k].candidate.parameters[parameter.name]))
        self.heights: dict[float, float] = {}
        self.means: dict[float, np.ndarray] = {}
        self.made: dict[float, Hypothesis] = {}

    def best(self) -> tuple[Hypothesis, tuple[float, float], np.ndarray]:
        """The effect at the best value, the 95 % interval of the value, the variance it adds to each coefficient."""
        across = np.linspace(-1.0, 1.0, VALUES)
        half = self.step
        for zoom in ZOOMS:
            half = self.step * zoom
            self._try(half * across)
        for _ in range(FURTHER):
            if not self._steep():
                break
            half *= ZOOMS[1]
            self._try(half * across)
        half = self.step * ZOOMS[-1]
        while half < 30.0 * self.step and self._open():
            half *= WIDER
            self._try(half * np.array([-1.0, 1.0]))
        return self.made[self.centre], *self._spread()

    def _spread(self) -> tuple[tuple[float, float], np.ndarray]:
        form = self.parameter.form
        places = np.array(sorted(self.heights))
        heights = np.array([self.heights[x] for x in places])
        between = np.linspace(0.0, places.size - 1.0, (places.size - 1) * FINE + 1)  # the best place is one of them
        fine = np.interp(between, np.arange(places.size), places)
        masses, higher = _masses(fine, np.interp(fine, places, heights))
        ends = np.interp([0.025, 0.975], np.append(0.0, np.cumsum(masses)), fine)
        reach = np.hypot(np.maximum((ends - self.centre) * [-1.0, 1.0], 0.0), Q95 * form)
        ends = np.clip(self.centre + reach * [-1.0, 1.0], self.low, self.high)
        bent = np.empty(len(self.model))
        for j, coefficients in enumerate(np.transpose([self.means[x] for x in places])):
            mean = np.interp(fine, places, coefficients)
            below, at, above = np.interp(self.centre + form * np.array([-1.0, 0.0, 1.0]), places, coefficients)
            bent[j] = masses @ (mean[higher] - masses @ mean[higher]) ** 2
            bent[j] += max(abs(above - at), abs(at - below)) ** 2
        low, high = (float(x) for x in self.back(ends))
        return (low, high), bent

    def _steep(self) -> bool:
        """Whether both values beside the best one are so much worse that its 95 % interval lies between them."""
        places = sorted(self.heights)
        i = places.index(self.centre)
        best = self.heights[self.centre]
        return all(self.heights[x] < best - STEEP for x in places[max(i - 1, 0) : i + 2] if x != self.centre)

    def _open(self) -> bool:
        """Whether an end of the tried range is still probable without being an end of the possible range."""
        best, first, last = max(self.heights.values()), min(self.heights), max(self.heights)
        return (self.heights[first] > best - FAR and first > self.low) or (
            self.heights[last] > best - FAR and last < self.high
        )

    def _try(self, offsets: np.ndarray) -> None:
        """Evidence of the model, and its coefficients, with each value at `offsets` from the best one so far."""
        values = np.unique(np.clip(self.centre + offsets, self.low, self.high))
        fresh = [float(x) for x in values if float(x) not in self.heights]
        if fresh:
            self._evaluate(fresh)
        self.centre = max(self.heights, key=self.heights.__getitem__)

    def _evaluate(self, fresh: Sequence[float]) -> None:
        one, k = self.model[self.k], self.k
        old, name = one.candidate.parameters, self.parameter.name
        variants = [again(one, self.at.cases, {**old, name: float(self.back(x))}) for x in fresh]
        asked = [*(other for j, other in enumerate(self.model) if j != k), *variants]
        own = len(asked) - len(fresh)
        normal, projection = self.at.sums(asked)
        centre = np.array([other.candidate.centre for other in asked])
        for j, x in enumerate(fresh):
            m = [*range(own), own + j]
            a, b = normal[np.ix_(m, m)], projection[m]
            self.heights[x], scales = log_bayes_factor(a, b, centre[m])
            mean, _ = posterior(a, b, centre[m], scales)
            self.means[x] = np.insert(mean[:-1], k, mean[-1] * variants[j].candidate.nominal / one.candidate.nominal)
            self.made[x] = variants[j]


def _masses(x: np.ndarray, heights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Probability (n - 1,) between neighbouring `x` (n,), and the number of the more probable end of each.

    Of a log density `heights` that is straight between them, w exp(h) (1 - exp(-d)) / d with w the width, h the higher
    end and d by how much the other is lower: a density far narrower than the step of `x` beside its peak has a mass.
    """
    drop = np.abs(np.diff(heights))
    share = np.where(drop > 1e-9, -np.expm1(-drop) / np.maximum(drop, 1e-9), 1.0)
    mass = np.diff(x) * share * np.exp(np.maximum(heights[1:], heights[:-1]) - heights.max())
    higher = np.arange(x.size - 1) + (heights[1:] > heights[:-1])
    return mass / mass.sum(), higher
