"""The finalist once more: its times, widths and lags where the data put them, and the recordings navigated with it.

First-order responses hold while an effect is small. So what was found is taken off in the full mechanization, the
residual and all columns are made anew around it, and what was taken off is added back to the sums linearly, so that
every prior stays around the belief. Done until the coefficients stay; then they and their intervals are those of the
nonlinear problem (Gauss-Newton). A step after which the recordings are less probable than before it led past what is
linear: it is halved, or, where no part of it is better, left out.

Source: Nocedal and Wright 2006, Numerical Optimization, 3.1 and 10.3 (damped Gauss-Newton).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ins_eval.estimation.arcs import Diverged
from ins_eval.estimation.placing import Point, again, placed
from ins_eval.estimation.study import Hypothesis, fit_noise, sums

if TYPE_CHECKING:
    from ins_eval.estimation.case import Case
    from ins_eval.estimation.noise import NoiseModel
    from ins_eval.estimation.noise_fit import Fitted

TURNS = 3  # whole steps at most
NAVIGATED = 12  # times that the recordings are navigated at most
HALVINGS = 5  # of one step
LESS = 3.0  # nats by which recordings may become less probable: what rounding and a moved measurement do
SAME, SAME_S, SAME_SHARE = 0.02, 2.0, 0.05
MISREAD = 1.5  # times as much white noise as before, which no chance makes of thousands of rows; by reasoning
STEADY = 0.3  # sigmas that a coefficient may still move


class Impossible(Exception):
    """A set of effects with which recordings cannot be navigated, and the `key` of the one to leave out."""

    def __init__(self, key: tuple):
        super().__init__(key)
        self.key = key


def refine(
    cases: Sequence[Case],
    model: Sequence[Hypothesis],
    fitted: Sequence[Fitted],
    point: np.ndarray | None = None,
    near: Sequence[Case] | None = None,
) -> Point:
    """Gauss-Newton on the effects of `model`, from coefficients `point` (k,) or from the belief.

    Arcs begin at the states of the cases `near`, which are of the same recordings, or at those of `cases`.
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
        cases, model = _navigated(original, model, point, like, near)
    at, steps = Point(cases, model, point, fitted), _Steps(original, like)
    while steps.left:
        moved = list(at.taken)
        for k in range(len(model)):
            moved[k] = placed(at, moved, k).effect
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
    return Point(cases, model, point, tuple(fit_noise(cases, scaled, fitted, close=True)))  # at the noise of the answer


class _Steps:
    """Steps from point to point at one noise: each is halved until recordings and prior are more probable after it."""

    def __init__(self, original: tuple[Case, ...], like: tuple[Case, ...]):
        self.original, self.like = original, like
        self.whole = self.navigated = 0

    @property
    def left(self) -> bool:
        return self.whole < TURNS and self.navigated < NAVIGATED

    def take(self, at: Point, model: tuple[Hypothesis, ...], to: np.ndarray, scales: np.ndarray) -> Point | None:
        """The point `to` (k,) of `model`, or the first on the way back to `at` that is more probable than that.

        None where there is none: then `at` is the best. From the belief the least bad is taken. Raises Impossible
        where an effect outgrows what sensors have, or the recordings cannot be navigated with it.
        """
        highest, best = -np.inf, None
        failed: Impossible | None = None
        for halvings in range(HALVINGS):
            point = at.point + 0.5**halvings * (to - at.point)
            try:
                there = self._at(at, model, point)
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

    def _at(self, near: Point, model: tuple[Hypothesis, ...], point: np.ndarray) -> Point:
        for one, size in zip(model, point, strict=True):
            if abs(size) > one.candidate.largest:
                raise Impossible(one.key)
        self.navigated += 1
        return Point(*_navigated(self.original, model, point, self.like, near.cases), point, near.fitted)


def _more_probable(at: Point, there: Point, scales: np.ndarray) -> float:
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
    near: Sequence[Case] | None = None,
) -> tuple[tuple[Case, ...], tuple[Hypothesis, ...]]:
    """The recordings with the effects of `model` taken off, at the noise of `like` or their own, and the effects."""
    taken = [(one, float(p)) for one, p in zip(model, point, strict=True) if p != 0.0]
    try:
        cases = tuple(
            case.again([one.believed(p, original) for one, p in taken if one.acts_in(r)], begin)
            for r, (case, begin) in enumerate(zip(original, near or original, strict=True))
        )
    except Diverged as error:
        raise Impossible(model[int(np.argmax(np.abs(point)))].key) from error
    if like is not None:
        cases = tuple(replace(a, noise=_same_white(a, b)) for a, b in zip(cases, like, strict=True))
    return cases, tuple(again(one, cases) for one in model)


def _same_white(case: Case, before: Case) -> NoiseModel:
    """The noise of `case` with priors and white level of that of `before`.

    What motion adds to it is that of the nodes of `case`: a clock that is set right moves measurements along. A channel
    in which more than `MISREAD` times as much is white now was misread before: what was wrong looked like a walk.
    """
    typical = []
    for one in (before, case):
        known = np.where(np.isfinite(one.seen.residual), one.noise.white, np.nan)
        typical.append(np.array([np.nanmedian(column) if np.isfinite(column).any() else 1.0 for column in known.T]))
    misread = typical[1] > MISREAD * typical[0]
    if np.array_equal(case.model.nodes_s, before.model.nodes_s):
        return replace(before.noise, white=np.where(misread, case.noise.white, before.noise.white))
    white = np.where(misread, case.noise.white, case.noise.white * np.divide(*typical))
    return replace(case.noise, priors=before.noise.priors, down=before.noise.down, white=white)


def _alike(a: Hypothesis, b: Hypothesis) -> bool:
    """Whether times, widths and lags have stayed: an instant to `SAME_S`, a share to `SAME_SHARE`, others to `SAME`."""
    least = {"at_s": SAME_S, "branch_begin": SAME_SHARE}
    for name, x in a.candidate.parameters.items():
        if isinstance(x, float | int):
            y = float(b.candidate.parameters[name])
            if abs(x - y) > least.get(name, SAME * abs(x)):
                return False
    return True
