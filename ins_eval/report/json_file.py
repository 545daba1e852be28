"""Numbers for another program: the option ``--json`` of every verb."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ins_eval.files import write_whole
from ins_eval.report.results import as_json


def write_json(where: Path | None, tree: Mapping[str, Any]) -> None:
    """Write a tree as JSON into a file; ``-`` is standard output, None is nowhere."""
    if where is None:
        return
    if str(where) == "-":
        sys.stdout.write(as_json(tree).decode())
    else:
        write_whole(where, as_json(tree))
