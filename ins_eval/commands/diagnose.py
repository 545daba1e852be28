"""``ins-eval diagnose``: where a recording leaves what is believed of it."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from tqdm import tqdm

from ins_eval.analysis.diagnose import STEPS
from ins_eval.files import write_whole
from ins_eval.interface.diagnose import diagnose
from ins_eval.report.results import as_json


def run(
    recordings: Sequence[Path],
    belief: Path | None = None,
    json: Path | None = None,
    report: Path | None = None,
    write_model: Path | None = None,
    unit: str | None = None,
    quiet: bool = False,
) -> int:
    """Diagnose recordings of one instrument together; the answer as text, as JSON and as a page where wanted."""
    with tqdm(total=len(recordings) + STEPS, desc="diagnosis", file=sys.stderr, disable=quiet) as bar:

        def step(words: str) -> None:
            bar.set_postfix_str(words)
            bar.update()

        result = diagnose(recordings, belief, write_model, step, unit)
    if json is not None:
        write_whole(json, as_json(result.found.answer))
    if report is not None:
        result.write(report, quiet)
    elif not quiet:
        print(result)
    return 0
