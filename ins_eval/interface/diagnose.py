"""Where recordings leave what is believed of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from ins_eval.analysis.diagnose import RecordingsDiagnosis, belief_of, diagnose_folders
from ins_eval.estimation.case import with_effects, without_roots
from ins_eval.interface.result import PathLike, Result
from ins_eval.recording import form
from ins_eval.report.diagnosis import TITLE, diagnosis_content
from ins_eval.report.diagnosis_page import page
from ins_eval.tree import as_tree


def diagnose(
    recordings: Sequence[PathLike],
    belief: PathLike | None = None,
    model_file: PathLike | None = None,
    step: Callable[[str], None] = lambda words: None,
    unit: str | None = None,
) -> Result[RecordingsDiagnosis]:
    """Where recordings of one instrument leave what is believed of them: see `analysis.diagnose.diagnose_folders`.

    `belief` replaces that of all recordings; `model_file` gets a belief with the posterior of all effects; `unit` names
    the data sheet that fills what nobody stated.
    ``result.found.answer`` is the answer in the form ins-eval-diagnosis.
    """
    folders, belief_file = [Path(folder) for folder in recordings], None if belief is None else Path(belief)
    found = diagnose_folders(folders, belief_file, step, unit)
    if model_file is not None:
        found = replace(found, written=found.diagnosis.forecast)
        _, where = belief_of(folders[0], belief_file)
        form.write_belief(Path(model_file), with_effects(without_roots(found.belief), found.written), where)
    tree, draw = page(found.diagnosis, found.answer, found.written)
    tree["belief"], tree["warnings"] = found.stated, found.warnings
    return Result(TITLE, found, as_tree(tree), *diagnosis_content(tree), draw)
