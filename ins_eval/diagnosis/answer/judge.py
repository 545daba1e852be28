"""A diagnosis: what recordings hold (`collect`), the verdict over it (`decision`), and all that is said of it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import logsumexp
from threadpoolctl import threadpool_limits

from ins_eval.diagnosis.answer.collect import collect
from ins_eval.diagnosis.answer.decision import Decision, decide
from ins_eval.diagnosis.answer.experiments import Catalogue
from ins_eval.diagnosis.answer.invariants import NOTHING, OF_EFFECTS, violations
from ins_eval.diagnosis.answer.rivals import rivals, with_experiments
from ins_eval.diagnosis.answer.verdict import (
    EXPLAINED,
    NO_MISMATCH,
    NOT_IDENTIFIABLE,
    PARTLY,
    UNEXPLAINED,
    Diagnosis,
    FoundEffect,
    Rival,
    Withdrawn,
)
from ins_eval.diagnosis.unnamed.mismatch import UnnamedDisturbance
from ins_eval.effects.vocabulary import VOCABULARY
from ins_eval.estimation.own_noise import with_own_noise
from ins_eval.policy import Policy

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

    from ins_eval.diagnosis.answer.findings import Findings
    from ins_eval.estimation.case import Case
    from ins_eval.estimation.linearisation import Linearisation
    from ins_eval.estimation.study import Hypothesis
    from ins_eval.recording.belief import Belief


def judge(
    cases: Sequence[Case],
    progress: Callable[[str], None] = lambda _: None,
    belief: Belief | None = None,
    policy: Policy | None = None,
) -> Diagnosis:
    """Search recordings of one instrument together, and judge what is found.

    `belief` plans experiments where all of them are chambers; `policy` None: the thresholds as they are.
    """
    policy = policy or Policy()
    with threadpool_limits(1):  # small matrices: more threads in each product only wait for one another
        return answered(collect(cases, policy, progress), policy, progress, belief)


def answered(
    findings: Findings,
    policy: Policy,
    progress: Callable[[str], None] = lambda _: None,
    belief: Belief | None = None,
) -> Diagnosis:
    """The verdict over `findings`, and where it names effects all that is said of them."""
    found = consistent(findings, decide(findings, policy), policy)
    linearisation, others = found.linearisation, found.rivals
    if not found.effects:
        return found
    if others and (belief is not None or any(case.believed is not None for case in findings.cases)):
        progress("experiments")
        noise_points = [one.noise_point for one in linearisation.fitted]
        others = with_experiments(linearisation, others, Catalogue(findings.cases, noise_points, policy, belief))
    after = tuple(case.again(found.believed_in(r), linearisation.cases[r]) for r, case in enumerate(findings.cases))
    return replace(found, rivals=others, after=after)


def consistent(findings: Findings, decision: Decision, policy: Policy) -> Diagnosis:
    """What is said under a verdict, without effects that would contradict it: those are left unexplained.

    One above which a rival lies gives its place to that and is listed beside it. It does not come back, nor does what
    was withdrawn: of many that are alike, each better beside some of the others, there would be no end. Others are
    withdrawn, of several the one that gains least first: what may be nothing is left out, so that others take over
    what they shared; what is there and has no sure name stays in the fit, and is no rival of theirs.
    """
    departure_sigma = decision.unnamed.significance_sigma if decision.verdict == PARTLY else 0.0
    found = _said(findings, decision, policy, departure_sigma)
    withdrawn: tuple[Withdrawn, ...] = ()
    gone: set[Hypothesis] = set()
    while found.effects and (offending := violations(found)):
        violating = {one.effect.hypothesis for one in offending}
        better = (one for one in found.rivals if one.of in violating and one.below_best < 0.0 and not one.beside)
        no_more = {one.effect.hypothesis.key for one in withdrawn}
        above = [one for one in better if one.hypothesis not in gone and one.hypothesis.key not in no_more]
        if above:
            gone.add(above[0].of)
            decision, findings = exchanged(findings, decision, above[0], policy)
        else:
            nothing = _least(violations(found, NOTHING))
            going = nothing or _least(violations(found, OF_EFFECTS)) or offending
            withdrawn += going
            decision, findings = without(findings, decision, {one.effect.hypothesis for one in going}, not nothing)
        found = _said(findings, decision, policy, departure_sigma)
    return replace(found, withdrawn=withdrawn)


def _least(offending: Sequence[Withdrawn]) -> tuple[Withdrawn, ...]:
    """The one that gains least, if any."""
    return tuple(sorted(offending, key=lambda one: one.effect.log_evidence_gain)[:1])


def exchanged(findings: Findings, decision: Decision, rival: Rival, policy: Policy) -> tuple[Decision, Findings]:
    """The decision and the findings with a `rival`, the more probable of the two, in the place of its effect.

    Beside it another may gain too little to be sure. Where it is the more probable at a noise of its own, that is the
    noise of the answer, and the set before is one of another noise.
    """
    linearisation, members = findings.linearisation, findings.linearisation.best.members
    number = {one: k for k, one in enumerate(linearisation.hypotheses)}
    k, other = number[rival.of], rival.hypothesis.candidate
    before = findings.shown[members.index(k)]
    channel = other.channel
    now = replace(before, channel=channel, axis=other.axis or "")  # in whose place it stands, it shows where that does
    shown, mismatches = (
        tuple(now if one is before else one for one in places) for places in (findings.shown, decision.mismatches)
    )
    changed = linearisation.exchanged(k, number[rival.hypothesis])
    lessened = changed.sure(policy)
    if changed.fitted is not linearisation.fitted:
        lessened = with_own_noise(lessened, policy)
        findings = replace(findings, others=(*findings.others, linearisation))
    gone = [one for j, one in zip(changed.best.members, shown, strict=True) if j not in lessened.best.members]
    shown, mismatches = (tuple(one for one in places if one not in gone) for places in (shown, mismatches))
    return replace(decision, mismatches=mismatches), replace(findings, linearisation=lessened, shown=shown)


def without(
    findings: Findings, decision: Decision, dropped: Collection[Hypothesis], fitted: bool = True
) -> tuple[Decision, Findings]:
    """The decision and the findings without the effects `dropped`: the one that shows most is left unexplained.

    They stay `fitted` or are left out.
    """
    linearisation, members = findings.linearisation, findings.linearisation.best.members
    gone = [i for i, k in enumerate(members) if linearisation.hypotheses[k] in dropped]
    where = max((findings.shown[i] for i in gone), key=lambda one: one.significance_sigma)
    kept = [k for i, k in enumerate(members) if i not in gone]
    lost = linearisation.gain(members) - linearisation.gain(kept)
    left = UnnamedDisturbance(where, float(lost), where.significance_sigma)
    before = decision.unnamed
    if before.mismatch is not None and before.significance_sigma > left.significance_sigma:
        left = before
    if not kept:
        return replace(decision, verdict=UNEXPLAINED, unnamed=left, named=False), findings
    out = [members[i] for i in gone]
    lessened = linearisation.set_aside(out) if fitted else linearisation.without(out)
    shown = tuple(one for i, one in enumerate(findings.shown) if i not in gone)
    return replace(decision, verdict=PARTLY, unnamed=left), replace(findings, linearisation=lessened, shown=shown)


def _said(findings: Findings, decision: Decision, policy: Policy, departure_sigma: float) -> Diagnosis:
    """The verdict, and where it names effects all that is said of them but experiments.

    Effects that explain are not identifiable where a rival is near. `departure_sigma` see `Diagnosis`.
    """
    examined = findings.beside is not None and decision.verdict != NO_MISMATCH
    linearisation = findings.linearisation if examined else None
    named = linearisation is not None and decision.named
    others = rivals(linearisation, policy, findings.around_belief, findings.others) if named else ()
    near = decision.verdict == EXPLAINED and any(one.below_best < policy.near for one in others)
    return Diagnosis(
        cases=findings.cases,
        verdict=NOT_IDENTIFIABLE if near else decision.verdict,
        effects=_effects(linearisation) if named else (),
        rivals=others,
        mismatches=decision.mismatches,
        unnamed=decision.unnamed,
        null=findings.null,
        fitted=findings.null if linearisation is None else tuple(linearisation.fitted),
        innovations=findings.innovations,
        statistics=findings.statistics,
        held_out=linearisation.held_out if named else {},
        after=(),
        linearisation=linearisation,
        policy=policy,
        around_belief=findings.around_belief,
        departure_sigma=departure_sigma,
    )


def _effects(linearisation: Linearisation) -> tuple[FoundEffect, ...]:
    """What is said of each effect of the best set, the one that gains most first."""
    members = linearisation.best.members
    whole = linearisation.gain(members)
    mean, covariance = linearisation.coefficients
    placed = linearisation.refined.intervals if linearisation.refined else ()
    spread = {one.effect.key: one.spread for one in placed}
    added = sum((one.bent for one in placed), np.zeros(len(placed)))
    bent = {one.effect.key: x for one, x in zip(placed, added, strict=True)}
    found = []
    for i, k in enumerate(members):
        gain = whole - linearisation.gain([j for j in members if j != k])
        one = linearisation.hypotheses[k]
        form = VOCABULARY[one.candidate.name].form
        scattered = max(covariance[i, i], linearisation.scatter[i])
        variance = scattered + bent.get(one.key, 0.0) + (form * mean[i]) ** 2
        found.append(
            FoundEffect(
                hypothesis=one,
                value=float(mean[i] * one.candidate.nominal),
                sigma=float(np.sqrt(variance) * one.candidate.nominal),
                probability=_probability(linearisation, k),
                log_evidence_gain=float(gain),
                false_alarm_probability=float(min(1.0, np.exp(min(0.0, linearisation.space.cost - gain)))),
                spread=spread.get(one.key, {}),
            )
        )
    return tuple(sorted(found, key=lambda one: -one.log_evidence_gain))


def _probability(linearisation: Linearisation, k: int) -> float:
    """Posterior probability of effect `k` among all families in its place."""
    of_family, _ = linearisation.trusted(k).places(k)
    own = of_family[linearisation.space.families[k]]
    return float(np.exp(own - logsumexp(np.append(of_family, linearisation.space.cost))))
