"""The one way for bytes from outside: regular files only, of limited size on disk and unpacked.

Every reader takes its bytes from `file_bytes` or `content`. Raised are `UsageError` for a path that names no regular
file, `StorageError` for one that cannot be read and `DataRefused` for what is too large, empty or broken.
"""

from __future__ import annotations

import io
import stat
import zipfile
import zlib
from pathlib import Path

from ins_eval.errors import DataRefused, StorageError, UsageError

GIB = 1 << 30
# bytes of a file, packed or not, and of all that comes out of it: 24 h at 200 Hz as text of 100 characters are 1.6 GiB
LARGEST_BYTES = 2 * GIB
# of a deflated file what it may unpack to, whatever its size, and otherwise how many times its size; text of a sensor
# unpacks to five times, a column of one value to a thousand times
UNSUSPECTED_BYTES, LARGEST_RATIO = 1 << 28, 100
LARGEST_TEXT_BYTES = 2 << 20  # of a file that a person writes: TOML, Python; the largest shipped one has 30 kB
BYTES_A_STEP = 1 << 24
GZIP = b"\x1f\x8b"
GZIP_WINDOW, ZLIB_WINDOW = 31, 15  # zlib's `wbits`
KINDS = {stat.S_IFIFO: "a pipe", stat.S_IFCHR: "a device", stat.S_IFBLK: "a device", stat.S_IFSOCK: "a socket"}


def check_regular(path: Path, expected: str) -> int:
    """The size in bytes of what `path` names; nothing but a regular file can be read to its end and read again."""
    try:
        found = path.stat()
    except FileNotFoundError:
        raise UsageError(f"{path}: there is no such file, expected {expected}; check the name and the folder") from None
    except (OSError, ValueError) as failure:  # ValueError: a zero byte in the path
        raise _unreadable(path, failure) from None
    if stat.S_ISDIR(found.st_mode):
        raise UsageError(f"{path}: is a folder, expected {expected}; name the file in it")
    if not stat.S_ISREG(found.st_mode):
        kind = KINDS.get(stat.S_IFMT(found.st_mode), "no file")
        raise UsageError(f"{path}: is {kind}, expected {expected}; save what it delivers as a file and name that")
    return found.st_size


def file_bytes(path: Path, expected: str, most: int = LARGEST_BYTES) -> bytes:
    """The bytes of a regular file as they are; `expected` says what it should hold."""
    size = check_regular(path, expected)
    try:
        with open(path, "rb") as file:
            raw = file.read(most + 1) if size <= most else b""
    except OSError as failure:
        raise _unreadable(path, failure) from None
    if size > most or len(raw) > most:  # one that grows meanwhile, too
        raise DataRefused(
            f"{path}: is larger than {_size(most)}, expected {expected}, of at most that; give a smaller part"
        )
    return raw


def content(path: Path, expected: str) -> bytes:
    """The bytes of a file that holds something, unpacked if it is gzip."""
    raw = file_bytes(path, expected)
    if raw.startswith(GZIP):
        raw = _gunzipped(path, raw)
    if not raw.strip():
        raise DataRefused(f"{path}: is empty, expected {expected}; copy the file again")
    return raw


def text(path: Path, expected: str) -> str:
    """The text of a file that a person writes. Raises ValueError where it is not UTF-8."""
    return file_bytes(path, expected, LARGEST_TEXT_BYTES).decode("utf-8")


def archive(path: Path, expected: str) -> dict[str, bytes]:
    """The files of a zip archive by their names without folder, unpacked in memory."""
    raw = content(path, expected)
    try:
        with zipfile.ZipFile(io.BytesIO(raw)) as packed:
            members = [member for member in packed.infolist() if not member.is_dir()]
            check_unpacked(path, sum(member.file_size for member in members), len(raw))
            return {Path(member.filename).name: packed.read(member) for member in members}
    except (DataRefused, MemoryError):
        raise
    except Exception:  # a damaged archive makes zipfile fail in many ways
        raise DataRefused(f"{path}: cannot be unpacked as zip, expected {expected}; copy the file again") from None


def check_unpacked(path: Path, size: float, packed: int = LARGEST_BYTES) -> None:
    """Refuse what would unpack to too much; `size` of all that comes out of the file and its own `packed`, in bytes."""
    most = min(LARGEST_BYTES, max(UNSUSPECTED_BYTES, LARGEST_RATIO * packed))
    if size > most:
        raise DataRefused(f"{path}: unpacks to more than {_size(most)}; give a smaller part")


def inflated(path: Path, stream: bytes | memoryview, window: int, before: int, packed: int) -> tuple[bytes, bytes]:
    """One deflated stream unpacked, and what follows it.

    `before`: bytes that the file unpacked to already; `packed`: those of the whole file. Raises zlib.error for a
    damaged stream.
    """
    unpacker = zlib.decompressobj(wbits=window)
    parts, size, rest = [], before, bytes(stream)
    while not unpacker.eof:
        part = unpacker.decompress(rest, BYTES_A_STEP)
        rest = unpacker.unconsumed_tail
        size += len(part)
        check_unpacked(path, size, packed)
        if not part and not rest and not unpacker.eof:
            raise zlib.error("cut short")
        parts.append(part)
    return b"".join(parts), unpacker.unused_data


def _gunzipped(path: Path, raw: bytes) -> bytes:
    parts: list[bytes] = []
    packed = len(raw)
    try:
        while raw.startswith(GZIP):  # a file may hold several streams
            part, raw = inflated(path, raw, GZIP_WINDOW, sum(map(len, parts)), packed)
            parts.append(part)
    except zlib.error as failure:
        raise DataRefused(f"{path}: cannot be unpacked ({failure}), expected gzip; copy the file again") from None
    return b"".join(parts)


def _unreadable(path: Path, failure: Exception) -> StorageError:
    reason = getattr(failure, "strerror", None) or failure
    return StorageError(f"{path}: cannot be read ({reason}); check its name and permissions")


def _size(count: int) -> str:
    return f"{count / GIB:g} GiB" if count >= GIB else f"{count / (1 << 20):g} MiB"
