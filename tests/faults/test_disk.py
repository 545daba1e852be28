"""Folders that cannot be written and disks that fill up: exit code 4, one sentence, nothing lost."""

from __future__ import annotations

import errno
import os
import resource
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from ins_eval.cli import main

TINY_DISK, LARGER_DISK = "40k", "4m"
SIZE = 12
LONGEST_FILE = 2000  # bytes; a member is longer


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Callable[[str], Path]]:
    """A disk of one's own in memory, mounted with the options given; again with others where it is there already."""
    place = tmp_path / "disk"
    place.mkdir()

    def mount(options: str) -> Path:
        again = "remount," if os.path.ismount(place) else ""
        command = ["mount", "-t", "tmpfs", "-o", again + options, "tmpfs", str(place)]
        try:
            done = subprocess.run(command, capture_output=True, text=True, check=False)
        except FileNotFoundError:
            pytest.skip("no mount command here")
        if done.returncode:
            pytest.skip(f"no disk can be mounted here: {done.stderr.strip()}")
        return place

    yield mount
    if os.path.ismount(place):
        subprocess.run(["umount", str(place)], check=True)


def test_full_disk_keeps_what_is_finished_and_goes_on_with_more_room(
    commands, disk, finished_gate: Path, members, refused
) -> None:
    folder = disk(f"size={TINY_DISK}") / "gate"
    sentence = refused(commands.check_cep(folder, size=SIZE), 4)
    assert "No space left on device" in sentence
    before = members(folder)
    assert 0 < len(before) < SIZE
    assert list(folder.rglob("*.part")) == []
    disk(f"size={LARGER_DISK}")
    assert main(commands.check_cep(folder, size=SIZE)) == 0
    assert {path: members(folder)[path] for path in before} == before
    small = members(finished_gate)  # the first members of the same plan, on an ordinary disk
    assert {path: members(folder)[path][1] for path in small} == {path: content for path, (_, content) in small.items()}


def test_full_disk_in_a_worker(commands, disk, assert_sentence) -> None:
    folder = disk(f"size={TINY_DISK}") / "gate"
    result = commands.run(commands.check_cep(folder, workers=2, size=SIZE))
    assert result.returncode == 4
    assert "No space left on device" in assert_sentence(result.stderr)


def test_full_disk_when_the_report_is_written(commands, disk, short_report, members, assert_sentence) -> None:
    """Room for the members, none for the page and its figures."""
    folder = disk("size=8m") / "flight"
    folder.mkdir()
    subprocess.run(["cp", "-a", str(short_report.folder / "members"), str(folder)], check=True)
    used_kib = sum(-(-path.stat().st_size // 4096) * 4 for path in folder.rglob("*") if path.is_file())
    disk(f"size={used_kib + 60}k")
    before = members(folder)
    result = commands.run(commands.flight_report(folder))
    assert result.returncode == 4
    assert "No space left on device" in assert_sentence(result.stderr)
    assert members(folder) == before
    assert list(folder.rglob("*.part")) == []
    if (folder / "metrics.json").exists():
        assert (folder / "metrics.json").read_bytes() == short_report.metrics


def test_file_that_may_grow_no_further(commands, assert_sentence, tmp_path: Path) -> None:
    """The system's own limit, for which nobody needs to be root."""
    result = commands.run(
        commands.check_cep(tmp_path / "gate"),
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (LONGEST_FILE, LONGEST_FILE)),
    )
    assert result.returncode == 4
    assert "File too large" in assert_sentence(result.stderr)
    assert [path for path in (tmp_path / "gate").rglob("*") if path.is_file()] == []


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.EIO])
def test_disk_that_fails_after_some_members(
    commands, members, refused, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, number: int
) -> None:
    folder, sync, synced = tmp_path / "gate", os.fsync, []

    def failing(file: int) -> None:
        synced.append(file)
        if len(synced) > 2:
            raise OSError(number, os.strerror(number))
        sync(file)

    monkeypatch.setattr(os, "fsync", failing)
    assert os.strerror(number) in refused(commands.check_cep(folder), 4)
    monkeypatch.undo()
    before = members(folder)
    assert len(before) == 2
    assert list(folder.rglob("*.part")) == []
    assert main(commands.check_cep(folder)) == 0
    assert {path: members(folder)[path] for path in before} == before


@pytest.mark.parametrize("verb", ["flight_report", "check_cep"])
def test_output_that_is_a_file_or_lies_below_one(commands, refused, tmp_path: Path, verb: str) -> None:
    file = tmp_path / "file"
    file.write_text("mine")
    for output in (file, file / "below"):
        sentence = refused(getattr(commands, verb)(output), 4)
        assert str(output) in sentence
        assert "Not a directory" in sentence
    assert file.read_text() == "mine"


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="no /proc here")
def test_folder_that_takes_no_folder(commands, refused) -> None:
    assert "/proc/gate" in refused(commands.check_cep(Path("/proc/gate")), 4)


def test_read_only_disk(commands, disk, refused) -> None:
    folder = disk("ro,size=1m")
    assert "Read-only file system" in refused(commands.check_cep(folder / "gate"), 4)
    assert list(folder.iterdir()) == []


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write into a folder that is read-only")
def test_read_only_folder(commands, refused, tmp_path: Path) -> None:
    folder = tmp_path / "closed"
    folder.mkdir(mode=0o555)
    assert "Permission denied" in refused(commands.check_cep(folder / "gate"), 4)


def test_folder_that_becomes_read_only_keeps_its_members(commands, disk, members, refused) -> None:
    folder = disk(f"size={LARGER_DISK}") / "gate"
    assert main(commands.check_cep(folder)) == 0
    before = members(folder)
    disk("ro")
    assert "Read-only file system" in refused(commands.check_cep(folder, size=SIZE), 4)
    assert members(folder) == before
    disk("rw")
    assert main(commands.check_cep(folder, size=SIZE)) == 0
    assert {path: members(folder)[path] for path in before} == before


@pytest.mark.parametrize("number", [errno.EACCES, errno.EROFS])
def test_folder_that_cannot_be_made(
    commands, refused, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, number: int
) -> None:
    def failing(*_: object, **__: object) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(Path, "mkdir", failing)
    assert os.strerror(number) in refused(commands.check_cep(tmp_path / "gate"), 4)


def test_gains_that_cannot_be_committed(commands, refused, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    committed = tmp_path / "file" / "gate.toml"
    arguments = commands.check_cep(tmp_path / "gate", "--commit", "--committed", str(committed))
    assert str(committed) in refused(arguments, 4)
