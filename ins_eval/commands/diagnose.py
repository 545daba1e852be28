"""``ins-eval diagnose``: where a recording leaves what is believed of it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ins_eval.analysis.diagnose import STEPS
from ins_eval.commands.delivery import deliver
from ins_eval.errors import UsageError
from ins_eval.interface.diagnose import diagnose
from ins_eval.progress import progress
from ins_eval.report.json_file import write_json


def run(
    recordings: Sequence[Path],
    belief: Path | None = None,
    output: Path | None = None,
    model_file: Path | None = None,
    unit: str | None = None,
    export: Sequence[str] = (),
    json: Path | None = None,
    quiet: bool = False,
) -> int:
    """Diagnose recordings of one instrument together; the answer as text, as JSON and as a page where wanted."""
    if export and output is None:
        raise UsageError("diagnose: --export writes below the report; name its folder with -o DIR")
    with progress(len(recordings) + STEPS, "diagnosis", quiet) as bar:

        def step(words: str) -> None:
            bar.set_postfix_str(words)
            bar.update()

        result = diagnose(recordings, belief, model_file, step, unit)
    write_json(json, result.found.answer)
    if output is not None:
        deliver(result, output, quiet, None, export)
    elif not quiet:
        print(result)
    return 0
