"""Numbers for another program: the option ``--json`` of every verb."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ins_eval.files import write_whole


def as_json(tree: Mapping[str, Any] | Sequence[Any]) -> bytes:
    """The same bytes for the same numbers: keys sorted, floats in full."""
    return (json.dumps(tree, sort_keys=True, indent=1, allow_nan=False) + "\n").encode()


def write_json(where: Path | None, tree: Mapping[str, Any]) -> None:
    """Write a tree as JSON into a file; ``-`` is standard output, None is nowhere."""
    if where is None:
        return
    if str(where) == "-":
        sys.stdout.write(as_json(tree).decode())
    else:
        write_whole(where, as_json(tree))
