"""Results of runs side by side."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

from ins_eval.analysis.results import RunComparison, compare_results
from ins_eval.errors import UsageError
from ins_eval.figures.results.summary import runs_figures
from ins_eval.interface.result import PathLike, Result
from ins_eval.report.runs import runs_content


def results(folders: Sequence[PathLike]) -> Result[RunComparison]:
    """Results of runs side by side, each held against the first: see `analysis.results.compare_results`."""
    if len(folders) < 2:
        raise UsageError("results: one folder, expected two or more to compare; name another")
    found = compare_results([Path(folder) for folder in folders])
    return Result(
        f"Results: {' beside '.join(run.name for run in found.runs)}",
        found,
        found.tree,
        *runs_content(found),
        partial(runs_figures, found),
    )
