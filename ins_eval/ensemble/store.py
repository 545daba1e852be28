"""Finished members on disk, safe against a crash."""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ins_eval.errors import StorageError
from ins_eval.files import cannot_write, write_whole

CHECKSUM_BYTES = 32  # SHA-256
CONTENTS = "contents"  # of each array its key and the arms


@dataclass(frozen=True)
class Store:
    """Finished members on disk, one file each."""

    folder: Path

    def open(self) -> Store:
        """Make the folder. Raises StorageError where that cannot be done."""
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise cannot_write(self.folder, error) from None
        return self

    def path(self, index: int) -> Path:
        """Where the member with this number lies."""
        return self.folder / f"{index:05d}.npz"

    def read(self, index: int) -> dict[str, dict[str, np.ndarray]] | None:
        """A finished member, or None where there is none or its file is damaged, so that it is computed again."""
        try:
            content = self.path(index).read_bytes()
        except FileNotFoundError:
            return None
        except OSError as error:
            raise StorageError(
                f"{self.path(index)}: cannot be read ({error.strerror}); remove it or choose another --output"
            ) from None
        arrays, checksum = content[:-CHECKSUM_BYTES], content[-CHECKSUM_BYTES:]
        if hashlib.sha256(arrays).digest() != checksum:
            return None
        result: dict[str, dict[str, np.ndarray]] = {}
        with np.load(io.BytesIO(arrays), allow_pickle=False) as stored:
            for number, (key, arms) in enumerate(json.loads(stored[CONTENTS].tobytes())):
                for arm, value in zip(arms, stored[f"arr_{number}"], strict=True):
                    result.setdefault(arm, {})[key] = value
        return result

    def write(self, index: int, result: Mapping[str, Mapping[str, np.ndarray]]) -> None:
        """Keep a member, its checksum behind it. Raises StorageError, with everything finished before still there."""
        alike: dict[tuple, list[str]] = {}  # with one key, shape and type: in one array, read faster
        for arm, values in result.items():
            for key, value in values.items():
                alike.setdefault((key, np.shape(value), np.asarray(value).dtype.str), []).append(arm)
        contents = json.dumps([(key, arms) for (key, _, _), arms in alike.items()]).encode()
        arrays = [np.stack([result[arm][key] for arm in arms]) for (key, _, _), arms in alike.items()]
        buffer = io.BytesIO()
        np.savez(buffer, *arrays, **{CONTENTS: np.frombuffer(contents, np.uint8)})
        write_whole(self.path(index), buffer.getvalue() + hashlib.sha256(buffer.getvalue()).digest())
