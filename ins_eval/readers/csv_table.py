"""Reader of any table in CSV; a small mapping file states what its columns are (`mapped`)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ins_eval.readers import mapped
from ins_eval.readers.delimited import DelimitedTable
from ins_eval.recording import Recording

KEYS = mapped.KEYS


def read(path: Path, assumed: Mapping[str, str]) -> Recording:
    """A recording from FILE.csv and its mapping."""
    return mapped.read(path, assumed, DelimitedTable)
