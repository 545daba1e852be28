"""Where a search may begin: clocks of what measures brought together as far as the motion itself tells."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ins_eval.recording import PARKED
from ins_eval.recording.belief import EffectBelief
from ins_eval.recording.consistency.clock_history import ClockHistory, clock_histories

if TYPE_CHECKING:
    from ins_eval.estimation.case import Case
    from ins_eval.estimation.study import Hypothesis

JUMP, DRIFT = "recording.clock_step", "recording.clock_drift"


def clock_beliefs(case: Case) -> list[tuple[EffectBelief, ...]]:
    """What a belief says of its clocks for each history that the motion of a recording tells.

    None of what is parked, nor of accelerometers that count pulses, whose fixes are not late by tenths of a second.
    """
    if case.believed is None or case.kind in PARKED:
        return []
    recording, velocity = case.believed.recording, case.seen.measured_by[3]
    source = next((one for one in case.seen.sources if one.name == velocity), None)
    if source is None or recording.imu.accelerometer_form == "pulse":
        return []
    fixes = replace(source.fixes, time_s=source.instants_s)
    return [tuple(_believed(one, velocity)) for one in clock_histories(recording.imu, recording.start.time_s, fixes)]


def _believed(history: ClockHistory, source: str) -> Iterator[EffectBelief]:
    yield EffectBelief(name=f"{source}.time_offset", value=history.offset_s)
    if history.jump_s:
        yield EffectBelief(name=JUMP, value=history.clock_step, at_s=history.at_s)
    if history.drift:
        yield EffectBelief(name=DRIFT, value=history.clock_drift_ppm)


def clock_starts(
    cases: Sequence[Case], hypotheses: Sequence[Hypothesis]
) -> Iterator[tuple[list[Hypothesis], np.ndarray]]:
    """The same as hypotheses (k,) and their coefficients (k,).

    A delay is of the receiver, the same in all recordings; a jump and a drift are of one of them.
    """
    for r, case in enumerate(cases):
        for beliefs in clock_beliefs(case):
            model = [_hypothesis(one, case, r, hypotheses) for one in beliefs]
            known = [one for one in model if one is not None]
            if len(known) == len(model):
                values = zip(beliefs, known, strict=True)
                yield known, np.array([one.value / made.candidate.nominal for one, made in values])


def _hypothesis(one: EffectBelief, case: Case, r: int, hypotheses: Sequence[Hypothesis]) -> Hypothesis | None:
    """The hypothesis of recording `r` that is an effect on clocks; None where the recording could not show it."""
    found = next((h for h in hypotheses if h.candidate.name == one.name and h.columns[r] is not None), None)
    if found is None or one.name != JUMP:
        return found
    candidate = case.member(JUMP, None, {"at_s": one.at_s})
    columns = tuple(candidate.column if k == r else None for k in range(len(found.columns)))
    return replace(found, candidate=candidate, columns=columns)
