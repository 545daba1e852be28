"""Writing files so that a reader never meets half of one, whatever ends the program meanwhile."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO

from ins_eval.errors import StorageError


def write_whole(path: Path, content: bytes | Callable[[BinaryIO], object]) -> Path:
    """Write `content`, bytes or a function that writes them, aside; sync it; then put it in place of `path`.

    Raises StorageError for a full disk or a folder that cannot be written; what stood at `path` then still stands.
    """
    write_together({path: content})
    return path


def write_together(contents: Mapping[Path, bytes | Callable[[BinaryIO], object]], gone: Iterable[Path] = ()) -> None:
    """Write files that belong together: all aside first, then those `gone` are removed and each is put in its place.

    So the time in which files of two results could stand beside each other is that of renaming. Raises as
    `write_whole`; where one cannot be written, all that stood there still stand.
    """
    parts: dict[Path, Path] = {}
    at = Path()
    try:
        for at, content in contents.items():
            parts[at] = at.with_name(f"{at.name}.{os.getpid()}.part")
            _write(at, parts[at], content)
        for at in gone:
            at.unlink(missing_ok=True)
        for at, part in parts.items():
            os.replace(part, at)
    except OSError as error:
        for part in parts.values():
            with suppress(OSError):
                part.unlink(missing_ok=True)
        raise cannot_write(at, error) from None


def _write(path: Path, part: Path, content: bytes | Callable[[BinaryIO], object]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    for leftover in path.parent.glob(f"{path.name}.*.part"):
        if not _alive(leftover.suffixes[-2].removeprefix(".")):
            leftover.unlink(missing_ok=True)
    with open(part, "wb") as file:
        content(file) if callable(content) else file.write(content)
        file.flush()
        os.fsync(file.fileno())


def cannot_write(path: Path, error: OSError) -> StorageError:
    """The sentence for a folder or disk that does not take a file."""
    return StorageError(
        f"{path}: cannot be written ({error.strerror}); what was finished is kept, so free some space or choose "
        "another folder with --output and run again"
    )


def _alive(process: str) -> bool:
    """Whether the process whose number a half-written file carries still runs; another run may share the folder."""
    if not process.isdigit():
        return False
    try:
        os.kill(int(process), 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True
