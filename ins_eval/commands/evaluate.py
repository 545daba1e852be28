"""``ins-eval evaluate``: how good an instrument is, from its own recording."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ins_eval.interface import evaluate, read


def run(
    inputs: Sequence[Path],
    output: Path | None = None,
    compensation: Sequence[str] = (),
    belief: Path | None = None,
    restart_every_s: float | None = None,
    unit: str | None = None,
    quiet: bool = False,
) -> int:
    """Evaluate each recording into ``output/NAME`` (by default ``reports/NAME``) and print its text."""
    for source in inputs:
        result = evaluate(read(source, belief, unit), compensation, restart_every_s)
        where = Path("reports") / source.stem if output is None else output
        result.write(where if len(inputs) == 1 else where / source.stem, quiet)
    return 0
