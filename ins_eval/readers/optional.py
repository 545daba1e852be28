"""Libraries that only some formats need."""

from __future__ import annotations

import importlib
from types import ModuleType

from ins_eval.errors import UsageError


def library(name: str, what: str) -> ModuleType:
    """The module of that name, which `what` needs.

    Raises `UsageError` where it is not installed.
    """
    try:
        return importlib.import_module(name)
    except ImportError:
        raise UsageError(
            f"{what}: needs the library {name.partition('.')[0]}, which is not here; pip install 'ins-eval[formats]'"
        ) from None
