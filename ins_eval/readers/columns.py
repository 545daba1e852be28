"""A file as named columns of numbers, whatever its format; a column asked for by another name is refused."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Protocol

import numpy as np

from ins_eval.errors import DataRefused, UsageError, did_you_mean

Column = str | int
DATE, DAY_FIRST, MONTH_FIRST = "date", "date day first", "date month first"  # units of a time in text


class Columns(Protocol):
    """What a mapping is read from."""

    path: Path
    first_row: int  # number of the first row as a line of the file, for messages
    notes: tuple[str, ...]
    units: Mapping[str, str]  # of columns, where the source states them

    def names(self) -> list[str]: ...

    def numbers(self, column: Column, where: str) -> np.ndarray: ...

    def dates_s(self, column: Column, where: str, unit: str = DATE) -> np.ndarray: ...


def is_number(field: str | bytes) -> bool:
    """Whether a field of text is a number, as Python writes one."""
    try:
        float(field)
    except ValueError:
        return False
    return True


def vectors(source: Columns, columns: Iterable[Column], where: str) -> np.ndarray:
    """Columns side by side, (n, columns); refused where their lengths differ."""
    columns = list(columns)
    found = [source.numbers(column, where) for column in columns]
    same_length(source.path, where, dict(zip(map(str, columns), found, strict=True)))
    return np.column_stack(found)


def same_length(path: Path, where: str, found: Mapping[str, np.ndarray]) -> None:
    """Raise `DataRefused` unless all have as many rows."""
    first, *others = found
    for name in others:
        if len(found[name]) != len(found[first]):
            raise DataRefused(
                f"{path}: {name} has {len(found[name])} rows and {first} {len(found[first])}, expected as many in "
                f"{where}; map columns of one table, or give the group a time of its own"
            )


class NamedArrays:
    """Arrays (n,) by name, as read from a file that holds variables."""

    first_row = 1

    def __init__(self, path: Path, arrays: Mapping[str, np.ndarray], notes: tuple[str, ...] = ()):
        self.path, self.arrays, self.notes = path, arrays, notes
        self.units: Mapping[str, str] = {}

    def names(self) -> list[str]:
        return list(self.arrays)

    def numbers(self, column: Column, where: str) -> np.ndarray:
        """One column as floats."""
        name = str(column)
        if name not in self.arrays:
            raise UsageError(
                f"{where}: there is no column '{name}' in {self.path.name}{did_you_mean(name, self.arrays)}"
            )
        return np.array(self.arrays[name], dtype=float)

    def dates_s(self, column: Column, where: str, unit: str = DATE) -> np.ndarray:
        raise UsageError(
            f"{where}: '{column}' of {self.path.name} is numbers, expected dates in text; name its unit instead, such "
            'as unit = "s"'
        )


def of_variables(variables: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Columns of variables: a vector is one by its name, column k of a matrix is ``name[k]``, counted from 1."""
    columns = {}
    for name, value in variables.items():
        if value.ndim == 0 or value.dtype.kind not in "iufb":
            continue
        if value.ndim == 1 or (value.ndim == 2 and 1 in value.shape):
            columns[name] = value.ravel()
        elif value.ndim == 2:
            rows = value if value.shape[0] >= value.shape[1] else value.T
            columns |= {f"{name}[{k}]": column for k, column in enumerate(rows.T, start=1)}
    return {name: values for name, values in columns.items() if len(values) > 1}
