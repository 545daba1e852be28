"""Files are whole or absent, whatever fails in between."""

from __future__ import annotations

import errno
import io
import os
import random
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ins_eval import files
from ins_eval.ensemble import Store
from ins_eval.errors import StorageError
from ins_eval.files import write_whole

OLD, NEW = b"what stood there", b"what comes" * 1000
MEMBER = {
    "simple": {"velocity_rms_north": np.array(1.25), "track_m": np.arange(24.0).reshape(12, 2)},
    "my.py:MyModel": {"velocity_rms_north": np.array(0.75), "track_m": np.ones((12, 2))},
}
DAMAGES = 2000


class FullDisk(io.FileIO):
    """A file whose disk is full after some bytes."""

    room = 0

    def write(self, content: bytes) -> int:
        self.room -= len(content)
        if self.room < 0:
            raising(errno.ENOSPC)()
        return super().write(content)


def full_after(room: int) -> Callable[..., FullDisk]:
    """An `open` of such files."""

    def opened(path: Path, mode: str) -> FullDisk:
        file = FullDisk(path, mode)
        file.room = room
        return file

    return opened


def raising(number: int) -> Callable[..., None]:
    """A function that fails as the operating system does."""

    def fail(*_: object, **__: object) -> None:
        raise OSError(number, os.strerror(number))

    return fail


def same(left, right) -> bool:
    """Whether two members hold the same arrays, bit by bit."""
    return {a: {k: v.tobytes() for k, v in d.items()} for a, d in left.items()} == {
        a: {k: v.tobytes() for k, v in d.items()} for a, d in right.items()
    }


FAULTS = {
    "read-only folder": ("open", errno.EROFS),
    "no permission": ("open", errno.EACCES),
    "disk full while writing": ("write", errno.ENOSPC),
    "disk full while syncing": ("fsync", errno.ENOSPC),
    "quota used up": ("fsync", errno.EDQUOT),
    "broken disk": ("replace", errno.EIO),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_fault_leaves_the_old_file_and_nothing_else(tmp_path: Path, monkeypatch, fault: str) -> None:
    place, number = FAULTS[fault]
    path = tmp_path / "metrics.json"
    path.write_bytes(OLD)
    if place == "open":
        monkeypatch.setattr(files, "open", raising(number), raising=False)
    elif place == "write":
        monkeypatch.setattr(files, "open", full_after(100), raising=False)
    else:
        monkeypatch.setattr(os, place, raising(number))
    with pytest.raises(StorageError) as refused:
        write_whole(path, NEW)
    monkeypatch.undo()
    assert os.strerror(number) in str(refused.value)
    assert str(path) in str(refused.value)
    assert "\n" not in str(refused.value)
    assert path.read_bytes() == OLD
    assert list(tmp_path.iterdir()) == [path]


def test_content_is_on_the_disk_before_it_takes_its_name(tmp_path: Path, monkeypatch) -> None:
    done = []
    sync, replace = os.fsync, os.replace
    monkeypatch.setattr(os, "fsync", lambda number: (done.append(os.fstat(number).st_size), sync(number)))
    monkeypatch.setattr(os, "replace", lambda *names: (done.append("replace"), replace(*names)))
    assert write_whole(tmp_path / "new" / "metrics.json", NEW).read_bytes() == NEW
    assert done[:2] == [len(NEW), "replace"]


def test_function_may_write_the_content(tmp_path: Path) -> None:
    write_whole(tmp_path / "a", lambda file: file.write(NEW))
    assert (tmp_path / "a").read_bytes() == NEW


def test_leftover_of_a_dead_process_goes_and_that_of_a_living_one_stays(tmp_path: Path) -> None:
    dead = subprocess.Popen(["true"])
    dead.wait()
    old, other = tmp_path / f"a.{dead.pid}.part", tmp_path / f"a.{os.getppid()}.part"
    old.write_bytes(b"half")
    other.write_bytes(b"half")
    write_whole(tmp_path / "a", NEW)
    assert not old.exists()
    assert other.exists()


def test_member_comes_back_bit_by_bit(tmp_path: Path) -> None:
    store = Store(tmp_path / "members").open()
    assert store.read(3) is None
    store.write(3, MEMBER)
    assert same(store.read(3), MEMBER)
    assert store.read(4) is None


def test_member_that_cannot_be_kept_spoils_nothing(tmp_path: Path, monkeypatch) -> None:
    store = Store(tmp_path).open()
    store.write(0, MEMBER)
    monkeypatch.setattr(files, "open", full_after(300), raising=False)
    with pytest.raises(StorageError):
        store.write(1, MEMBER)
    monkeypatch.undo()
    assert same(store.read(0), MEMBER)
    assert store.read(1) is None
    assert [path.name for path in tmp_path.iterdir()] == [store.path(0).name]


def test_no_damaged_member_is_taken_for_a_whole_one(tmp_path: Path) -> None:
    store, chance = Store(tmp_path).open(), random.Random(3)
    store.write(0, MEMBER)
    whole = store.path(0).read_bytes()
    for _ in range(DAMAGES):
        store.path(0).write_bytes(damaged(whole, chance))
        seen = store.read(0)
        assert seen is None or same(seen, MEMBER)
    for content in (b"", b"PK\x05\x06" + bytes(18), whole[:-1], whole + b"\0" * 512, bytes(len(whole))):
        store.path(0).write_bytes(content)
        seen = store.read(0)
        assert seen is None or same(seen, MEMBER)


def damaged(content: bytes, chance: random.Random) -> bytes:
    """Flip bits, cut, blank, lose or gain some bytes."""
    at, many = chance.randrange(len(content)), chance.randint(1, 64)
    return {
        "flip": content[:at] + bytes([content[at] ^ 1 << chance.randrange(8)]) + content[at + 1 :],
        "cut": content[:at],
        "blank": content[:at] + bytes(len(content[at : at + many])) + content[at + many :],
        "lose": content[:at] + content[at + many :],
        "gain": content[:at] + chance.randbytes(many) + content[at:],
    }[chance.choice(["flip", "cut", "blank", "lose", "gain"])]


def test_folder_in_place_of_a_member_is_said_in_one_sentence(tmp_path: Path) -> None:
    store = Store(tmp_path).open()
    store.path(0).mkdir()
    with pytest.raises(StorageError, match="Is a directory"):
        store.read(0)


def test_two_runs_may_share_a_folder(tmp_path: Path) -> None:
    """Another run opens the store while this one is writing a member."""
    store = Store(tmp_path).open()

    def content(file) -> None:
        file.write(b"first half")
        Store(tmp_path).open()
        file.write(b" and the second")

    write_whole(store.path(0), content)
    assert store.path(0).read_bytes() == b"first half and the second"
