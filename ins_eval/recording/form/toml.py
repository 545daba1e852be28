"""TOML that a person can read: floats to the last digit, one line a key, small tables on one line."""

from __future__ import annotations

import datetime
import json
import re
from collections.abc import Mapping
from typing import Any

import numpy as np

_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_LONG_LINE = 110
_INLINE_DEPTH = 2  # a table below [a.b] stands on one line
_Dated = datetime.date | datetime.time


def dumps(table: Mapping[str, Any], head: str = "") -> str:
    """The text of a TOML file; a None is left out, and `head` becomes the comment at the top.

    `tomllib.loads` gives back the same table, every float to the last bit.
    """
    comment = [f"# {line}".rstrip() for line in head.splitlines()]
    return "\n".join(comment + [""] * bool(comment) + _lines(table, ())).strip("\n") + "\n"


def _lines(table: Mapping[str, Any], path: tuple[str, ...]) -> list[str]:
    given = {str(key): value for key, value in table.items() if value is not None}
    below = {key: value for key, value in given.items() if isinstance(value, Mapping) and len(path) < _INLINE_DEPTH}
    lines = [f"{_key(key)} = {_value(value)}" for key, value in given.items() if key not in below]
    if path and (lines or not below):
        lines = ["", f"[{'.'.join(_key(key) for key in path)}]", *lines]
    for key, value in below.items():
        lines += _lines(value, (*path, key))
    return lines


def _value(value: Any) -> str:
    """One value as TOML has it."""
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    if isinstance(value, int | np.integer):
        return str(int(value))
    if isinstance(value, float | np.floating):
        return repr(float(value))
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, _Dated):
        return value.isoformat()
    if isinstance(value, Mapping):
        parts = [f"{_key(str(key))} = {_value(of_key)}" for key, of_key in value.items() if of_key is not None]
        return f"{{ {', '.join(parts)} }}" if parts else "{}"
    return _array([_value(item) for item in value])


def _array(items: list[str]) -> str:
    line = f"[{', '.join(items)}]"
    if len(line) <= _LONG_LINE:
        return line
    return "[\n" + "".join(f"    {item},\n" for item in items) + "]"


def _key(key: str) -> str:
    return key if _BARE_KEY.fullmatch(key) else _text(key)


def _text(text: str) -> str:
    """A basic string; JSON's escapes are TOML's, but for the delete character and halves of surrogate pairs."""
    sound = text.encode("utf-8", errors="replace").decode("utf-8")
    return json.dumps(sound, ensure_ascii=False).replace("\x7f", "\\u007f")
