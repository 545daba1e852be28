"""Is an explanation enough? What a disturbance without a name gains instead of the effects, and what beside them.

Instead, the whole error is left to one channel of one recording, which changes slowly with time or along a curve of its
temperature (`open_form`): where that gains more than laws do, they only describe something else. Beside, the effects
are taken off at their best, and any interval of any channel is looked at for what they leave.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ins_eval.diagnosis.unnamed import locate
from ins_eval.diagnosis.unnamed.disturbance import of_windows, restless, within_statement
from ins_eval.diagnosis.unnamed.mismatch import UnnamedDisturbance, deviate, located
from ins_eval.diagnosis.unnamed.open_form import open_forms, over_temperature
from ins_eval.effects.parts import SENSORS
from ins_eval.estimation.blocks import EACH
from ins_eval.estimation.evidence import Reduced, reduce
from ins_eval.estimation.search import NO_SENSOR

if TYPE_CHECKING:
    from ins_eval.error_model.columns import Column
    from ins_eval.estimation.case import Case
    from ins_eval.estimation.linearisation import Linearisation
    from ins_eval.estimation.whitening import Whitened
    from ins_eval.policy import Policy

CURVE = "a curve of its temperature"


def left_unexplained(
    linearisation: Linearisation, rng: np.random.Generator, policy: Policy
) -> tuple[UnnamedDisturbance, UnnamedDisturbance]:
    """Instead of the effects that are taken off, and beside them: what gains most in any recording.

    A mismatch that could be what effects whose form is a law leave over must bring at least `Policy.least_share` of
    what they do.
    """
    instead, beside = [], []
    m = list(linearisation.best.members)
    chosen, mean = linearisation.chosen(), linearisation.coefficients[0]
    rough = not linearisation.space.exact[m].any()
    share = policy.least_share(case.kind for case in linearisation.cases)
    least = share * max(linearisation.best.log_bayes_factor, 0.0) if rough else 0.0
    theirs = set(linearisation.space.sensor[m])

    def leftover(channel: str) -> float:
        others = channel.startswith(SENSORS) and channel not in theirs and NO_SENSOR not in theirs
        return 0.0 if others else least

    for r, case in enumerate(linearisation.cases):
        own = [i for i, one in enumerate(chosen) if one.columns[r] is not None]
        scale = np.array([max(1.0, abs(float(mean[i]))) for i in own])
        point = linearisation.point[[m[i] for i in own]] / scale
        columns = [chosen[i].columns[r] for i in own]
        point_of_noise = linearisation.fitted[r].noise_point
        over, edges_s, whitened = of_windows(case, point_of_noise, columns, blocks=EACH)  # as effects
        nuisances = len(case.nuisances)
        put_back = _put_back(whitened, nuisances, point)
        at_windows = _Windows(r, linearisation, over, edges_s, put_back)
        in_time = _unnamed(at_windows, None, rng, policy)
        instead += [
            in_time,
            *_curved(at_windows, columns, point, policy.near + max(in_time.gain, 0.0)),
        ]
        left = reduce(whitened, nuisances + len(columns))
        beside.append(_unnamed(_Windows(r, linearisation, over, edges_s, left), leftover, rng, policy))
        one = restless(case, r, linearisation.fitted[r], policy, columns) if beside[-1].mismatch is None else None
        if one is not None:
            place = located(case, r, one.interval, one.sigma)
            beside.append(UnnamedDisturbance(place, one.gain, one.sigma, one.interval, one.wander))
    return tuple(max(ones, key=lambda one: one.gain) for ones in (instead, beside))


def _put_back(whitened: Whitened, nuisances: int, point: np.ndarray) -> Reduced:
    """What is left of the columns behind those of the effects, with what these took off, at `point`, added again."""
    left, n = reduce(whitened, nuisances), point.size
    return Reduced(left.normal[n:, n:], left.projection[n:] + left.normal[n:, :n] @ point)


@dataclass(frozen=True, eq=False)
class _Windows:
    """The windows of the channels `over` in recording `r`, with their reduced sums."""

    r: int
    linearisation: Linearisation
    over: list[locate.Channel]
    edges_s: np.ndarray
    reduced: Reduced

    @property
    def case(self) -> Case:
        return self.linearisation.cases[self.r]

    @cached_property
    def found(self) -> list[locate.Interval]:
        """The best interval of each channel, best first."""
        return locate.scan(self.reduced, self.over, self.edges_s)


def _unnamed(
    windows: _Windows, least: Callable[[str], float] | None, rng: np.random.Generator, policy: Policy
) -> UnnamedDisturbance:
    """What changes slowly with time; a mismatch of a channel must bring `least` nats, None: any is shown.

    It is as significant as its most remarkable interval, or as its form, whichever is more so.
    """
    case, r = windows.case, windows.r
    trials = locate.significance(windows.reduced, windows.edges_s.size - 1, rng)
    # a channel is one more family, and costs what an effect costs
    forms = open_forms(windows.reduced, len(windows.over))
    best = max(forms, key=lambda one: one.log_bayes_factor)
    gain = best.log_bayes_factor - windows.linearisation.space.cost
    found = [one for one in windows.found if not within_statement(case, one, policy)]
    if not found:
        return UnnamedDisturbance(None, gain, 0.0)
    enough = [one for one in found if least is not None and 0.5 * one.t2 > least(one.channel.name)]
    interval = (enough or found)[0]
    sigma = trials.sigma(interval.t2)
    sure = trials.probability(interval.t2) <= policy.largest_probability(interval.channel.name)
    if least is None or (sure and enough) or gain > least(windows.over[best.channel].name):
        sigma = max(sigma, deviate(gain))
        return UnnamedDisturbance(located(case, r, interval, sigma), gain, sigma, interval)
    return UnnamedDisturbance(None, gain, sigma)


def _curved(windows: _Windows, columns: Sequence[Column], point: np.ndarray, enough: float) -> list[UnnamedDisturbance]:
    """The sensor whose error is best a curve of its temperature, where there is a temperature that moves.

    `columns` of the effects took off their part at `point`. A temperature that only rises or falls is another clock, so
    it is said to follow it only where that gains `enough`: `Policy.near` more than the form in time.
    """
    case, r, linearisation = windows.case, windows.r, windows.linearisation
    curves = over_temperature(case)
    if not curves:
        return []
    knots = [column for one in curves.values() for column in one]
    whitened = case.whitened([*columns, *knots], linearisation.fitted[r].noise_point)
    forms = open_forms(_put_back(whitened, len(case.nuisances), point), len(curves))
    best = max(forms, key=lambda one: one.log_bayes_factor)
    gain = best.log_bayes_factor - linearisation.space.cost
    sigma = deviate(gain)
    channel = list(curves)[best.channel]
    follows = CURVE if gain > enough else ""
    return [
        UnnamedDisturbance(located(case, r, one, sigma, follows), gain, sigma)
        for one in windows.found
        if one.channel == channel
    ]
