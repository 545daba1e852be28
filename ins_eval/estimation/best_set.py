"""The most probable set of effects: where its search begins, search and noise and navigation in turn, two searches put
together, and what is found beside the set at another noise.

A search looks at linear sums around recordings as they were navigated, at one noise. So it is repeated where the set
that was found is taken off and the noise is fitted beside it, until the set stays.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ins_eval.estimation.clock_starts import clock_starts
from ins_eval.estimation.linearisation import linearise, more_probable
from ins_eval.estimation.placing import Point
from ins_eval.estimation.refine import Impossible, refine
from ins_eval.estimation.search import one_more, possible
from ins_eval.estimation.study import Hypothesis, fit_noise, sums

if TYPE_CHECKING:
    from ins_eval.estimation.case import Case
    from ins_eval.estimation.linearisation import Linearisation
    from ins_eval.estimation.noise_fit import Fitted
    from ins_eval.policy import Policy

ROUNDS = 3  # of a search whose set goes on changing: by reasoning
SAME_NOISE = 1.0  # nats between two noises of which the evidence prefers neither: by reasoning


def begun(around_belief: Linearisation, null: Sequence[Fitted], policy: Policy) -> Linearisation:
    """The linearisation from which the search begins: around the belief, or around one effect alone.

    Clocks so far apart that no response to them is linear are brought together first, each way that the motion itself
    tells (`clock_starts`).

    An error that alone does most of what a whole set does may be so large that nothing linear around a solution with it
    can be trusted, and the others of the set mend what the first left. So does a term of the Earth that the belief
    leaves out. Each such effect is tried by navigating with it alone, and the most probable is where the search begins.
    """
    best, cases = around_belief, around_belief.cases
    for model, point in clock_starts(cases, around_belief.hypotheses):
        with suppress(Impossible):
            around = _around(cases, model, null, policy, point)
            best = around if more_probable(best, around) > 0.0 else best
    if best is not around_belief:
        return best  # what single effects gained, terms of the Earth among them, they gained at a wrong clock
    gain = around_belief.best.log_bayes_factor
    if gain < policy.earth:
        return around_belief
    of_family, members = one_more(around_belief.here.normal, around_belief.here.projection, (), around_belief.space)
    alone = [
        k
        for family, k in enumerate(members)
        if around_belief.hypotheses[k].candidate.name.startswith("earth.")
        or (len(around_belief.best.members) > 1 and of_family[family] > policy.most_of_set * gain)
    ]
    for k in alone:
        with suppress(Impossible):
            around = _around(cases, [around_belief.hypotheses[k]], null, policy)
            best = around if more_probable(best, around) > 0.0 else best
    return best


def _around(
    cases: tuple[Case, ...],
    model: Sequence[Hypothesis],
    null: Sequence[Fitted],
    policy: Policy,
    point: np.ndarray | None = None,
) -> Linearisation:
    """The linearisation around the recordings navigated with a few effects, from a `point` on; raises Impossible."""
    return linearise(refine(cases, model, null, point), policy)


def at_noise(linearisation: Linearisation, fitted: Sequence[Fitted], policy: Policy) -> Linearisation:
    """The linearisation around the same point, its sums and its search at another noise."""
    m = int(np.count_nonzero(linearisation.point))
    at = Point(linearisation.cases, linearisation.hypotheses[:m], linearisation.point[:m], tuple(fitted))
    return linearise(at, policy)


def at_own_noise(linearisation: Linearisation, policy: Policy) -> Linearisation:
    """The linearisation at the noise fitted under the set that was found; as it is where that gains next to nothing."""
    if linearisation.best.log_bayes_factor < policy.worth_refitting:
        return linearisation
    fitted = fit_noise(linearisation.cases, linearisation.chosen(), linearisation.fitted, hills=True)
    return at_noise(linearisation, fitted, policy)


def alike(a: Linearisation, b: Linearisation) -> bool:
    """Whether the best set is the same at two noises of which the evidence prefers neither: a search goes on alike."""
    of_a, of_b = ({one.hypotheses[k].identity for k in one.best.members} for one in (a, b))
    return of_a == of_b and sum(x.nats_to(y) for x, y in zip(a.fitted, b.fitted, strict=True)) < SAME_NOISE


def searched(cases: tuple[Case, ...], linearisation: Linearisation, policy: Policy) -> Linearisation:
    """Navigate with the set found, fit the noise under it, and search again until the set stays.

    It begins `at_own_noise`. Where the set does not stay, the most probable of those with which the recordings were
    navigated.
    """
    most: Linearisation | None = None
    for turn in range(ROUNDS):
        best = linearisation.best
        if best.log_bayes_factor < policy.worth_refitting or (turn == 0 and best.log_posterior < 0.0):
            return linearisation
        linearisation, refined = _refined(cases, linearisation)
        keys = linearisation.keys
        linearisation = linearise(refined, policy)
        own = linearisation.own_first(len(refined.taken))
        if most is None or not most.settled or (own.settled and more_probable(most, own) > 0.0):
            most = own
        placed = set(linearisation.best.members) == set(range(len(refined.taken)))
        last = turn == ROUNDS - 1
        if linearisation.keys == keys and not placed and not last:
            continue  # at the noise of the answer another time, width or lag is better
        if last or linearisation.best.judged <= own.best.judged + policy.stay:
            linearisation = own
        if linearisation.keys == keys and own.settled:
            break
    return linearisation if most is None else most


def navigated_with(
    cases: Sequence[Case],
    model: Sequence[Hypothesis],
    fitted: Sequence[Fitted],
    point: np.ndarray,
    policy: Policy,
    near: Sequence[Case] | None = None,
) -> Linearisation:
    """The linearisation around the recordings navigated with `model`, whose best set that is; raises Impossible."""
    refined = refine(cases, model, fitted, point, near)
    return linearise(refined, policy).own_first(len(refined.taken))


def joined(cases: tuple[Case, ...], better: Linearisation, worse: Linearisation, policy: Policy) -> Linearisation:
    """The better of two searches with what only the other found, if that is more probable.

    What could be left over of the first effect has to bring a share of that effect's nats. At a noise that makes the
    first gain more, a search may pass over what the other found with its share.
    """
    space, here = better.space, better.here
    family_of = {one.key: int(f) for one, f in zip(better.hypotheses, space.families, strict=True)}
    only_there = {family_of[key] for key in worse.keys - better.keys if key in family_of}
    members = list(better.best.members)
    while only_there:
        gains, best = one_more(here.normal, here.projection, members, space)
        family = max(only_there, key=lambda f: gains[f])
        only_there.remove(family)
        if gains[family] > space.cost and possible(here.normal, here.projection, [*members, best[family]], space).all():
            members.append(int(best[family]))
    if len(members) == len(better.best.members):
        return better
    both = _grown(cases, better, members, better.fitted, policy)
    return better if both is None or more_probable(better, both) <= 0.0 else both


def with_further(
    cases: tuple[Case, ...],
    linearisation: Linearisation,
    noises: Callable[[Linearisation], Iterable[Sequence[Fitted]]],
    policy: Policy,
) -> Linearisation:
    """The same with further effects, each found at one of the `noises` beside the set, where that is more probable.

    The noise that is fitted beside a set takes up an effect that is missing in it, and there it gains little. So it is
    sought where sensors are quieter, and each set is compared at the noise that is fitted beside it.
    """
    for _ in range(ROUNDS):
        found = (
            _grown(cases, linearisation, [*linearisation.best.members, k], fitted, policy)
            for k, fitted in _missing(linearisation, noises, policy).items()
        )
        sure = (one.sure(policy) for one in found if one is not None and one.settled)
        further = [one for one in sure if one.keys - linearisation.keys and more_probable(linearisation, one) > 0.0]
        if not further:
            break
        linearisation = max(further, key=partial(more_probable, linearisation))
    return linearisation


def _missing(
    one: Linearisation, noises: Callable[[Linearisation], Iterable[Sequence[Fitted]]], policy: Policy
) -> dict[int, Sequence[Fitted]]:
    """What gains most beside the set at each of the `noises`, of what can be and is sure there, and the noise."""
    found: dict[int, Sequence[Fitted]] = {}
    members = one.best.members
    for fitted in noises(one):
        here = sums(one.cases, [noise.noise_point for noise in fitted], one.hypotheses, one.point)
        gains, best = one_more(here.normal, here.projection, members, one.space)
        sure = (int(best[f]) for f in np.argsort(gains)[::-1] if gains[f] > one.space.cost + policy.sure)
        can_be = (k for k in sure if possible(here.normal, here.projection, [*members, k], one.space).all())
        if (k := next(can_be, None)) is not None:
            found.setdefault(k, fitted)
    return found


def _grown(
    cases: Sequence[Case], one: Linearisation, members: Sequence[int], fitted: Sequence[Fitted], policy: Policy
) -> Linearisation | None:
    """Around the recordings navigated with `members`, of which the first are the best set; None where that fails."""
    model = [one.hypotheses[k] for k in members]
    point = np.append(one.where_it_was, np.zeros(len(members) - len(one.best.members)))
    with suppress(Impossible):
        return navigated_with(cases, model, fitted, point, policy, one.cases)
    return None


def _refined(cases: tuple[Case, ...], linearisation: Linearisation) -> tuple[Linearisation, Point]:
    """The best set with which the recordings can be navigated, and the fit there."""
    while True:
        try:
            model, point = linearisation.chosen(scaled=False), linearisation.where_it_was
            return linearisation, refine(cases, model, linearisation.fitted, point, linearisation.cases)
        except Impossible as error:
            linearisation = linearisation.excluding(error.key)
