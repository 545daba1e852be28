"""``ins-eval evaluate``: how good an instrument is, from its own recording."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

from ins_eval.analysis.several import summary
from ins_eval.errors import DataRefused, InsEvalError, StorageError, UsageError
from ins_eval.interface import evaluate, evaluate_several, read


def run(
    inputs: Sequence[Path],
    output: Path | None = None,
    compensation: Sequence[str] = (),
    belief: Path | None = None,
    restart_every_s: float | None = None,
    unit: str | None = None,
    magnetometer: Sequence[str] = (),
    declination_deg: float = 0.0,
    quiet: bool = False,
) -> int:
    """Evaluate a recording into `output` (by default ``reports/NAME``) and print its text.

    Several are written into ``output/NAME`` (by default ``reports/evaluation/NAME``) and come on one page above them;
    a refused one is a row of it, and the exit code says that there was one.
    """
    from_folder = partial(read, belief=belief, unit=unit, magnetometer=magnetometer, declination_deg=declination_deg)
    if len(inputs) == 1:
        where = Path("reports") / inputs[0].stem if output is None else output
        evaluate(from_folder(inputs[0]), compensation, restart_every_s).write(where, quiet)
        return 0
    where = Path("reports") / "evaluation" if output is None else output
    names = [source.stem for source in inputs]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise UsageError(f"evaluate: two recordings are called '{twice}', expected names that differ; rename a folder")
    kept = []
    for source, name in zip(inputs, names, strict=True):
        try:
            one = evaluate(from_folder(source), compensation, restart_every_s)
            one.write(where / name, quiet=True)
            kept.append(summary(name, one.found))
        except StorageError:
            raise
        except InsEvalError as refused:
            kept.append(summary(name, refused))
    evaluate_several(kept).write(where, quiet)
    return DataRefused.exit_code if any(one.refused for one in kept) else 0
