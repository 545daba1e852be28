"""Getting at the numbers of a file, with one sentence for each thing that can be wrong with it."""

from __future__ import annotations

import numpy as np

from ins_eval.errors import DataRefused


def numbers(where: str, value: np.ndarray, columns: int, expected: str) -> np.ndarray:
    """`value` as an array (n, >= columns) of floats."""
    if value.ndim != 2 or value.shape[1] < columns or value.dtype.kind not in "iuf":
        raise DataRefused(
            f"{where}: has shape {value.shape} of {value.dtype}, expected rows of {columns} numbers: {expected}; "
            "check that this is the format named"
        )
    return value.astype(float)


def text_numbers(where: str, raw: bytes, columns: int, expected: str) -> np.ndarray:
    """Rows of exactly `columns` numbers apart by white space, (n, columns); `%` begins a comment."""
    fields: list[bytes] = []
    lines = raw.splitlines()
    for number, line in enumerate(lines, start=1):
        row = line.partition(b"%")[0].split()
        if not row:
            continue
        if len(row) != columns:
            hint = "the last line seems cut short, delete it" if number == len(lines) else "correct that line"
            raise DataRefused(f"{where}, line {number}: {len(row)} columns, expected {columns} ({expected}); {hint}")
        fields += row
    try:
        return np.array(fields, dtype=float).reshape(-1, columns)
    except ValueError:
        raise _not_a_number(where, lines, expected) from None


def _not_a_number(where: str, lines: list[bytes], expected: str) -> DataRefused:
    for number, line in enumerate(lines, start=1):
        for column, field in enumerate(line.partition(b"%")[0].split(), start=1):
            try:
                float(field)
            except ValueError:
                return DataRefused(
                    f"{where}, line {number}, column {column}: {shown(field)}, expected a number ({expected}); "
                    "correct that line or export the recording again"
                )
    return DataRefused(f"{where}: holds a value that is no number, expected {expected}; export the recording again")


def shown(field: bytes | str) -> str:
    """A field as it can be printed in a sentence: quoted, in ASCII, at most 20 characters."""
    if isinstance(field, bytes):
        field = field.decode("ascii", errors="backslashreplace")
    text = field if field.isprintable() and field.isascii() else ascii(field)[1:-1]
    return f"'{text}'" if len(text) <= 20 else f"'{text[:20]}...'"
