"""A result goes where it was asked for: page, numbers, tables, terminal."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ins_eval.interface.result import Result
from ins_eval.report.json_file import write_json

DATA = "data"  # folder of what is exported, below that of the report


def deliver(result: Result, output: Path, quiet: bool, json: Path | None, export: Sequence[str]) -> None:
    """Write the report into `output`, its tables below it and its numbers into `json`; print its text."""
    if export:
        result.export(output / DATA, *export)
    result.write(output, quiet)
    write_json(json, result.metrics)
