"""``ins-eval results``: results of runs side by side, and whether one is worse than is allowed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ins_eval.analysis.results import regression
from ins_eval.commands.delivery import deliver
from ins_eval.errors import GateNotMet
from ins_eval.interface.results import results


def run(
    folders: Sequence[Path],
    output: Path,
    fail_if: Sequence[str] = (),
    export: Sequence[str] = (),
    json: Path | None = None,
    quiet: bool = False,
) -> int:
    """Hold each later run against the first, write the page into `output` and print its text.

    Raises: GateNotMet where one of the limits `fail_if` (``KEY+P%``, ``KEY.value+P%``) is passed.
    """
    found = results(folders)
    worse = [words for limit in fail_if if (words := regression(found.found, limit))]
    deliver(found, output, quiet, json, export)
    if worse:
        raise GateNotMet(f"results: {worse[0]}")
    return 0
