"""What else it could be: every family in the place of each effect of an answer, and what would separate them.

A rival is what lies within `Policy.near` nats of the effect in whose place it stands, at the sizes that are expected;
sums count as far as its scatter is noise (`Linearisation.trusted`). What then gains less than its choice costs has
none. Where there is one, all that is within `Policy.listed` is listed too. A twin, what at any size leaves at most
`Policy.twin` more of chi-square than the effect, at its noise or, if nothing would leave as much more, at that of
another in its place, and beyond what linear sums leave open, is always listed; one that would have to be larger than
any sensor's has the nats of sizes up to that, and is no rival. So is a set of effects at another noise that is nearly
as probable as the best one: what is an effect there is noise here.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import logsumexp

from ins_eval.diagnosis.answer.verdict import Rival
from ins_eval.effects.vocabulary import VOCABULARY
from ins_eval.estimation.linearisation import more_probable
from ins_eval.estimation.placing import of_tried
from ins_eval.estimation.search import log_bayes_factor, posterior
from ins_eval.recording import PARKED

if TYPE_CHECKING:
    from ins_eval.diagnosis.answer.experiments import Catalogue
    from ins_eval.estimation.linearisation import Linearisation
    from ins_eval.policy import Policy


def rivals(
    linearisation: Linearisation,
    policy: Policy,
    around_belief: Linearisation | None = None,
    others: Sequence[Linearisation] = (),
) -> tuple[Rival, ...]:
    """Every family that could stand in the place of an effect of the best set, best first, then those of `others`."""
    ranked = sorted(
        (one for k in linearisation.best.members for one in _in_the_place(linearisation, k, policy)),
        key=lambda one: one.below_best,
    )
    believed = around_belief or linearisation
    ranked += [one for k in linearisation.best.members for one in _three_biases(linearisation, k, believed)]
    reach = policy.listed if any(one.below_best < policy.near for one in ranked) else policy.near
    named = linearisation.keys
    for other in others:
        below = more_probable(other, linearisation)
        if 0.0 <= below < reach:
            ranked += _at_other_noise(other, named, below)
            named = named | other.keys
    return tuple(ranked)


def _at_other_noise(other: Linearisation, named: Collection[tuple], below: float) -> list[Rival]:
    """The effects of another set that are not `named`, each beside the others of them."""
    mean, covariance = other.coefficients
    here = [(i, other.hypotheses[k]) for i, k in enumerate(other.best.members) if other.hypotheses[k].key not in named]
    return [
        Rival(
            of=None,
            hypothesis=one,
            probability=float(1.0 / (1.0 + np.exp(below))),
            below_best=below,
            by_prior_only=False,
            beside=tuple(beside for _, beside in here if beside is not one),
            value=float(mean[i] * one.candidate.nominal),
            sigma=float(np.sqrt(covariance[i, i]) * one.candidate.nominal),
        )
        for i, one in here
    ]


def _in_the_place(linearisation: Linearisation, k: int, policy: Policy) -> list[Rival]:
    """The rivals and twins of member `k`."""
    trusted = linearisation.trusted(k)
    of_family, members = trusted.places(k)
    space, (unlikelier, least_unlikely) = linearisation.space, linearisation.unlikelier(k, policy.twin)
    own = int(space.families[k])
    twin = least_unlikely <= 0.5 * policy.twin + policy.nats_left_open(float(of_family[own]))
    too_large = twin & np.isneginf(of_family) & (space.centre[members] == 0.0)
    too_large[space.families[list(linearisation.best.members)]] = False
    of_family[too_large] = trusted.within_largest(k, members[too_large])
    below = of_family[own] - of_family
    below[too_large] = np.maximum(below[too_large], policy.near)  # no sensor is: no rival
    of_family[too_large] = of_family[own] - below[too_large]
    log_sum = logsumexp(np.append(of_family, space.cost))
    reach = policy.listed if np.delete(below, own).min(initial=np.inf) < policy.near else policy.near
    near = (below < reach) & (of_family[own] > space.cost)
    listed = np.isfinite(below) & (near | twin)
    listed[own] = False
    return [
        Rival(
            of=linearisation.hypotheses[k],
            hypothesis=linearisation.hypotheses[members[family]],
            **_size(trusted, k, int(members[family])),
            spread=_spread(trusted, k, int(members[family])),
            probability=float(np.exp(of_family[family] - log_sum)),
            below_best=float(below[family]),
            by_prior_only=bool(
                unlikelier[family] < policy.alike or (below[family] >= policy.near and unlikelier[family] < policy.near)
            ),
        )
        for family in np.flatnonzero(listed)
    ]


def _size(linearisation: Linearisation, k: int, rival: int) -> dict[str, float]:
    """Value and sigma of hypothesis `rival` in the place of member `k`, the others of the best set free beside it."""
    m = [rival, *(j for j in linearisation.best.members if j != k)]
    a, b, centre = (
        linearisation.here.normal[np.ix_(m, m)],
        linearisation.here.projection[m],
        linearisation.space.centre[m],
    )
    mean, covariance = posterior(a, b, centre, log_bayes_factor(a, b, centre)[1])
    nominal = linearisation.hypotheses[rival].candidate.nominal
    return {"value": float(mean[0] * nominal), "sigma": float(np.sqrt(covariance[0, 0]) * nominal)}


def _spread(linearisation: Linearisation, k: int, rival: int) -> dict[str, tuple[float, float]]:
    """The 95 % interval of each time, width and lag of hypothesis `rival` in the place of member `k`.

    By the values that were tried in its recordings, the other parameters at their best for each.
    """
    one, families = linearisation.hypotheses[rival], linearisation.space.families
    others = [j for j in linearisation.best.members if j != k]
    acts = [column is not None for column in one.columns]
    alike = [
        int(j)
        for j in np.flatnonzero(families == families[rival])
        if j not in others and [column is not None for column in linearisation.hypotheses[j].columns] == acts
    ]
    if len(alike) == 1:
        return {}
    heights = {j: linearisation.gain([*others, j]) for j in alike}
    spread = {}
    for parameter in VOCABULARY[one.candidate.name].parameters:
        if parameter.name not in one.candidate.parameters:
            continue
        highest: dict[float, float] = {}
        for j, height in heights.items():
            x = linearisation.hypotheses[j].candidate.parameters[parameter.name]
            highest[x] = max(height, highest.get(x, -np.inf))
        if len(highest) > 1:
            spread[parameter.name] = of_tried(highest, parameter)
    return spread


def with_experiments(linearisation: Linearisation, found: Sequence[Rival], catalogue: Catalogue) -> tuple[Rival, ...]:
    """The same with the cheapest experiment of the catalogue that would separate each from the answer.

    What is noise here and an effect at another noise any further recording tells: it comes back, or does not.
    """
    of_noise = [one for one in found if one.of is None]
    found = [one for one in found if one.of is not None]
    m = list(linearisation.best.members)
    place = {linearisation.hypotheses[k]: i for i, k in enumerate(m)}
    index = {one: k for k, one in enumerate(linearisation.hypotheses)}
    chosen = [*m, *(index[one.hypothesis] for one in found)]
    chosen += [index[one] for rival in found for one in rival.beside if index[one] not in chosen]
    spot = {k: i for i, k in enumerate(chosen)}
    given = catalogue.recommend(
        [linearisation.hypotheses[k].candidate for k in chosen],
        linearisation.here.normal[np.ix_(chosen, chosen)],
        {
            i: linearisation.space.centre[k] or p
            for i, (k, p) in enumerate(zip(m, linearisation.coefficients[0], strict=True))
        },
        [
            [
                *(i for i in range(len(m)) if i != place[one.of]),
                *(spot[index[other]] for other in (one.hypothesis, *one.beside)),
            ]
            for one in found
        ],
        [one.by_prior_only for one in found],
    )
    told = (
        one
        if best is None
        else replace(one, experiment=best.experiment, expected_log_bayes_factor=best.expected_log_bayes_factor)
        for one, best in zip(found, given, strict=True)
    )
    return (*told, *of_noise)


def _three_biases(linearisation: Linearisation, k: int, around_belief: Linearisation) -> list[Rival]:
    """Three constant gyro biases as the rival of Earth rotation, where only parked recordings show it.

    Their sizes are those around the belief, in which the Earth does not turn: where it does, biases and heading trade.
    """
    one = linearisation.hypotheses[k]
    parked = all(case.kind in PARKED for case in linearisation.cases)
    if one.candidate.name != "earth.rotation" or not parked:
        return []
    biases = [j for j, other in enumerate(linearisation.hypotheses) if other.candidate.name == "gyro.bias"]
    others = [j for j in linearisation.best.members if j != k]
    m = [*others, *biases]
    sums = linearisation.here.normal[np.ix_(m, m)], linearisation.here.projection[m], linearisation.space.centre[m]
    below = linearisation.gain([*others, k]) - log_bayes_factor(*sums)[0]
    beside = {linearisation.hypotheses[j].key for j in others}
    number = {other.key: j for j, other in enumerate(around_belief.hypotheses)}
    there = [number[linearisation.hypotheses[j].key] for j in biases]
    kept = [j for j in around_belief.best.members if around_belief.hypotheses[j].key in beside]
    m = [*kept, *there]
    sums = around_belief.here.normal[np.ix_(m, m)], around_belief.here.projection[m], around_belief.space.centre[m]
    mean = posterior(*sums, log_bayes_factor(*sums)[1])[0][len(kept) :]
    return [
        Rival(
            of=one,
            hypothesis=linearisation.hypotheses[j],
            probability=float(np.exp(min(0.0, -below))),
            below_best=float(below),
            by_prior_only=True,
            beside=tuple(linearisation.hypotheses[i] for i in biases if i != j),
            value=float(p * linearisation.hypotheses[j].candidate.nominal),
        )
        for j, p in zip(biases, mean, strict=True)
    ]
