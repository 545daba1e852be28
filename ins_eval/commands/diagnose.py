"""``ins-eval diagnose``: where a recording leaves what is believed of it."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from tqdm import tqdm

from ins_eval.diagnosis.answer import answer
from ins_eval.diagnosis.case import Case, prepare
from ins_eval.diagnosis.chamber import prepare_chamber
from ins_eval.diagnosis.judge import Judgement, judge
from ins_eval.errors import UsageError
from ins_eval.recording import form
from ins_eval.recording.belief import Belief
from ins_eval.recording.form.description import CHAMBER, open_folder
from ins_eval.report import text
from ins_eval.report.diagnosis import TITLE, diagnosis_content
from ins_eval.report.figures import diagnosis as figures
from ins_eval.report.results import as_json, write_results
from ins_eval.storage import write_whole
from ins_eval.tables import parse, read_toml
from ins_eval.units import DEG, DEG_PER_H, UG

BLOCK_S = 60.0  # over which a whitened residual is averaged for a figure


def run(
    recordings: Sequence[Path],
    belief: Path | None = None,
    json: Path | None = None,
    report: Path | None = None,
    quiet: bool = False,
) -> int:
    """Diagnose recordings of one instrument together; the answer as text, as JSON and as a page where wanted."""
    judgements = []
    with tqdm(total=len(recordings), desc="recordings", file=sys.stderr, disable=quiet) as bar:
        for folder in recordings:
            bar.set_postfix_str(folder.name)
            judgements.append(judge(_case(folder, belief), bar.set_postfix_str))
            bar.update()
    found = answer(judgements)
    tree = {"diagnosis": found, "recordings": [_facts(one) for one in judgements]}
    said, sections = diagnosis_content(tree)
    if json is not None:
        write_whole(json, as_json(found))
    drawn = _figures(judgements) if report is not None else {}
    if report is not None:
        write_results(report, TITLE, said, sections, tree, drawn, quiet)
    elif not quiet:
        print(text.render(TITLE, said, sections, figures=drawn))
    return 0


def _case(folder: Path, belief_file: Path | None) -> Case:
    if not folder.is_dir():
        raise UsageError(
            f"{folder}: diagnose takes a folder in the form ins-recording/1; bring this file into the form first: "
            "ins-eval import FORMAT FILE -o DIR"
        )
    belief, where = form.read_belief(folder), folder
    if belief_file is not None:
        tables = {key: table for key, table in read_toml(belief_file).items() if key in Belief.model_fields}
        belief, where = parse(Belief, tables, str(belief_file)), belief_file.parent
    if open_folder(folder).description.kind == CHAMBER:
        return prepare_chamber(form.read_chamber(folder), belief, open_folder(folder).name, where)
    return prepare(replace(form.read(folder), belief=belief), where)


def _facts(judgement: Judgement) -> dict[str, Any]:
    """What the page says of one recording: its residual, its noise, how white it is."""
    case = judgement.case
    residual, innovations = case.seen.residual, judgement.innovations
    measured = np.isfinite(residual)
    levels = case.noise.values(judgement.null.position)
    return {
        "name": case.name,
        "kind": case.kind,
        "measured_by": [source.name for source in case.seen.sources],
        "start_s": float(case.model.nodes_s[0]),
        "end_s": float(case.model.nodes_s[-1]),
        "measurements": int(measured.sum()),
        "outliers": case.outliers,
        "noise": {
            "velocity_random_walk_ug_per_sqrt_hz": levels["velocity_random_walk"] / UG,
            "angle_random_walk_deg_per_sqrt_h": levels["angle_random_walk"] / (DEG / 60.0),
            "accelerometer_wander_ug": levels["accelerometer_wander"] / UG,
            "gyro_wander_deg_per_h": levels["gyro_wander"] / DEG_PER_H,
            "slow_position_m": levels["slow_position"],
            "slow_position_time_s": levels["slow_position_time"],
            "slow_velocity_mps": levels["slow_velocity"],
            "slow_velocity_time_s": levels["slow_velocity_time"],
        },
        "white": [float(np.median(case.noise.white[m, k])) if m.any() else None for k, m in enumerate(measured.T)],
        "whiteness": [_whiteness(column) for column in innovations.T],
        "mismatch_axes": [one.axis for one in judgement.mismatches],
        "statistics": judgement.statistics,
    }


def _whiteness(column: np.ndarray) -> dict[str, float] | None:
    """RMS, correlation of neighbours, and RMS of means over `BLOCK_S` in their own sigma; all near 1, 0, 1 if white."""
    e = column[np.isfinite(column)]
    if e.size < 3:
        return None
    block = int(min(BLOCK_S, e.size // 3))
    means = e[: e.size // block * block].reshape(-1, block).mean(axis=1) * np.sqrt(block)
    return {
        "rms": float(np.sqrt(np.mean(e**2))),
        "correlation": float(np.mean(e[1:] * e[:-1]) / max(float(np.mean(e**2)), 1e-300)),
        "rms_of_means": float(np.sqrt(np.mean(means**2))),
    }


def _figures(judgements: Sequence[Judgement]) -> dict[str, Figure]:
    drawn = {}
    for k, judgement in enumerate(judgements):
        case = judgement.case
        name = "whitened_residuals" if len(judgements) == 1 else f"whitened_residuals_{k + 1}"
        drawn[name] = figures.whitened_residuals(
            time_s=case.model.nodes_s,
            innovations=judgement.innovations,
            located=[(one.begin_s, one.end_s, one.channel) for one in judgement.mismatches],
            block_s=BLOCK_S,
            title=f"Whitened residuals: {case.name}",
        )
    return drawn
