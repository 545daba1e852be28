"""What every answer keeps to before it is given: pure functions of a diagnosis.

An answer that names effects is a statement of a probability, a size, a fit and a verdict, which must tell one story.
Each function of `INVARIANTS` returns the effects that violate it; the first line of its docstring says what holds.
What violates is withdrawn and left unexplained (`judge.consistent`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from statistics import NormalDist
from typing import TYPE_CHECKING

import numpy as np

from ins_eval.diagnosis.answer.decision import describing
from ins_eval.diagnosis.answer.verdict import (
    EXPLAINED,
    NO_MISMATCH,
    NOT_IDENTIFIABLE,
    PARTLY,
    Q95,
    UNEXPLAINED,
    Withdrawn,
)

if TYPE_CHECKING:
    from ins_eval.diagnosis.answer.verdict import Diagnosis, FoundEffect

Effects = tuple["FoundEffect", ...]
Invariant = Callable[["Diagnosis"], Effects]


def violations(found: Diagnosis, among: Iterable[Invariant] | None = None) -> tuple[Withdrawn, ...]:
    """Every effect that violates an invariant, all or some `among` them, each with the first that it violates."""
    first: dict[int, Withdrawn] = {}
    for invariant in INVARIANTS if among is None else among:
        for one in invariant(found):
            first.setdefault(id(one), Withdrawn(one, invariant.__doc__.partition("\n")[0].rstrip(".")))
    return tuple(first.values())


def probable(found: Diagnosis) -> Effects:
    """An effect has a probability of at least a half, where it is not identifiable together with its rivals."""
    together = found.verdict == NOT_IDENTIFIABLE

    def least(one: FoundEffect) -> float:
        rivals = [r.probability for r in found.rivals if r.of is one.hypothesis] if together else []
        return one.probability + sum(rivals)

    return tuple(one for one in found.effects if not least(one) >= found.policy.probable)


def accounting(found: Diagnosis) -> Effects:
    """An effect accounts for a part of what was seen."""
    return tuple(one for one in found.effects if not one.log_evidence_gain > 0.0)


def predictive(found: Diagnosis) -> Effects:
    """Effects lose nothing on data that were not used, and no placebo leads them.

    Neither by more than `Policy.harm` nats of log predictive density.
    """
    worst = max(found.held_out[name] for name in ("harm_nats", "placebo_nats")) if found.effects else 0.0
    return () if worst < found.policy.harm else found.effects


def few(found: Diagnosis) -> Effects:
    """No more effects of one sensor are named than explain something.

    A constant aside; what needs more, or two that are unusually large, is only described by them, and is left
    unexplained beside what others explain.
    """
    if found.linearisation is None or any(case.believed is None for case in found.cases):
        return ()
    crowd = {found.linearisation.hypotheses[k] for k in describing(found.linearisation, found.policy)}
    return tuple(one for one in found.effects if one.hypothesis in crowd)


def clearer(found: Diagnosis) -> Effects:
    """Beside what stays unexplained an effect shows more than that does, or stands by itself.

    What no name explained before any effect was withdrawn says by how much recordings depart from every model here; an
    effect that shows less may be a part of that. By itself it stands from `Policy.plain` sigmas on.
    """
    if found.verdict != PARTLY or found.linearisation is None:
        return ()
    least = min(found.departure_sigma, found.policy.plain)
    cost = found.linearisation.space.cost
    return tuple(one for one in found.effects if 2.0 * (one.log_evidence_gain - cost) < least**2)


def sized(found: Diagnosis) -> Effects:
    """The 95 % interval of an effect excludes 0, or contains the value that physics fixes.

    And no effect is larger than what any such sensor has.
    """

    def supported(one: FoundEffect) -> bool:
        candidate, reach = one.hypothesis.candidate, Q95 * one.sigma
        fixed = candidate.centre * candidate.nominal
        if abs(one.value) > candidate.largest * candidate.nominal:
            return False
        return abs(one.value) > reach or (fixed != 0.0 and abs(one.value - fixed) <= reach)

    return tuple(one for one in found.effects if not (np.isfinite(one.value) and supported(one)))


def leading(found: Diagnosis) -> Effects:
    """No rival lies above the effect in whose place it could stand.

    By more than `Policy.stay` nats, by which a set must lead to be navigated with. What needs others beside it has
    more that is free, and is compared by its size (`rivals`).
    """
    above = [r.of for r in found.rivals if not r.beside and r.below_best < -found.policy.stay]
    return tuple(one for one in found.effects if any(one.hypothesis is of for of in above))


def measuring(found: Diagnosis) -> Effects:
    """An effect is of a sensor that measures all the time.

    What is named of one that holds one value, or is at a limit, for more than `Policy.unmeasured` of any recording
    describes that it does not measure there.
    """
    most = found.policy.unmeasured
    blind = {name for case in found.cases for name, share in case.unmeasured().items() if share > most}
    return tuple(one for one in found.effects if one.hypothesis.candidate.channel in blind)


def sufficient(found: Diagnosis) -> Effects:
    """Where effects suffice, nothing significant is left.

    That is no mismatch, and no interval more remarkable than the least probable that may count as one, or than the
    share of what the effects gain that laws may leave (`Policy.least_share`), as a deviate sqrt(2 * nats).
    """
    if found.verdict not in (EXPLAINED, NOT_IDENTIFIABLE):
        return ()
    policy = found.policy
    names = ("interval", "interval_position", "interval_velocity", "interval_navigation", "interval_attitude")
    sure = NormalDist().inv_cdf(1.0 - min(getattr(policy, name) for name in names))
    share = policy.least_share(case.kind for case in found.cases)
    law = np.sqrt(2.0 * share * sum(max(one.log_evidence_gain, 0.0) for one in found.effects))
    left = found.unnamed
    return () if left.mismatch is None and left.significance_sigma <= max(sure, law) else found.effects


def one_story(found: Diagnosis) -> Effects:
    """Verdict, effects, rivals and what is unexplained tell one story."""
    return () if tells_one_story(found) else found.effects


def tells_one_story(found: Diagnosis) -> bool:
    """Whether the verdict has the effects, rivals and places that it speaks of.

    no mismatch, unexplained   no effect and no rival; a place of what is unexplained under the second only
    explained                  effects, no rival within `Policy.near`
    not identifiable           effects, a rival within `Policy.near`
    partly explained           effects, and a place of what is unexplained
    """
    near = any(one.below_best < found.policy.near for one in found.rivals)
    place = found.unnamed.mismatch is not None
    if found.verdict in (NO_MISMATCH, UNEXPLAINED):
        return not found.effects and not found.rivals and place == (found.verdict == UNEXPLAINED)
    if not found.effects or not found.mismatches:
        return False
    return {EXPLAINED: not near and not place, NOT_IDENTIFIABLE: near and not place, PARTLY: place}[found.verdict]


NOTHING: tuple[Invariant, ...] = (accounting, sized)  # what violates them may be 0, or nothing that a sensor has
OF_EFFECTS: tuple[Invariant, ...] = (measuring, probable, accounting, clearer, sized, leading)
OF_ANSWERS: tuple[Invariant, ...] = (few, predictive, sufficient, one_story)
INVARIANTS = (*OF_EFFECTS, *OF_ANSWERS)
