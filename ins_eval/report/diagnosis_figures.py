"""The figures on the page of a diagnosis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.figure import Figure

from ins_eval.diagnosis.answer.nonparametric import Located
from ins_eval.diagnosis.answer.summary import BeforeAfter, block_length_s
from ins_eval.diagnosis.answer.verdict import Diagnosis
from ins_eval.diagnosis.unnamed.mismatch import Mismatch
from ins_eval.figures import diagnosis as figures
from ins_eval.report.diagnosis_words import channel, effect_words, numbered
from ins_eval.wording import sentence


def drawn(
    diagnosis: Diagnosis,
    tree: Mapping[str, Any],
    seen: list[tuple[Mapping | None, Located]],
    both: Sequence[BeforeAfter | None],
) -> dict[str, Figure]:
    """Every figure by its name; `tree` is what the page says, `seen` what was located, `both` before and after."""
    return {
        **_residuals(diagnosis, tree["recordings"]),
        **_evidence(tree["evidence"]),
        **_drives(tree["located"], seen, diagnosis.mismatches),
        **_gains(diagnosis, tree["recordings"], both),
    }


def _residuals(diagnosis: Diagnosis, recordings: Sequence[Mapping[str, Any]]) -> dict[str, Figure]:
    several = len(diagnosis.cases) > 1
    return {
        numbered("whitened_residuals", r, several): figures.whitened_residuals(
            time_s=case.model.nodes_s,
            innovations=innovations,
            located=[
                (one.begin_s, one.end_s, channel(one.channel)) for one in diagnosis.mismatches if one.recording == r
            ],
            block_s=block_length_s(case.model.nodes_s),
            channels=recordings[r]["channels"],
            title=f"Whitened residuals: {case.name}",
        )
        for r, (case, innovations) in enumerate(zip(diagnosis.cases, diagnosis.innovations, strict=True))
    }


def _evidence(evidence: Mapping[str, Any]) -> dict[str, Figure]:
    families = evidence["families"]
    if not families:
        return {}
    place = evidence["in_place_of"]
    drawn = figures.evidence_of_effects(
        names=[effect_words(one) for one in families],
        log_bayes_factors=[one["log_bayes_factor"] for one in families],
        named=[one["named"] for one in families],
        threshold=evidence["threshold"],
        where=f" in the place of {place}" if place else "",
    )
    return {"evidence_of_effects": drawn}


def _drives(
    entries: list[dict[str, Any]], seen: list[tuple[Mapping | None, Located]], mismatches: Sequence[Mismatch]
) -> dict[str, Figure]:
    drawn = {}
    for entry, (_, one) in zip(entries, seen, strict=True):
        axis = f", {one.axis}" if one.axis in ("N", "E", "D") else ""
        name, where = f"{channel(one.channel)}{axis}", (one.recording, one.channel)
        if entry["effect"] is None:
            drive_name, title = f"temperature [{one.drive_unit}]", f"What stays unexplained: {name}"
        else:
            unit = f" [{one.drive_unit}]" if one.drive_unit else ""
            drive_name, title = f"drive: what the value multiplies{unit}", sentence(entry["effect"]).rstrip(".")
        drawn[entry["figure"]] = figures.effect_against_drive(
            time_s=one.time_s,
            mean=one.mean,
            sigma=one.sigma,
            effect=one.effect,
            drive=None if one.drive is None else (drive_name, one.drive),
            quantity=f"{name} [{one.unit}]",
            located=[(at.begin_s, at.end_s) for at in mismatches if (at.recording, at.channel) == where],
            title=title,
        )
    return drawn


def _gains(
    diagnosis: Diagnosis, recordings: Sequence[Mapping[str, Any]], both: Sequence[BeforeAfter | None]
) -> dict[str, Figure]:
    several = len(diagnosis.cases) > 1
    return {
        numbered("before_and_after", r, several): figures.before_and_after(
            **pair._asdict(),
            block_s=block_length_s(pair.time_s),
            channels=recordings[r]["channels"],
            located=[(one.begin_s, one.end_s) for one in diagnosis.mismatches if one.recording == r],
            title=f"Before and after: {case.name}",
        )
        for r, (case, pair) in enumerate(zip(diagnosis.cases, both, strict=True))
        if pair is not None
    }
