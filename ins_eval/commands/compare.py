"""``ins-eval compare``: the recorded IMU against the one that a reference trajectory implies, channel by channel."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ins_eval.commands.delivery import deliver
from ins_eval.interface.compare import compare
from ins_eval.interface.read import read


def run(
    recording_folder: Path,
    output: Path | None,
    quiet: bool,
    use_found_offset: bool = False,
    unit: str | None = None,
    json: Path | None = None,
    export: Sequence[str] = (),
) -> int:
    """Read a recording, compare it with its reference, write the report into `output` and print its text.

    `output` None: reports/NAME-compare. With `use_found_offset` the clock offset that the gyros show is used instead of
    the believed one.
    """
    output = output or Path("reports") / f"{recording_folder.name}-compare"
    deliver(compare(read(recording_folder, unit=unit), use_found_offset), output, quiet, json, export)
    return 0
