"""Getting at the bytes and numbers of a file, with one sentence for each thing that can be wrong with it."""

from __future__ import annotations

import io
import zipfile
import zlib
from pathlib import Path

import numpy as np

from ins_eval.errors import DataRefused, StorageError, UsageError

LARGEST_BYTES = 4 * 1024**3  # of a packed file, unpacked
BYTES_A_STEP = 1 << 24
GZIP = b"\x1f\x8b"


def content(path: Path, expected: str) -> bytes:
    """The bytes of a file, unpacked if it is gzip; `expected` says what it should hold.

    Raises `UsageError` for a path that names no file, `StorageError` for one that cannot be read and `DataRefused`
    for an empty or broken one.
    """
    try:
        raw = path.read_bytes()
    except FileNotFoundError:
        raise UsageError(f"{path}: there is no such file, expected {expected}; check the name and the folder") from None
    except IsADirectoryError:
        raise UsageError(f"{path}: is a folder, expected {expected}; name the file in it") from None
    except (OSError, ValueError) as failure:  # ValueError: a zero byte in the path
        reason = getattr(failure, "strerror", None) or failure
        raise StorageError(f"{path}: cannot be read ({reason}); check its permissions") from None
    if raw.startswith(GZIP):
        raw = _unpacked(path, raw)
    if not raw.strip():
        raise DataRefused(f"{path}: is empty, expected {expected}; copy the file again")
    return raw


def _unpacked(path: Path, raw: bytes) -> bytes:
    parts, size = [], 0
    while raw.startswith(GZIP):
        unpacker = zlib.decompressobj(wbits=31)
        try:
            while not unpacker.eof:
                part = unpacker.decompress(raw, BYTES_A_STEP)
                raw = unpacker.unconsumed_tail
                size += len(part)
                if size > LARGEST_BYTES:
                    raise DataRefused(f"{path}: unpacks to more than {LARGEST_BYTES >> 30} GiB; give a smaller part")
                if not part and not raw and not unpacker.eof:
                    raise zlib.error("cut short")
                parts.append(part)
        except zlib.error as failure:
            raise DataRefused(f"{path}: cannot be unpacked ({failure}), expected gzip; copy the file again") from None
        raw = unpacker.unused_data
    return b"".join(parts)


def archive(path: Path, expected: str) -> dict[str, bytes]:
    """The files of a zip archive by their names without folder, unpacked in memory."""
    raw = content(path, expected)
    try:
        with zipfile.ZipFile(io.BytesIO(raw)) as packed:
            members = [member for member in packed.infolist() if not member.is_dir()]
            if sum(member.file_size for member in members) > LARGEST_BYTES:
                raise DataRefused(f"{path}: unpacks to more than {LARGEST_BYTES >> 30} GiB; give a smaller part")
            return {Path(member.filename).name: packed.read(member) for member in members}
    except DataRefused:
        raise
    except Exception:  # a damaged archive makes zipfile fail in many ways
        raise DataRefused(f"{path}: cannot be unpacked as zip, expected {expected}; copy the file again") from None


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
