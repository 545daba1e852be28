"""``ins-eval evaluate``: how good an instrument is, from its own recording."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from ins_eval import parallel
from ins_eval.analysis.several import Summary, summary
from ins_eval.commands.delivery import deliver
from ins_eval.compensation.registry import FILE
from ins_eval.errors import DataRefused, InsEvalError, StorageError, UsageError
from ins_eval.interface.evaluate import evaluate, evaluate_several
from ins_eval.interface.read import read
from ins_eval.progress import progress
from ins_eval.recording import Recording

TRACKS = ("kml", "gpx")  # of one recording each


def run(
    inputs: Sequence[Path],
    output: Path | None = None,
    compensation: Sequence[str] = (),
    restart_every_s: float | None = None,
    export: Sequence[str] = (),
    json: Path | None = None,
    quiet: bool = False,
    workers: int | None = None,
    scheduler: str | None = None,
    **of_reading: Any,
) -> int:
    """Evaluate a recording into `output` (by default ``reports/NAME``) and print its text.

    Several are written into ``output/NAME`` (by default ``reports/evaluation/NAME``), in parallel, and come on one page
    above them; a refused one is a row of it, and the exit code says that there was one. `of_reading` are options of
    `read`.
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
    seen = Path if scheduler is None else Path.absolute  # its workers stand in folders of their own
    of_reading |= {key: seen(value) for key, value in of_reading.items() if isinstance(value, Path)}
    compensation = [str(seen(Path(one))) if one.endswith(FILE) else one for one in compensation]
    asked = partial(_summary, partial(read, **of_reading), compensation, restart_every_s, export)
    jobs = {name: (seen(source), seen(where / name)) for source, name in zip(inputs, names, strict=True)}
    found = {}
    with progress(len(jobs), "recordings", quiet) as bar:
        for name, one in parallel.results(asked, jobs, workers, scheduler):
            found[name] = one
            bar.update()
    kept = [found[name] for name in names]
    deliver(evaluate_several(kept), where, quiet, json, [form for form in export if form not in TRACKS])
    return DataRefused.exit_code if any(one.refused for one in kept) else 0


def _summary(
    from_folder: Callable[[Path], Recording],
    compensation: Sequence[str],
    restart_every_s: float | None,
    export: Sequence[str],
    source: Path,
    where: Path,
) -> Summary:
    """What is kept of one of several recordings, whose own report is written to `where`; runs in a worker."""
    try:
        one = evaluate(from_folder(source), compensation, restart_every_s)
        deliver(one, where, True, None, export)
    except StorageError:
        raise
    except InsEvalError as refused:
        return summary(where.name, refused)
    return summary(where.name, one.found)
