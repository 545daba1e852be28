"""The maximum of the evidence over the free levels of the noise (`noise`), prior included.

By quasi-Newton steps with the filter's own slopes; near a top that was climbed before they begin with its curvature.
Where attitude is measured, or where gyros flicker, the evidence has several hills, and the top of more than one is
sought.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.optimize import minimize

from ins_eval.estimation.evidence import log_evidence, log_evidence_with, sensitivity
from ins_eval.estimation.slope import slopes
from ins_eval.estimation.whitening import Whitened, whiten

if TYPE_CHECKING:
    from ins_eval.error_model.columns import Assembled
    from ins_eval.estimation.evidence import Gain
    from ins_eval.estimation.noise import NoiseModel

_Slope = Callable[[np.ndarray], tuple[float, np.ndarray]]

WIDEST = 3.0  # prior sigmas that a level may move
# prior sigmas of the first step in each level, before anything is known of the curvature, and the least and most after;
# by reasoning
_FIRST, _SPREADS = 0.2, (1e-3, 1.0)
_LEVEL = 0.02  # nats for a step of the size of a spread: the slope of a top
# nats that two further steps must gain, and twice those that a curvature that is known may still promise; the same
# where tops are compared: along a wander that hardly matters the evidence rises by a hundredth of a nat a step, for two
# nats in all
_ENOUGH, _CLOSE = 0.05, 0.005
_NEAR = 3.0  # nats that the curvature promises at most near its top: 2 and less there in real flights, or thousands
_STEPS, _EVALUATIONS, _MEMORY = 60, 80, 20  # of the slope; differences of it that are kept
_RUNS, _FAR = 4, 0.5  # prior sigmas from the begin of a climb, beyond which it begins anew
# what measures attitude and what gyros do are told apart by their times alone, and so is a wander from an effect: an
# error that forgets at once and one that lasts are hills of their own
LASTING = (
    (("slow_attitude", "slow_heading"), "slow_attitude_time"),
    (("gyro_wander",), "gyro_wander_time"),
)  # levels and the time for which they last
# prior sigmas; half a sigma apart, since minutes of samples tell a level to a tenth and a coarser net misses its hill
_OTHER_TIMES, _OTHER_LEVELS = (-2.0, 2.0), np.linspace(-2.0, 2.0, 9)
_ANOTHER_TIME = 1.0  # prior sigmas from a time that is another
_HOPELESS = 30.0  # nats below the top that is known, from which no other hill is climbed


@dataclass(frozen=True, eq=False)
class Ready:
    """Columns and noise of one recording on means over the same blocks."""

    columns: Assembled
    noise: NoiseModel

    def __call__(self, noise_point: np.ndarray) -> Whitened:
        """The pass with noise at `noise_point`."""
        return whiten(self.columns, self.noise.levels(noise_point))

    def slope(
        self, noise_point: np.ndarray, sensitivity: Callable[[Whitened], tuple[float, np.ndarray]]
    ) -> tuple[float, np.ndarray]:
        """The log evidence that `sensitivity` tells of a pass, and how it changes with the noise point."""
        height, by = slopes(self.columns, self.noise.levels(noise_point), sensitivity)
        return height, self.noise.slope(noise_point, by)


@dataclass(frozen=True, eq=False)
class Fitted:
    """Noise at the maximum of the evidence: where, how high (prior included), and the sums of that pass.

    `spread` (levels, levels) are steps of half a nat, about, as the climbs so far tell: one in each column, whose
    products are the inverse of the curvature; None before any.
    """

    noise_point: np.ndarray
    log_evidence: float
    whitened: Whitened
    spread: np.ndarray | None = None

    def nats_to(self, other: Fitted) -> float:
        """By how many nats the noise of `other` is less probable than this, the evidence taken for a parabola."""
        moved = other.noise_point - self.noise_point
        if self.spread is None:
            return np.inf if moved.any() else 0.0
        return 0.5 * float(np.square(np.linalg.solve(self.spread, moved)).sum())


def fit(
    ready: Ready,
    known: int,
    gain: Gain | None = None,
    start: Fitted | None = None,
    hills: bool = False,
    close: bool = False,
) -> Fitted:
    """Maximise log evidence + log prior over the free levels, in prior sigmas from the centre.

    Of the columns beyond those `known`, `gain` tells what they gain; without it all are known. With `hills` the top is
    sought on more than the hill where the start lies. Where tops are compared it is sought `close`. Steps are those
    that the spread of the `start` tells: samples by the thousand tell some levels a hundred times closer than others.
    """

    def height(noise_point: np.ndarray) -> float:
        whitened = ready(noise_point)
        found = log_evidence(whitened) if gain is None else log_evidence_with(whitened, known, gain)
        return found - 0.5 * float(noise_point @ noise_point)

    def slope(noise_point: np.ndarray) -> tuple[float, np.ndarray]:
        found, by = ready.slope(noise_point, lambda w: sensitivity(w) if gain is None else sensitivity(w, known, gain))
        return found - 0.5 * float(noise_point @ noise_point), by - noise_point

    free, enough = ready.noise.free, _CLOSE if close else _ENOUGH
    begin, spread = (np.zeros(len(free)), None) if start is None else (start.noise_point, start.spread)
    top = _top(slope, begin, spread, enough)
    for names, lasting in LASTING if hills else ():
        if lasting not in free:
            continue
        others = _other_hills(height, top, [free.index(one) for one in names if one in free], free.index(lasting))
        top = max((top, *(_top(slope, other, top.spread, enough) for other in others)), key=lambda one: one.height)
    return Fitted(top.noise_point, top.height, ready(top.noise_point), top.spread)


class _Top(NamedTuple):
    noise_point: np.ndarray
    height: float
    spread: np.ndarray | None


def _top(slope: _Slope, noise_point: np.ndarray, spread: np.ndarray | None, enough: float) -> _Top:
    """The top of the hill on which `noise_point` lies, by steps of the size of `spread`, where that is known."""
    for _ in range(_RUNS):
        begin = noise_point
        top = _climbed(slope, begin, spread, enough)
        noise_point, spread = top.noise_point, top.spread
        if np.abs(noise_point - begin).max() < _FAR:
            break
    return top


def _other_hills(
    height: Callable[[np.ndarray], float], top: _Top, levels: Sequence[int], time: int
) -> list[np.ndarray]:
    """Points on other hills: the error of these `levels` lasts for another `time` than at the `top`."""
    found = []
    for other in _OTHER_TIMES:
        if abs(other - top.noise_point[time]) < _ANOTHER_TIME:
            continue
        points = np.repeat(top.noise_point[None], len(_OTHER_LEVELS), axis=0)
        points[:, time] = other
        points[:, levels] = _OTHER_LEVELS[:, None]
        heights = [height(point) for point in points]
        if max(heights) > top.height - _HOPELESS:
            found.append(points[int(np.argmax(heights))])
    return found


def _climbed(slope: _Slope, begin: np.ndarray, spread: np.ndarray | None, enough: float) -> _Top:
    """The highest position found from `begin`, and the spread by the curvature that the steps told."""
    first = slope(begin)
    if spread is not None:
        if 0.5 * float(np.sum((spread.T @ first[1]) ** 2)) < _NEAR:
            return _settled(slope, begin, first, spread, enough)
        steps = np.linalg.norm(spread, axis=1)
    else:
        steps = np.full(begin.size, _FIRST)

    def down(moved: np.ndarray) -> tuple[float, np.ndarray]:
        height, by = slope(begin + steps * moved) if moved.any() else first
        return -height, -steps * by

    found = minimize(
        down,
        np.zeros(begin.size),
        jac=True,
        method="L-BFGS-B",
        bounds=list(zip((-WIDEST - begin) / steps, (WIDEST - begin) / steps, strict=True)),
        options={"maxiter": _STEPS, "maxfun": _EVALUATIONS, "ftol": 0.0, "gtol": _LEVEL, "maxcor": _MEMORY},
        callback=_Patience(enough),
    )
    end = np.clip(begin + steps * found.x, -WIDEST, WIDEST)
    if 2 * found.nit >= begin.size:
        spread = _root(np.outer(steps, steps) * found.hess_inv.todense())
    return _Top(end, -float(found.fun), spread)


def _settled(
    slope: _Slope, begin: np.ndarray, first: tuple[float, np.ndarray], spread: np.ndarray, enough: float
) -> _Top:
    """The top near `begin`, where the slope is `first`, of which the spread is known."""

    def within(moved: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        there = begin + spread @ moved
        return np.clip(there, -WIDEST, WIDEST), np.abs(there) <= WIDEST

    def down(moved: np.ndarray) -> tuple[float, np.ndarray]:
        noise_point, free = within(moved)
        height, by = slope(noise_point) if moved.any() else first
        return -height, -spread.T @ (by * free)

    options = {"maxiter": _STEPS, "gtol": np.sqrt(enough), "norm": 2.0}
    found = minimize(down, np.zeros(begin.size), jac=True, method="BFGS", options=options)
    return _Top(within(found.x)[0], -float(found.fun), _root(spread @ found.hess_inv @ spread.T))


def _root(covariance: np.ndarray) -> np.ndarray:
    """A square root of the inverse of a curvature, whose steps are neither too long nor too short."""
    values, axes = np.linalg.eigh(covariance)
    return axes * np.clip(np.sqrt(np.maximum(values, 0.0)), *_SPREADS)


class _Patience:
    """Stops where two steps together gained less than is `enough`."""

    def __init__(self, enough: float):
        self.enough = enough
        self.seen: list[float] = []

    def __call__(self, intermediate_result) -> None:
        self.seen.append(float(intermediate_result.fun))
        if len(self.seen) > 2 and self.seen[-3] - self.seen[-1] < self.enough:
            raise StopIteration
