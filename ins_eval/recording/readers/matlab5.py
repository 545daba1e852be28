"""Variables of a MATLAB version 5 file: real numeric arrays, and cells of text.

    file      header (128 bytes, the last four: version and byte order), then elements
    element   type and size (8 bytes, or 2 + 2 with up to 4 bytes of data behind), data, padded to 8 bytes
    matrix    an element of elements: flags, dimensions, name, data

Every size is checked before it is believed, so that a damaged file is refused: other readers of the format follow
such sizes out of the file. Source: MathWorks, MAT-File Format, level 5.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Collection, Iterator
from pathlib import Path

import numpy as np

from ins_eval.errors import DataRefused
from ins_eval.recording.readers.files import LARGEST_BYTES, content

HEADER_BYTES = 128
MATRIX, COMPRESSED = 14, 15
NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}  # by type
TEXT = {1: "latin-1", 2: "latin-1", 4: "utf-16", 16: "utf-8", 17: "utf-16"}
CELL, CHARACTERS, NUMERIC = 1, 4, range(6, 16)  # classes of a matrix
COMPLEX = 0x800
DEEPEST = 3  # cells within cells


def variables(path: Path, names: Collection[str], expected: str) -> dict[str, np.ndarray]:
    """The named variables, those that the file has: arrays of numbers, and cells as arrays of str.

    Raises `UsageError`, `StorageError` and `DataRefused` as `files.content`, and `DataRefused` for what is damaged or
    no file of this format.
    """
    raw = content(path, expected)
    if raw.startswith(b"MATLAB 7.3"):
        raise DataRefused(f"{path}: is a MATLAB 7.3 file, expected version 5; save it in MATLAB with save(..., '-v7')")
    order = {b"IM": "<", b"MI": ">"}.get(raw[HEADER_BYTES - 2 : HEADER_BYTES])
    found: dict[str, np.ndarray] = {}
    try:
        if order is None:
            raise ValueError("no mark of the byte order")
        for kind, data in _elements(memoryview(raw)[HEADER_BYTES:], order):
            if kind == COMPRESSED:
                kind, data = next(_elements(_unpacked(data), order))
            if kind == MATRIX:
                name, value = _matrix(data, order, names)
                if value is not None:
                    found[name] = value
    except (ValueError, struct.error, zlib.error, StopIteration):  # ValueError: also text that cannot be decoded
        raise DataRefused(
            f"{path}: cannot be read as a MATLAB version 5 file, expected {expected}; copy the file again"
        ) from None
    return found


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


def _unpacked(data: memoryview) -> memoryview:
    unpacker = zlib.decompressobj()
    raw = unpacker.decompress(data, LARGEST_BYTES)
    if not unpacker.eof:
        raise ValueError("cut short or too large")
    return memoryview(raw)


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
