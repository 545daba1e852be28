"""Tables that a user writes in TOML: reading them, and saying in one sentence what is wrong with one."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError, ValidationInfo, field_validator

from ins_eval.boundary import text
from ins_eval.errors import UsageError, did_you_mean
from ins_eval.limits import allowed
from ins_eval.printable import LONGEST_VALUE, printable, shortened, shown

LONGEST_NAME = 200  # characters: file names end at 255 bytes on the usual disks

T = TypeVar("T", bound=BaseModel)


class Strict(BaseModel):
    """A table that refuses what it does not know, a number beyond the limits of its unit, and endless texts."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, defer_build=True)

    @field_validator("*")
    @classmethod
    def _within_limits(cls, value: Any, info: ValidationInfo) -> Any:
        allowed(str(info.field_name), value)
        return value


def pick(tree: Any, *keys: str) -> Any:
    """What stands below the keys of nested mappings, or None where one of them is missing."""
    for key in keys:
        if not isinstance(tree, Mapping) or key not in tree:
            return None
        tree = tree[key]
    return tree


def read_extending(path: Path, find: Callable[[str], Path], seen: tuple[Path, ...] = ()) -> dict[str, Any]:
    """The tables of a file laid over those of the file that its key ``extends`` names, if any.

    The base is the file of that name in the same folder, or else what `find` gives. Tables are merged, lists replaced.
    """
    table = read_toml(path)
    base_name = table.pop("extends", None)
    if base_name is None:
        return table
    if path in seen:
        raise UsageError(f"{path}: 'extends' leads back to itself; break the circle")
    if not isinstance(base_name, str) or len(base_name) > LONGEST_NAME:
        raise UsageError(
            f"{path}: 'extends' is {shown(base_name)}, expected a name of at most {LONGEST_NAME} characters in quotes; "
            "name the file that this one goes on from, without .toml"
        )
    sibling = path.parent / f"{base_name}.toml"
    base = read_extending(sibling if sibling.is_file() and sibling != path else find(base_name), find, (*seen, path))
    for key, value in table.items():
        base[key] = {**base[key], **value} if isinstance(value, dict) and isinstance(base.get(key), dict) else value
    return base


def read_toml(path: Path) -> dict[str, Any]:
    """The tables of a TOML file; a file that is not TOML is refused with its line."""
    try:
        return tomllib.loads(text(path, "a .toml file"))
    except (ValueError, RecursionError) as error:  # not TOML, not UTF-8, a number of thousands of digits, deep nesting
        raise UsageError(f"{path}: not valid TOML ({error}); correct that place") from None


def parse(model: type[T], table: dict[str, Any], where: str) -> T:
    """Validate `table` as `model`; the first fault becomes one sentence that starts with `where`."""
    try:
        return model.model_validate(table)
    except ValidationError as error:
        # an unknown key first: where one is misspelt, the right one is missing, too
        faults = sorted(error.errors(), key=lambda fault: fault["type"] != "extra_forbidden")
        raise UsageError(f"{where}: {_sentence(model, faults[0])}") from None


def _sentence(model: type[BaseModel], fault: Mapping[str, Any]) -> str:
    parts = (f"[{p}]" if isinstance(p, int) else f".{shortened(p, LONGEST_VALUE)}" for p in fault["loc"])
    key = printable("".join(parts).lstrip("."))
    if fault["type"] == "extra_forbidden":
        return f"unknown key '{key}'{did_you_mean(str(fault['loc'][-1]), _fields_at(model, fault['loc'][:-1]))}"
    if fault["type"] == "missing":
        return f"'{key}' is missing; add it"
    message = fault["msg"].removeprefix("Value error, ")
    if fault["type"] == "value_error":
        return f"{key}: {message}" if key else message
    return f"'{key}' is {shown(fault['input'])}: {message[0].lower()}{message[1:]}; mind the unit in the key's name"


def _fields_at(model: type[BaseModel], location: tuple[Any, ...]) -> list[str]:
    """Names of the fields of the table that `location` leads to, through lists and optional tables."""
    current: Any = model
    for step in location:
        if isinstance(step, int):
            continue
        annotation = current.model_fields[step].annotation
        current = next(a for a in _models_in(annotation))
    return list(current.model_fields)


def _models_in(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [m for a in getattr(annotation, "__args__", ()) for m in _models_in(a)]
