"""Wrong descriptions in an answer: named first, before the physics that was found in the recordings as mended."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ins_eval.diagnosis.answer.verdict import (
    EXPLAINED,
    NO_MISMATCH,
    PARTLY,
    UNEXPLAINED,
    Diagnosis,
    FoundEffect,
)
from ins_eval.diagnosis.unnamed.mismatch import Mismatch, deviate
from ins_eval.effects.vocabulary import VOCABULARY
from ins_eval.error_model.columns import Column
from ins_eval.error_model.library import Candidate, channel_of
from ins_eval.estimation.study import Hypothesis
from ins_eval.recording.belief import EffectBelief

if TYPE_CHECKING:
    from ins_eval.estimation.wrong_description import WrongDescription

VERDICTS = {NO_MISMATCH: EXPLAINED, UNEXPLAINED: PARTLY}  # with a wrong description beside it


def with_descriptions(found: Diagnosis, wrong: Sequence[Sequence[WrongDescription]]) -> Diagnosis:
    """A diagnosis of recordings as mended, with what was mended in each."""
    if not any(wrong):
        return found
    named: dict[tuple, FoundEffect] = {}
    places = []
    for r, of_recording in enumerate(wrong):
        nodes_s = found.cases[r].model.nodes_s
        for one in of_recording:
            effect = _found(one, r, len(found.cases))
            named[_key(effect)] = _joined(named.get(_key(effect)), effect)
            channel = channel_of(one.effect.name, one.effect.axis, {})
            begin_s = one.effect.at_s or float(nodes_s[0])
            sigma = deviate(one.log_odds)
            places.append(Mismatch(r, channel, "", begin_s, float(nodes_s[-1]), one.seen, sigma))
    effects = tuple(_whole(one, named.pop(_key(one), None)) for one in found.effects)
    return replace(
        found,
        effects=effects,
        verdict=VERDICTS.get(found.verdict, found.verdict),
        described=tuple(sorted(named.values(), key=lambda one: -one.log_evidence_gain)),
        mismatches=(*places, *found.mismatches),
    )


def _key(one: FoundEffect) -> tuple:
    candidate = one.hypothesis.candidate
    return candidate.name, candidate.axis, *sorted(candidate.parameters.items())


def _whole(rest: FoundEffect, mended: FoundEffect | None) -> FoundEffect:
    """An effect of which a part was `mended` before the `rest` was found."""
    if mended is None:
        return rest
    gain = mended.log_evidence_gain + rest.log_evidence_gain
    return replace(rest, value=mended.value + rest.value, log_evidence_gain=gain)


def _joined(before: FoundEffect | None, one: FoundEffect) -> FoundEffect:
    """The same in one more recording."""
    if before is None:
        return one
    both = zip(before.hypothesis.columns, one.hypothesis.columns, strict=True)
    better = max(before, one, key=lambda either: either.log_evidence_gain)
    return replace(better, hypothesis=replace(one.hypothesis, columns=tuple(a or b for a, b in both)))


def _found(wrong: WrongDescription, r: int, count: int) -> FoundEffect:
    belief, effect = wrong.effect, VOCABULARY[wrong.effect.name]
    keys = (*effect.words, *(parameter.name for parameter in effect.parameters))
    known = {key: getattr(belief, key) for key in keys if key in EffectBelief.model_fields}
    column = Column("")
    candidate = Candidate(
        belief.name, belief.axis, effect.unit, 1.0, column, {key: one for key, one in known.items() if one is not None}
    )
    chance = float(np.exp(-max(wrong.log_odds, 0.0)))
    return FoundEffect(
        hypothesis=Hypothesis(candidate, tuple(column if k == r else None for k in range(count))),
        value=belief.value,
        sigma=wrong.sigma,
        probability=1.0 / (1.0 + chance),
        log_evidence_gain=wrong.log_odds,
        false_alarm_probability=chance,
    )
