"""The tree of JSON that a frozen result becomes in a file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass
from math import isfinite
from typing import Any

import numpy as np


def as_tree(found: Any) -> Any:
    """A result as dicts, lists and plain numbers, for ``metrics.json``.

    A dataclass or named tuple is a dict of its fields; a field of the former that has a default is left out where it
    holds nothing (None, empty). What has an `as_tree` of its own is that. A number that is not finite is None.
    """
    if hasattr(found, "as_tree"):
        return found.as_tree()
    if is_dataclass(found):
        values = ((field, getattr(found, field.name)) for field in fields(found))
        return {field.name: as_tree(value) for field, value in values if not (_optional(field) and _empty(value))}
    if isinstance(found, tuple) and hasattr(found, "_asdict"):
        found = found._asdict()
    if isinstance(found, Mapping):
        return {key: as_tree(value) for key, value in found.items()}
    if isinstance(found, np.ndarray | np.generic):
        return as_tree(found.tolist())
    if isinstance(found, list | tuple):
        return [as_tree(one) for one in found]
    return None if isinstance(found, float) and not isfinite(found) else found


def _optional(field: Any) -> bool:
    return field.default is not MISSING or field.default_factory is not MISSING


def _empty(value: Any) -> bool:
    return value is None or (isinstance(value, Mapping | list | tuple) and not value)
