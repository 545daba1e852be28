"""Effects with their times, widths and lags where the data put them.

Along each of them the evidence is profiled: values are tried, more of them where it is highest, until an interval of
95 % is spanned; what not knowing the value adds to each coefficient is summed with it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ins_eval.effects.lag import NAME as LAG
from ins_eval.effects.vocabulary import VOCABULARY
from ins_eval.estimation.search import log_bayes_factor, posterior
from ins_eval.estimation.study import Hypothesis, sums

if TYPE_CHECKING:
    from ins_eval.effects.effect import Parameter
    from ins_eval.error_model.library import Candidate
    from ins_eval.estimation.case import Case
    from ins_eval.estimation.noise_fit import Fitted

ZOOMS = (1.0, 0.3, 0.1)  # half width of the values tried, in steps of the first grid
VALUES = 9  # tried in each
FINE = 100  # points of an integral from one value tried to the next
FAR = 4.5  # nats below the best at which the interval of a time or width is looked for no further
WIDER = 1.6
FURTHER, STEEP = 4, 1.0  # more zooms where the best stands more than so many nats above its neighbours
Q95 = 1.96
PLACED = 0.03  # of the prior with which a lag is searched for: a placed one has the size for which its column is made


@dataclass(frozen=True, eq=False)
class Point:
    """Recordings navigated with the effects `taken` off, at their coefficients `point` (k,), each at a fitted noise."""

    cases: tuple[Case, ...]
    taken: tuple[Hypothesis, ...]
    point: np.ndarray
    fitted: tuple[Fitted, ...]

    def sums(self, asked: Sequence[Hypothesis], once: Sequence[Hypothesis] = ()) -> tuple[np.ndarray, np.ndarray]:
        """A (n, n) and b (n,) of the hypotheses `asked` and, behind them, of those that are asked for only `once`.

        What was taken off is added back with what it was taken with.
        """
        lasting = dict.fromkeys([*self.taken, *asked])
        columns = list(lasting | dict.fromkeys(once))
        taken = np.append(self.point, np.zeros(len(columns) - self.point.size))
        noise_points = [one.noise_point for one in self.fitted]
        here = sums(self.cases, noise_points, columns, taken, lasting=len(lasting))
        place = {one: k for k, one in enumerate(columns)}
        n = [place[one] for one in (*asked, *once)]
        return here.normal[np.ix_(n, n)], here.projection[n]

    def estimate(self, model: Sequence[Hypothesis]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Coefficients (n,) of `model`, their sigma and the scales of their prior."""
        a, b = self.sums(model)
        centre = np.array([one.candidate.centre for one in model])
        _, scales = log_bayes_factor(a, b, centre)
        mean, covariance = posterior(a, b, centre, scales)
        return mean, np.sqrt(np.diag(covariance)), scales

    @cached_property
    def intervals(self) -> tuple[Placed, ...]:
        """Each effect that was taken off, with the intervals of its times, widths and lags."""
        return tuple(placed(self, self.taken, k) for k in range(len(self.taken)))


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
    sharp = replace(candidate, nominal=PLACED * candidate.nominal, centre=candidate.centre / PLACED)
    return replace(found.scaled(PLACED), candidate=sharp)


@dataclass(frozen=True)
class Placed:
    """An effect with its times, widths and lags where the sums like them best.

    `spread` their 95 % intervals, `bent` (k,) the variance that not knowing them adds to each coefficient.
    """

    effect: Hypothesis
    spread: dict[str, tuple[float, float]]
    bent: np.ndarray


def placed(at: Point, model: Sequence[Hypothesis], k: int) -> Placed:
    """Effect `k` of `model`, each of its further parameters placed in turn."""
    one = model[k]
    parameters = [p for p in VOCABULARY[one.candidate.name].parameters if p.name in one.candidate.parameters]
    spread: dict[str, tuple[float, float]] = {}
    bent = np.zeros(len(model))
    for parameter in parameters:
        profile = Profile(at, (*model[:k], one, *model[k + 1 :]), k, parameter)
        one, spread[parameter.name], added = profile.best()
        bent += added
    return Placed(one, spread, bent)


class Profile:
    """The evidence of a model along one parameter of effect `k`: values tried, more of them where it is highest."""

    def __init__(self, at: Point, model: tuple[Hypothesis, ...], k: int, parameter: Parameter):
        self.at, self.model, self.k, self.parameter = at, model, k, parameter
        r = next(i for i, column in enumerate(model[k].columns) if column is not None)
        start_s, end_s = (float(at.cases[r].model.nodes_s[i]) for i in (0, -1))
        to, self.back = _evenly(parameter)
        self.step = float(np.diff(to(parameter.grid(start_s, end_s)))[0])
        bounds = (start_s + 1.0, end_s - 1.0) if parameter.low is None else (parameter.low, parameter.high)
        self.low, self.high = (float(to(x)) for x in bounds)
        self.centre = float(to(model[k].candidate.parameters[parameter.name]))
        self.heights: dict[float, float] = {}
        self.means: dict[float, np.ndarray] = {}
        self.made: dict[float, Hypothesis] = {self.centre: model[k]}

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
        fine, masses, higher, ends = _density(places, np.array([self.heights[x] for x in places]))
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
        new = [x for x in fresh if x not in self.made]
        self.made |= {x: again(one, self.at.cases, {**old, name: float(self.back(x))}) for x in new}
        others, variants = [*self.model[:k], *self.model[k + 1 :]], [self.made[x] for x in fresh]
        own = len(others)
        normal, projection = self.at.sums(others, variants)
        centre = np.array([other.candidate.centre for other in (*others, *variants)])
        for j, x in enumerate(fresh):
            m = [*range(own), own + j]
            a, b = normal[np.ix_(m, m)], projection[m]
            self.heights[x], scales = log_bayes_factor(a, b, centre[m])
            mean, _ = posterior(a, b, centre[m], scales)
            self.means[x] = np.insert(mean[:-1], k, mean[-1] * variants[j].candidate.nominal / one.candidate.nominal)


def of_tried(heights: Mapping[float, float], parameter: Parameter) -> tuple[float, float]:
    """The 95 % interval of a `parameter` of which some values were tried, by their log evidences `heights`.

    At least half way to the values beside the best one: between them nothing was tried.
    """
    to, back = _evenly(parameter)
    tried = sorted(heights)
    values, k = to(tried), tried.index(max(heights, key=heights.__getitem__))
    *_, (low, high) = _density(values, np.array([heights[x] for x in tried]))
    below, above = values[max(k - 1, 0)], values[min(k + 1, len(tried) - 1)]
    reach = [max(values[k] - low, 0.5 * (values[k] - below)), max(high - values[k], 0.5 * (above - values[k]))]
    ends = values[k] + np.array([-1.0, 1.0]) * np.hypot(reach, Q95 * parameter.form)
    return float(back(ends[0])), float(back(ends[1]))


def _evenly(parameter: Parameter) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """To what the prior of a parameter is uniform in, and back."""
    return (np.log, np.exp) if parameter.log_uniform else (np.asarray, np.asarray)


def _density(places: np.ndarray, heights: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Fine places (n,), `_masses` between them, and the ends of 95 %, of a log density that is straight between all."""
    between = np.linspace(0.0, places.size - 1.0, (places.size - 1) * FINE + 1)  # the best place is one of them
    fine = np.interp(between, np.arange(places.size), places)
    masses, higher = _masses(fine, np.interp(fine, places, heights))
    return fine, masses, higher, np.interp([0.025, 0.975], np.append(0.0, np.cumsum(masses)), fine)


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
