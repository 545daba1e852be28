"""``ins-eval diagnose``: where a recording leaves what is believed of it."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from tqdm import tqdm

from ins_eval.commands.diagnosis_page import page
from ins_eval.diagnosis.answer import answer
from ins_eval.diagnosis.case import Case, prepare, with_effects
from ins_eval.diagnosis.chamber import prepare_chamber
from ins_eval.diagnosis.judge import judge
from ins_eval.errors import UsageError
from ins_eval.recording import form
from ins_eval.recording.belief import Belief
from ins_eval.recording.form import write_belief
from ins_eval.recording.form.description import CHAMBER, open_folder
from ins_eval.report import text
from ins_eval.report.diagnosis import TITLE, diagnosis_content
from ins_eval.report.results import as_json, write_results
from ins_eval.storage import write_whole
from ins_eval.tables import parse, read_toml

STEPS = 4  # of the search, for the progress


def run(
    recordings: Sequence[Path],
    belief: Path | None = None,
    json: Path | None = None,
    report: Path | None = None,
    write_model: Path | None = None,
    quiet: bool = False,
) -> int:
    """Diagnose recordings of one instrument together; the answer as text, as JSON and as a page where wanted."""
    with tqdm(total=len(recordings) + STEPS, desc="diagnosis", file=sys.stderr, disable=quiet) as bar:

        def step(words: str) -> None:
            bar.set_postfix_str(words)
            bar.update()

        cases = []
        for folder, name in zip(recordings, _names(recordings), strict=True):
            step(folder.name)
            cases.append(_case(folder, name, belief))
        diagnosis = judge(cases, step, _belief(recordings[0], belief)[0])
    found = answer(diagnosis)
    foretold = [] if write_model is None else diagnosis.foretold
    if json is not None:
        write_whole(json, as_json(found))
    if write_model is not None:
        believed, where = _belief(recordings[0], belief)
        write_belief(write_model, with_effects(believed, foretold), where)
    if report is None and quiet:
        return 0
    tree, draw = page(diagnosis, found, foretold)
    said, sections = diagnosis_content(tree)
    if report is not None:
        write_results(report, TITLE, said, sections, tree, draw(), quiet)
    else:
        print(text.render(TITLE, said, sections, figures={}))
    return 0


def _case(folder: Path, name: str, belief_file: Path | None) -> Case:
    if not folder.is_dir():
        raise UsageError(
            f"{folder}: diagnose takes a folder in the form ins-recording/1; bring this file into the form first: "
            "ins-eval import FORMAT FILE -o DIR"
        )
    belief, where = _belief(folder, belief_file)
    if open_folder(folder).description.kind == CHAMBER:
        return prepare_chamber(form.read_chamber(folder), belief, name, where)
    return prepare(replace(form.read(folder), name=name, belief=belief), where)


def _belief(folder: Path, belief_file: Path | None) -> tuple[Belief, Path]:
    """What is believed of a recording, and the folder to which the files that it names are relative."""
    if belief_file is None:
        return form.read_belief(folder), folder
    tables = {key: table for key, table in read_toml(belief_file).items() if key in Belief.model_fields}
    return parse(Belief, tables, str(belief_file)), belief_file.parent


def _names(folders: Sequence[Path]) -> list[str]:
    """What the answer calls each recording: its own name, its folder where two have the same."""
    names = [open_folder(folder).name if folder.is_dir() else folder.name for folder in folders]
    return [str(f) if names.count(name) > 1 else name for f, name in zip(folders, names, strict=True)]
