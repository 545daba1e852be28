"""``ins-eval evaluate``: how good an instrument is, from its own recording."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ins_eval.analysis.several import summary
from ins_eval.commands.delivery import deliver
from ins_eval.errors import DataRefused, InsEvalError, StorageError, UsageError
from ins_eval.interface.evaluate import evaluate, evaluate_several
from ins_eval.interface.read import read

TRACKS = ("kml", "gpx")  # of one recording each


def run(
    inputs: Sequence[Path],
    output: Path | None = None,
    compensation: Sequence[str] = (),
    restart_every_s: float | None = None,
    export: Sequence[str] = (),
    json: Path | None = None,
    quiet: bool = False,
    **of_reading: Any,
) -> int:
    """Evaluate a recording into `output` (by default ``reports/NAME``) and print its text.

    Several are written into ``output/NAME`` (by default ``reports/evaluation/NAME``) and come on one page above them;
    a refused one is a row of it, and the exit code says that there was one. `of_reading` are options of `read`.
    """
    if len(inputs) == 1:
        where = Path("reports") / inputs[0].stem if output is None else output
        deliver(evaluate(read(inputs[0], **of_reading), compensation, restart_every_s), where, quiet, json, export)
        return 0
    where = Path("reports") / "evaluation" if output is None else output
    names = [source.stem for source in inputs]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise UsageError(f"evaluate: two recordings are called '{twice}', expected names that differ; rename a folder")
    kept = []
    for source, name in zip(inputs, names, strict=True):
        try:
            one = evaluate(read(source, **of_reading), compensation, restart_every_s)
            deliver(one, where / name, True, None, export)
            kept.append(summary(name, one.found))
        except StorageError:
            raise
        except InsEvalError as refused:
            kept.append(summary(name, refused))
    deliver(evaluate_several(kept), where, quiet, json, [form for form in export if form not in TRACKS])
    return DataRefused.exit_code if any(one.refused for one in kept) else 0
