"""Variables of a MATLAB version 5 file: real numeric arrays, cells of text, and fields of structures.

    file      header (128 bytes, the last four: version and byte order), then elements
    element   type and size (8 bytes, or 2 + 2 with up to 4 bytes of data behind), data, padded to 8 bytes
    matrix    an element of elements: flags, dimensions, name, data

Every size is checked before it is believed, so that a damaged file is refused: other readers of the format follow
such sizes out of the file. Source: MathWorks, MAT-File Format, level 5.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Collection, Iterator
from pathlib import Path

import numpy as np

from ins_eval.boundary import ZLIB_WINDOW, content, inflated
from ins_eval.errors import DataRefused

HEADER_BYTES = 128
MATRIX, COMPRESSED = 14, 15
NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}  # by type
TEXT = {1: "latin-1", 2: "latin-1", 4: "utf-16", 16: "utf-8", 17: "utf-16"}
CELL, STRUCTURE, CHARACTERS, NUMERIC = 1, 2, 4, range(6, 16)  # classes of a matrix
COMPLEX = 0x800
DEEPEST = 3  # cells within cells
DEEPEST_STRUCTURE = 8
MOST_FIELDS = 10_000


def variables(path: Path, names: Collection[str], expected: str) -> dict[str, np.ndarray]:
    """The named variables, those that the file has: arrays of numbers, and cells as arrays of str.

    Raises `UsageError`, `StorageError` and `DataRefused` as `files.content`, and `DataRefused` for what is damaged or
    no file of this format.
    """
    found: dict[str, np.ndarray] = {}
    _visit(path, expected, lambda data, order: _add_matrix(found, data, order, names))
    return found


def all_variables(path: Path, expected: str) -> dict[str, np.ndarray]:
    """Every array of numbers by its name, a field of a structure as ``structure.field``.

    Element k of an array of structures is ``structure(k)``. Raises as `variables`.
    """
    found: dict[str, np.ndarray] = {}
    _visit(path, expected, lambda data, order: _add_fields(found, "", data, order, 0))
    return found


def _visit(path: Path, expected: str, take: Callable[[memoryview, str], None]) -> None:
    """Give each matrix of a file to `take`."""
    raw = content(path, expected)
    if raw.startswith(b"MATLAB 7.3"):
        raise DataRefused(f"{path}: is a MATLAB 7.3 file, expected version 5; save it in MATLAB with save(..., '-v7')")
    order = {b"IM": "<", b"MI": ">"}.get(raw[HEADER_BYTES - 2 : HEADER_BYTES])
    unpacked = 0
    try:
        if order is None:
            raise ValueError("no mark of the byte order")
        for kind, data in _elements(memoryview(raw)[HEADER_BYTES:], order):
            if kind == COMPRESSED:
                data = memoryview(inflated(path, data, ZLIB_WINDOW, unpacked, len(raw))[0])
                unpacked += len(data)
                kind, data = next(_elements(data, order))
            if kind == MATRIX:
                take(data, order)
    except (ValueError, struct.error, zlib.error, StopIteration):  # ValueError: also text that cannot be decoded
        raise DataRefused(
            f"{path}: cannot be read as a MATLAB version 5 file, expected {expected}; copy the file again"
        ) from None


def _add_matrix(found: dict[str, np.ndarray], data: memoryview, order: str, names: Collection[str]) -> None:
    name, value = _matrix(data, order, names)
    if value is not None:
        found[name] = value


def _add_fields(found: dict[str, np.ndarray], prefix: str, data: memoryview, order: str, depth: int) -> None:
    """Add a matrix of numbers, or the fields of a structure; `prefix` is its name, if it has none of its own."""
    parts = _elements(data, order)
    matrix_class = int(_numbers(*next(parts), order)[0]) & 0xFF
    if matrix_class in NUMERIC:
        name, value = _matrix(data, order, None)
        if value is not None and (prefix or name):
            found[prefix or name] = value
        if len(found) > MOST_FIELDS:
            raise ValueError("too many variables")
    if matrix_class != STRUCTURE or depth == DEEPEST_STRUCTURE:
        return
    shape = _numbers(*next(parts), order)
    name = prefix or bytes(next(parts)[1]).decode("latin-1")
    if prefix:
        next(parts)  # a field has no name of its own
    longest = int(_numbers(*next(parts), order)[0])
    text = bytes(next(parts)[1])
    if not 0 < longest <= 256 or shape.min() < 0:
        raise ValueError("names of fields without length")
    fields = [text[k : k + longest].split(b"\0")[0].decode("latin-1") for k in range(0, len(text), longest)]
    count = int(np.prod(shape, dtype=float))
    if count * len(fields) > len(data):
        raise ValueError("more fields than data")
    for k in range(count):
        element = name if count == 1 else f"{name}({k + 1})"
        for field in fields:
            kind, inner = next(parts)
            if kind == MATRIX and len(inner):
                _add_fields(found, f"{element}.{field}", inner, order, depth + 1)


def _elements(data: memoryview, order: str) -> Iterator[tuple[int, memoryview]]:
    """Type and data of each element."""
    at = 0
    while at + 8 <= len(data):
        first, size = struct.unpack_from(f"{order}II", data, at)
        begin, step = at + 8, 8
        if first >> 16:  # a short one
            first, size, begin = first & 0xFFFF, first >> 16, at + 4
            if size > 4:
                raise ValueError("short element of more than 4 bytes")
        else:
            step += size if first == COMPRESSED else -(-size // 8) * 8
        if begin + size > len(data):
            raise ValueError("element beyond the end")
        yield first, data[begin : begin + size]
        at += step


def _matrix(data: memoryview, order: str, names: Collection[str] | None, depth: int = 0):
    """Name and value of a matrix; the value is None for one that is not wanted or of another class."""
    parts = _elements(data, order)
    flags = int(_numbers(*next(parts), order)[0])
    shape = tuple(int(size) for size in _numbers(*next(parts), order))
    name = bytes(next(parts)[1]).decode("latin-1")
    if names is not None and name not in names:
        return name, None
    count = 1
    for size in shape:
        count *= size
    if len(shape) < 2 or min(shape) < 0 or count > len(data):
        raise ValueError("dimensions that the data do not have")
    matrix_class = flags & 0xFF
    if matrix_class == CHARACTERS:
        kind, text = next(parts)
        if kind not in TEXT:
            raise ValueError("text of an unknown type")
        wide = "-le" if order == "<" else "-be"
        return name, np.array(bytes(text).decode(TEXT[kind] + (wide if TEXT[kind] == "utf-16" else "")), dtype=object)
    if matrix_class == CELL:
        if depth == DEEPEST:
            raise ValueError("cells too deep")
        values = np.empty(count, dtype=object)
        for k in range(count):
            kind, inner = next(parts)
            value = _matrix(inner, order, None, depth + 1)[1] if kind == MATRIX and len(inner) else None
            values[k] = value.item() if value is not None and value.size == 1 else value
        return name, values.reshape(shape, order="F")
    if matrix_class in NUMERIC and not flags & COMPLEX:
        return name, _numbers(*next(parts), order).reshape(shape, order="F")
    return name, None


def _numbers(kind: int, data: memoryview, order: str) -> np.ndarray:
    if kind not in NUMBERS:
        raise ValueError("numbers of an unknown type")
    values = np.frombuffer(data, dtype=order + NUMBERS[kind])
    if not values.size:
        return np.zeros(0)
    return values.astype(values.dtype.newbyteorder("="))
