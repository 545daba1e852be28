"""From findings to a verdict: pure functions of what was found and of the policy.

no mismatch       nothing gains what an effect costs, or the effects found do harm on data that were not used
explained         effects leave nothing, no form without a name does better, and they do no harm on unused data
not identifiable  the same, but another effect is within `Policy.near` of one of them; `judge.exchanged` makes it of
                  `explained` where a more probable one takes the place of an effect
partly explained  effects explain much, something stays unexplained
unexplained       something is there, and what has a name only describes it
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from ins_eval.diagnosis.answer.verdict import (
    EXPLAINED,
    NO_MISMATCH,
    PARTLY,
    UNEXPLAINED,
)
from ins_eval.diagnosis.unnamed.disturbance import surest_of
from ins_eval.diagnosis.unnamed.mismatch import Mismatch, UnnamedDisturbance
from ins_eval.effects.accelerometer import AT
from ins_eval.effects.composed import NAME as COMPOSED
from ins_eval.effects.parts import SENSORS
from ins_eval.error_model.drives import source, strength
from ins_eval.estimation.linearisation import CONSTANTS

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from ins_eval.diagnosis.answer.findings import Findings
    from ins_eval.diagnosis.unnamed.disturbance import Suspect
    from ins_eval.estimation.linearisation import Linearisation
    from ins_eval.policy import Policy


@dataclass(frozen=True, eq=False)
class Decision:
    """A verdict; `named` where the effects found are part of the answer."""

    verdict: str
    unnamed: UnnamedDisturbance
    mismatches: tuple[Mismatch, ...] = ()
    named: bool = False


def decide(findings: Findings, policy: Policy) -> Decision:
    """The verdict over what was found."""
    heard = is_heard(findings, policy) and findings.beside is not None
    if heard and explains(findings, policy):
        return Decision(EXPLAINED, findings.beside, findings.shown, named=True)
    suspects = findings.suspects or ()
    surest = surest_of(suspects, policy)
    place = () if surest is None else (findings.places[suspects.index(surest)],)
    if heard:
        return _insufficient(findings, surest, place, policy)
    if surest is None:
        sigma = max((one.sigma for one in suspects), default=0.0)
        return Decision(NO_MISMATCH, UnnamedDisturbance(None, 0.0, sigma))
    unnamed = UnnamedDisturbance(place[0], surest.gain, surest.sigma, wander=surest.wander)
    return Decision(UNEXPLAINED, unnamed, place)


def is_heard(findings: Findings, policy: Policy) -> bool:
    """Whether what the best set gains on the null suffices to report a mismatch.

    Readings of hours in a chamber share slow errors that no model of noise holds.
    """
    in_chamber = any(case.kind == "chamber" for case in findings.cases)
    cost = findings.linearisation.space.cost * len(findings.linearisation.best.members)
    return findings.gain > max(policy.least_gain_chamber if in_chamber else 0.0, cost)


def explains(findings: Findings, policy: Policy) -> bool:
    """Whether the effects found explain the mismatch, with nothing beside them and nothing better instead of them.

    Where disturbances without a name were weighed at a noise of their own, none of them does better either.
    """
    if findings.beside.mismatch is not None or outgained(findings, open_margin(findings, policy)):
        return False
    surest = surest_of(findings.suspects or (), policy)
    described = outdone(findings, policy) or only_described(findings, surest, policy)
    return not described and holds(findings.linearisation, policy)


def outgained(findings: Findings, lead: float) -> bool:
    """Whether a form without a name is more probable, by the nats `lead`, than all that have one in its place.

    Where several effects are alike none of them is likely, and yet one of them may be right.
    """
    return findings.instead.gain > findings.linearisation.log_posterior_of_names + lead


def open_margin(findings: Findings, policy: Policy) -> float:
    """Nats by which a form without a name may at most lead the effects; below 0, by which it must stay behind them.

    0 for effects of different sensors, and `Policy.left_open` of what they gain. `Policy.open_margin` less for each
    that shares its sensor with another, since one sensor has one fault more often than two; more than
    `Policy.most_of_one`, or two that are unusually large, describe it and explain nothing (`describing`). Constants do
    not count: what has no name has them.
    `Policy.near` less where one is composed of a column, which is a description as well. In a chamber, where the laws
    of one sensor are sought, `Policy.open_margin`.
    """
    if any(case.believed is None for case in findings.cases):
        return policy.open_margin
    linearisation = findings.linearisation
    if describing(linearisation, policy):
        return -np.inf
    most = max((len(own) for own in _moving(linearisation).values()), default=1)
    composed = any(linearisation.hypotheses[k].candidate.name == COMPOSED for k in linearisation.best.members)
    left_open = policy.nats_left_open(linearisation.best.log_posterior)
    return left_open - policy.open_margin * (most - 1) - policy.near * composed


def describing(linearisation: Linearisation, policy: Policy) -> tuple[int, ...]:
    """The members of the best set that describe a sensor: more than `Policy.most_of_one` of one explain nothing.

    Nor do several of which two have more than `Policy.unusual` of the sizes that are usual in this grade: one such
    error happens, or its belief is wrong; two that cancel draw a law that has no name. Nor does a jump with its return:
    what comes and goes has no name, and two jumps draw it.
    """
    members, sizes = linearisation.best.members, np.abs(linearisation.coefficients[0])
    unusual = {k for k, size in zip(members, sizes, strict=True) if size > policy.unusual}
    moving = _moving(linearisation).values()
    crowds = (own for own in moving if len(own) > policy.most_of_one or len(unusual.intersection(own)) > 1)
    return tuple(dict.fromkeys(k for own in (*crowds, *_returning(linearisation, policy)) for k in own))


def _returning(linearisation: Linearisation, policy: Policy) -> Iterator[tuple[int, int]]:
    """Pairs of jumps of one sensor whose sizes cancel to `Policy.returned` sigmas; the other's name may be another."""
    members, (mean, covariance) = linearisation.best.members, linearisation.coefficients
    ones = [linearisation.hypotheses[k].candidate for k in members]
    for i, j in combinations(range(len(members)), 2):
        if ones[i].channel != ones[j].channel or not all(AT.name in one.parameters for one in (ones[i], ones[j])):
            continue
        size = np.array([_added(linearisation, members[i]), _added(linearisation, members[j])])
        if (size @ mean[[i, j]]) ** 2 < policy.returned**2 * (size @ covariance[np.ix_([i, j], [i, j])] @ size):
            yield members[i], members[j]


def _added(linearisation: Linearisation, k: int) -> float:
    """What a jump adds to its sensor with a coefficient of 1, on average of the time from its instant on, in SI."""
    columns = zip(linearisation.cases, linearisation.hypotheses[k].columns, strict=True)
    case, column = next((case, column) for case, column in columns if column is not None)
    added = 0.0
    for term in column.terms:
        after = case.slow.epochs[term.slow] > 0.5
        driven, constant = (
            case.model.integrals[after, source(term.sensor, term.axis, of)] for of in (term.multiplier, "1")
        )
        added += term.weight * float(np.mean(strength(driven, constant))) if after.any() else 0.0
    return added


def _moving(linearisation: Linearisation) -> dict[str, list[int]]:
    """Of each sensor the members of the best set that are no constants."""
    constants = (*CONSTANTS, "gyro.bias")
    members = [k for k in linearisation.best.members if linearisation.hypotheses[k].candidate.name not in constants]
    found: dict[str, list[int]] = {}
    for k, channel in zip(members, _channels(linearisation, members), strict=True):
        if channel.startswith(SENSORS):
            found.setdefault(channel, []).append(k)
    return found


def outdone(findings: Findings, policy: Policy) -> bool:
    """Whether a sure disturbance without a name gains more than the effects.

    A form that follows the motion is held against them as another law would be: what keeps it from being heard where
    nothing is wrong no longer counts.
    """
    gain, linearisation = findings.gain_of_form, findings.linearisation
    own = gain - linearisation.space.cost * len(linearisation.best.members)
    return any(
        one.gain > gain + policy.open_margin or (one.follows and one.gain + policy.alone > own + policy.open_margin)
        for one in findings.alone
    )


def holds(linearisation: Linearisation, policy: Policy) -> bool:
    """Whether the effects do no harm on data that did not suggest them, and no placebo does better.

    What is composed of a column must help.
    """
    fit = linearisation.held_out
    harmless = max(fit["harm_nats"], fit["placebo_nats"]) < policy.harm
    composed = any(linearisation.hypotheses[k].candidate.name == COMPOSED for k in linearisation.best.members)
    return harmless and (not composed or fit["after"] < min(fit["before"], fit["placebo"]))


def only_described(findings: Findings, surest: Suspect | None, policy: Policy) -> bool:
    """Whether the effects follow the shape of something else.

    A disturbance that gains more has suggested the effects of other sensors, one that gains `Policy.near` more those of
    its own; more by what the linear sums of these leave open.
    And what follows a law explains nothing where a mismatch is left in its very channel, unless effects of others
    explain most; but a bench always leaves one, and beside geometry, which is exact, the least error of a law is left.
    """
    linearisation = findings.linearisation
    members = linearisation.best.members
    channels = _channels(linearisation, members)
    if surest is not None:
        elsewhere = surest.interval.channel.name not in channels
        left_open = policy.nats_left_open(linearisation.best.log_posterior)
        lead = max(0.0 if elsewhere else policy.near, left_open)
        if surest.gain > findings.gain_of_form + lead:
            return True
    left = findings.beside.mismatch
    geometry = linearisation.space.exact[list(members)].any()
    if left is None or geometry or findings.cases[left.recording].believed is None:
        return False
    lawful = [k for k in members if linearisation.hypotheses[k].candidate.lawful]
    if left.channel not in _channels(linearisation, lawful):
        return False
    others = [k for k, channel in zip(members, channels, strict=True) if channel != left.channel]
    return linearisation.gain(others) < 0.5 * linearisation.gain(members)


def _insufficient(findings: Findings, surest: Suspect | None, place: tuple[Mismatch, ...], policy: Policy) -> Decision:
    """The verdict where effects are not enough: sure ones beside something, or a place without a name."""
    findings = _without_crowd(findings, policy)
    linearisation, beside, instead = findings.linearisation, findings.beside, findings.instead
    shown = findings.shown
    if surest is not None and surest.gain > findings.gain_of_form:
        shown = place + shown
    lead = open_margin(findings, policy)
    if beside.mismatch is not None:  # with it they do better; they must still be worth what they cost
        lead += max(beside.gain, 0.0) - linearisation.space.cost
    harms = not holds(linearisation, policy)
    if harms and surest is None and instead.gain < policy.open_margin:
        return Decision(NO_MISMATCH, UnnamedDisturbance(None, 0.0, beside.significance_sigma))
    described = outdone(findings, policy) or only_described(findings, surest, policy)
    better = outgained(findings, lead)
    if harms or described or better:
        unlike_any = better and instead.mismatch is not None and instead.gain > 0.0
        surest_first = tuple(sorted(shown, key=lambda one: -one.significance_sigma))
        place = place or ((instead.mismatch,) if unlike_any else surest_first)
        if surest is not None and surest.follows and described:  # held against the effects as another law would be
            sigma = float(np.sqrt(2.0 * (surest.gain + policy.alone)))
            place = (replace(place[0], significance_sigma=sigma),)
        unnamed = replace(instead, mismatch=place[0], significance_sigma=place[0].significance_sigma)
        return Decision(UNEXPLAINED, unnamed, place)
    return Decision(PARTLY, beside, shown, named=True)


def _without_crowd(findings: Findings, policy: Policy) -> Findings:
    """The findings without effects that only describe a sensor, where others explain most: it is left beside these."""
    linearisation, members = findings.linearisation, findings.linearisation.best.members
    crowd = describing(linearisation, policy)
    kept = [k for k in members if k not in crowd]
    lost = linearisation.gain(members) - linearisation.gain(kept)
    if not crowd or lost > 0.5 * linearisation.gain(members):
        return findings
    place = max((findings.shown[members.index(k)] for k in crowd), key=lambda one: one.significance_sigma)
    beside = findings.beside
    if beside.mismatch is None:
        beside = UnnamedDisturbance(place, lost, place.significance_sigma)
    return replace(findings, linearisation=linearisation.set_aside(crowd), beside=beside)


def _channels(linearisation: Linearisation, members: Sequence[int]) -> list[str]:
    """The channel that each of these hypotheses disturbs."""
    ones = [linearisation.hypotheses[k].candidate for k in members]
    return [one.channel for one in ones]
