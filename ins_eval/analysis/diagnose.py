"""Where recordings leave what is believed of them, from their folders."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from ins_eval.believed import BeliefRow, belief_rows, believed, believed_of_chamber
from ins_eval.diagnosis.answer.answer import answer
from ins_eval.diagnosis.answer.described import with_descriptions
from ins_eval.diagnosis.answer.judge import judge
from ins_eval.diagnosis.answer.verdict import Diagnosis
from ins_eval.errors import DataRefused
from ins_eval.estimation.case import Case, prepare, with_effects
from ins_eval.estimation.chamber import prepare_chamber
from ins_eval.estimation.description import (
    wrong_columns,
    wrong_descriptions,
    wrong_descriptions_of_chamber,
)
from ins_eval.estimation.stated_start import wrong_start
from ins_eval.estimation.wrong_description import WrongDescription
from ins_eval.recording import form
from ins_eval.recording.belief import Belief, EffectBelief
from ins_eval.recording.consistency import WARNING
from ins_eval.recording.consistency.limits import without_jumps
from ins_eval.recording.consistency.settling import settled
from ins_eval.recording.form.description import CHAMBER, open_folder
from ins_eval.recording.mending import FAMILY, mended

if TYPE_CHECKING:
    import pandas as pd

    from ins_eval.recording import Recording

STEPS = 4  # of the search, beside one for each recording


@dataclass(frozen=True, eq=False)
class RecordingsDiagnosis:
    """A verdict over recordings; `written` are the effects of a belief that was written, if one was.

    `belief` is that of the first recording, `stated` the rows of it for the page, by the name of each recording;
    `warnings` are what contradicts itself in them and is likely.
    """

    diagnosis: Diagnosis
    belief: Belief
    stated: Mapping[str, Sequence[BeliefRow]]
    warnings: Sequence[str] = ()
    written: Sequence[EffectBelief] = ()

    @cached_property
    def answer(self) -> dict[str, Any]:
        """The answer in the form ins-eval-diagnosis."""
        return answer(self.diagnosis)

    def to_frame(self) -> pd.DataFrame:
        """One row an effect that was found, as the answer states it; empty where none was."""
        import pandas as pd

        return pd.json_normalize(self.answer["effects"], max_level=0)


def diagnose_folders(
    folders: Sequence[Path],
    belief_file: Path | None = None,
    step: Callable[[str], None] = lambda words: None,
    unit: str | None = None,
) -> RecordingsDiagnosis:
    """Diagnose recordings of one instrument together.

    Parameters
    ----------
    folders : recordings in the form ins-recording/1
    belief_file : believed of all of them, in place of what their own folders say
    step : is told what comes next, once for each recording and `STEPS` times in the search
    unit : the inertial unit by the name of its data sheet, in place of what their own folders say

    Raises: UsageError, DataRefused.
    """
    made = []
    for folder, name in zip(folders, _names(folders), strict=True):
        step(folder.name)
        made.append(_made_ready(folder, name, belief_file, unit))
    belief = made[0].belief
    judged = judge([one.case for one in made], step, belief)
    still = [_still_wrong(one, judged.believed_in(r)) for r, one in enumerate(made)]
    found = with_descriptions(judged, still)
    warnings = [words for one in made for words in one.warnings]
    return RecordingsDiagnosis(found, belief, {one.case.name: one.stated for one in made}, warnings)


def prepare_folders(folders: Sequence[Path]) -> list[Case]:
    """Recordings made ready to be judged together."""
    return [_made_ready(folder, name).case for folder, name in zip(folders, _names(folders), strict=True)]


def belief_of(folder: Path, belief_file: Path | None) -> tuple[Belief, Path]:
    """What is believed of a recording, and the folder to which the files that it names are relative."""
    if belief_file is None:
        return form.read_belief(folder), folder
    return form.belief_of_file(belief_file), belief_file.parent


class _Ready(NamedTuple):
    """A recording ready to be judged, its belief, the same as rows, what was mended in it, and what is likely wrong.

    `begun` is the recording with the start that was stated, where the attitude of that is among what was mended.
    """

    case: Case
    belief: Belief
    stated: Sequence[BeliefRow]
    wrong: Sequence[WrongDescription]
    warnings: Sequence[str]
    begun: Recording | None = None


def _made_ready(folder: Path, name: str, belief_file: Path | None = None, unit: str | None = None) -> _Ready:
    belief, where = belief_of(folder, belief_file)
    if open_folder(folder).description.kind == CHAMBER:
        belief = believed_of_chamber(belief)
        readings = form.read_chamber(folder)
        wrong = wrong_descriptions_of_chamber(readings, belief, name, where)
        right = with_effects(belief, [one.effect for one in wrong])
        return _Ready(prepare_chamber(readings, right, name, where), right, [], wrong, [])
    doubted, jumps = without_jumps(form.read(folder, belief=belief, doubted=True))
    doubted = replace(doubted, notes=(*doubted.notes, *(f"{WARNING}{one}." for one in jumps)))
    doubted = doubted if unit is None else replace(doubted, unit=unit)
    wrong, found = wrong_descriptions(replace(doubted, name=name, folder=where))
    right = replace(doubted, belief=with_effects(belief, [one.effect for one in wrong]))
    recording = settled(believed(replace(form.validated(right, found, judged=True), name=name, folder=where)))
    stated = tuple(one for one in belief.effects if one.name.startswith(FAMILY))  # mended, and still believed
    warnings = [words for words in recording.notes if words.startswith(WARNING)]
    case = prepare(recording, where)
    if more := wrong_columns(recording, case):
        wrong = [*wrong, *more]
        recording = mended(replace(recording, belief=with_effects(recording.belief, [one.effect for one in more])))
        case = prepare(recording, where)
    whole, begun = with_effects(recording.belief, stated), None
    if turned := wrong_start(recording, case):
        wrong, begun = [*wrong, *turned], recording
        right = with_effects(recording.belief, [one.effect for one in turned])
        case = prepare(replace(recording, belief=right), where)
    return _Ready(case, whole, belief_rows(recording), wrong, warnings, begun)


def _still_wrong(one: _Ready, effects: Sequence[EffectBelief]) -> Sequence[WrongDescription]:
    """What was mended and is wrong also where the `effects` that were found are believed.

    Gyros that step turn what the whole recording shows of its start.
    """
    if one.begun is None or not effects:
        return one.wrong
    with_them = replace(one.begun, belief=with_effects(one.begun.belief, effects))
    others = [each for each in one.wrong if not each.effect.name.startswith("alignment.")]
    try:
        return [*others, *wrong_start(with_them, prepare(with_them, one.case.believed.folder))]
    except DataRefused:  # it cannot be navigated with them
        return one.wrong


def _names(folders: Sequence[Path]) -> list[str]:
    """What the answer calls each recording: its own name, its folder where two have the same."""
    names = [open_folder(folder).name if folder.is_dir() else folder.name for folder in folders]
    return [str(f) if names.count(name) > 1 else name for f, name in zip(folders, names, strict=True)]
