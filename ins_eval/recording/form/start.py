"""Where a recording begins: as it is stated, else as fixes show it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ins_eval.errors import DataRefused
from ins_eval.recording import PARKED, Fixes, Start
from ins_eval.recording.begin import begin_at_a_fix
from ins_eval.recording.form.description import Opened, StartTable


def start_of(opened: Opened, tables: Mapping[str, Fixes | None], step_before_s: float) -> tuple[Start, list[str]]:
    """The start that is stated, one step before the first sample if it has no time; its place else that of a fix."""
    stated = opened.description.start or StartTable()
    notes = []
    if opened.description.start is not None and stated.time_s is None:
        notes.append("The start has no time_s: it was taken one step before the first sample.")
    if stated.latitude_deg is not None:
        return stated.state(step_before_s), notes
    found = begin_at_a_fix(tables, opened.belief, step_before_s if stated.time_s is None else stated.time_s)
    if found is None:
        raise DataRefused(
            f"{opened.file}: neither [start] nor a fix says where the recording begins, expected a position; add "
            "[start] with latitude_deg, longitude_deg and height_m"
        )
    start, assumed = found
    if opened.description.kind in PARKED:
        start = replace(start, velocity_n=(0.0, 0.0, 0.0), velocity_sigma_mps=0.0)
    return stated.state(step_before_s, start), [
        *notes,
        "No place of the start is stated: it is that of the nearest fix.",
        *assumed,
    ]


def start_of_solution(opened: Opened, solution: Fixes) -> Start:
    """The start that is stated, or the first row of the solution with a position; without one its place is NaN."""
    stamp_s = solution.time_s - opened.belief.solution.time_offset_s
    stated = opened.description.start
    if stated is not None and stated.latitude_deg is not None:
        return stated.state(float(stamp_s[0]))
    placed = np.flatnonzero(np.isfinite(solution.latitude_rad) & np.isfinite(solution.longitude_rad))
    row = int(placed[0]) if placed.size else 0
    known = {"height_m": np.nan_to_num(solution.height_m), "velocity_n": np.nan_to_num(solution.velocity_n)}
    return Start(float(stamp_s[row]), **replace(solution, **known).state(row))
