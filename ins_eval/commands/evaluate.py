"""``ins-eval evaluate``: how good an instrument is, from its own recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from ins_eval import parallel
from ins_eval.analysis.evaluate import RecordingEvaluation
from ins_eval.analysis.several import Summary, summary
from ins_eval.analysis.solution import SolutionEvaluation
from ins_eval.commands.delivery import deliver
from ins_eval.compensation.registry import FILE
from ins_eval.errors import DataRefused, InsEvalError, StorageError, UsageError
from ins_eval.interface.evaluate import evaluate, evaluate_several
from ins_eval.interface.read import read
from ins_eval.interface.result import Result
from ins_eval.progress import progress

TRACKS = ("kml", "gpx")  # of one recording each


@dataclass(frozen=True)
class Options:
    """How recordings are read and evaluated, as ``ins-eval evaluate --help`` says it."""

    compensation: Sequence[str] = ()
    restart_every_s: float | None = None
    belief: Path | None = None
    unit: str | None = None
    magnetometer: Sequence[str] = ()
    declination_deg: float = 0.0

    def from_anywhere(self) -> Options:
        """The same for a process that stands in another folder."""
        models = [str(Path(one).absolute()) if one.endswith(FILE) else one for one in self.compensation]
        return replace(self, compensation=models, belief=None if self.belief is None else self.belief.absolute())

    def evaluated(self, source: Path) -> Result[RecordingEvaluation | SolutionEvaluation]:
        """The evaluation of a recording."""
        recording = read(source, self.belief, self.unit, self.magnetometer, self.declination_deg)
        return evaluate(recording, self.compensation, self.restart_every_s)


def run(
    inputs: Sequence[Path],
    output: Path | None = None,
    export: Sequence[str] = (),
    json: Path | None = None,
    quiet: bool = False,
    workers: int | None = None,
    scheduler: str | None = None,
    **options: Any,
) -> int:
    """Evaluate a recording into `output` (by default ``reports/NAME``) and print its text.

    Several are written into ``output/NAME`` (by default ``reports/evaluation/NAME``), in parallel, and come on one page
    above them; a refused one is a row of it, and the exit code says that there was one. `options` are the fields of
    `Options`.
    """
    of = Options(**options)
    if len(inputs) == 1:
        where = Path("reports") / inputs[0].stem if output is None else output
        deliver(of.evaluated(inputs[0]), where, quiet, json, export)
        return 0
    where = Path("reports") / "evaluation" if output is None else output
    names = [source.stem for source in inputs]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise UsageError(f"evaluate: two recordings are called '{twice}', expected names that differ; rename a folder")
    seen = Path if scheduler is None else Path.absolute  # its workers stand in folders of their own
    asked = partial(_summary, of if scheduler is None else of.from_anywhere(), export)
    jobs = {name: (seen(source), seen(where / name)) for source, name in zip(inputs, names, strict=True)}
    found = {}
    with progress(len(jobs), "recordings", quiet) as bar:
        for name, one in parallel.results(asked, jobs, workers, scheduler):
            found[name] = one
            bar.update()
    kept = [found[name] for name in names]
    deliver(evaluate_several(kept), where, quiet, json, [form for form in export if form not in TRACKS])
    return DataRefused.exit_code if any(one.refused for one in kept) else 0


def _summary(options: Options, export: Sequence[str], source: Path, where: Path) -> Summary:
    """What is kept of one of several recordings, whose own report is written to `where`; runs in a worker."""
    try:
        one = options.evaluated(source)
        deliver(one, where, True, None, export)
    except StorageError:
        raise
    except InsEvalError as refused:
        return summary(where.name, refused)
    return summary(where.name, one.found)
