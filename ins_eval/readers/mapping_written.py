"""A mapping file with what was assumed beside it: the next import needs no ``--assume``."""

from __future__ import annotations

import os
from collections.abc import Mapping
from copy import deepcopy
from pathlib import Path
from typing import Any

from ins_eval.files import write_whole
from ins_eval.readers.assembly import PLACE
from ins_eval.readers.mapped import OTHERS
from ins_eval.readers.mapping import MappingFile
from ins_eval.readers.options import number
from ins_eval.recording.form.toml import dumps
from ins_eval.tables import parse, read_toml

# where a key of --assume stands in a mapping; those of the last line in each other navigator that has the group
PLACES = {key: tuple(key.split(".")) for key in ("kind", "axes", "gyro.unit", "accelerometer.unit")}
GROUPS = {
    "position.unit": ("position", "unit"), "height.unit": ("position", "height_unit"),
    "velocity.unit": ("velocity", "unit"), "velocity.axes": ("velocity", "axes"),
    "course.unit": ("velocity", "course_unit"), "attitude.unit": ("attitude", "unit"),
}  # fmt: skip
HEAD = "What the columns are, with what was assumed when they were imported: docs/formats.md."


def write_mapping(path: Path, source: Path, assumed: Mapping[str, str]) -> list[str]:
    """Write the mapping of `source` with what is `assumed` into `path`; the keys that no mapping has a place for.

    Raises UsageError, StorageError.
    """
    file = Path(assumed.get("mapping", source.with_suffix(".toml")))
    described, left = with_assumptions(read_toml(file), assumed)
    for table in _tables(described):
        if "file" in table:  # beside the mapping, which may lie elsewhere now
            table["file"] = os.path.relpath(file.parent / table["file"], path.parent)
    parse(MappingFile, described, str(path))
    write_whole(path, dumps(described, HEAD).encode())
    return left


def with_assumptions(mapping: Mapping[str, Any], assumed: Mapping[str, str]) -> tuple[dict[str, Any], list[str]]:
    """A mapping with what is assumed in the place of what it says, and the keys that it has no place for."""
    described, left = deepcopy(dict(mapping)), []
    for key, value in assumed.items():
        table, _, last = key.partition(".")
        if key in PLACES:
            _put(described, PLACES[key], value)
        elif key == "time.unit":
            _put(described if "time" in described else described["solution"], ("time", "unit"), value)
        elif last == "time_offset_s":
            _put(described, ("belief", table, last), number(assumed, key, 0.0))
        elif key in PLACE:
            described["start"] = {one: number(assumed, one, 0.0) for one in PLACE}
        elif key in GROUPS:
            for other in filter(None, map(described.get, OTHERS)):
                if GROUPS[key][0] in other:
                    _put(other, GROUPS[key], value)
        elif key != "mapping":
            left.append(key)
    return described, left


def _put(table: dict[str, Any], path: tuple[str, ...], value: object) -> None:
    for name in path[:-1]:
        table = table.setdefault(name, {})
    table[path[-1]] = value


def _tables(described: dict[str, Any]) -> list[dict[str, Any]]:
    """Every table that may name a file."""
    others = [one for name in OTHERS if (one := described.get(name))]
    times = [one["time"] for one in (described, *others) if "time" in one]
    return [*others, *times]
