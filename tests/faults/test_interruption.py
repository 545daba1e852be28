"""An ensemble that is killed, interrupted or damaged goes on, loses nothing and comes to the same bytes."""

from __future__ import annotations

import os
import random
import shutil
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from ins_eval.cli import main
from ins_eval.ensemble import Store

KILLS, MANY_KILLS = 3, 30
LONGEST_WAIT_S = 0.5
MANY = 40  # members, more than are finished before a test interferes
POLL_S = 0.01
WORKERS_END_WITHIN_S = 10.0
INTERRUPTED = (130, -signal.SIGINT)  # to a shell both are 130


def wait_until(condition: Callable[[], bool], process: subprocess.Popen[str]) -> bool:
    """Wait for a condition; False where the process ended before it came true."""
    while not condition():
        if process.poll() is not None:
            return False
        time.sleep(POLL_S)
    return True


def kill(process: subprocess.Popen[str]) -> None:
    """End a process with all its workers, without warning."""
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
    process.communicate()


def workers_of(session: int) -> list[int]:
    """Living worker processes of a session."""
    found = []
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit():
            try:
                state, *_, of_session = (folder / "stat").read_text().rpartition(")")[2].split()[:4]
                if int(of_session) == session and state != "Z" and b"spawn_main" in (folder / "cmdline").read_bytes():
                    found.append(int(folder.name))
            except (FileNotFoundError, ProcessLookupError):
                continue
    return found


def test_one_worker_gives_the_same_bytes_as_two(commands, short_report, tmp_path: Path) -> None:
    result = commands.run(commands.flight_report(tmp_path / "flight", workers=1))
    assert (result.returncode, result.stdout, result.stderr) == (0, "", "")
    assert (tmp_path / "flight" / "metrics.json").read_bytes() == short_report.metrics


def test_second_run_computes_nothing_again_and_gives_the_same_bytes(
    commands, short_report, members, tmp_path: Path
) -> None:
    folder = tmp_path / "flight"
    shutil.copytree(short_report.folder, folder)
    before = members(folder)
    leftover = folder / f"metrics.json.{dead_process()}.part"
    (folder / "metrics.json").rename(leftover)
    assert commands.run(commands.flight_report(folder)).returncode == 0
    assert not leftover.exists()
    assert members(folder) == before
    assert (folder / "metrics.json").read_bytes() == short_report.metrics


def kill_and_resume(commands, short_report, members, folder: Path, kills: int, chance: random.Random) -> int:
    """Kill a report at random moments until it has been killed `kills` times or ends; then let it end.

    Moments follow the start or one of the next members by a random time. Returns the kills that met a running ensemble.
    """
    done = 0
    for _ in range(kills):
        before = members(folder)
        process = commands.start(commands.flight_report(folder))
        more = len(before) + chance.randint(0, 2)
        wait_until(lambda more=more: len(list(folder.glob("members/*/*"))) >= more, process)
        time.sleep(chance.uniform(0.0, LONGEST_WAIT_S))
        running = process.poll() is None
        kill(process)
        done += running
        after = members(folder)
        assert {path: after.get(path) for path in before} == before, "a finished member was lost or computed again"
        for path in after:
            assert Store(folder / path.parent).read(int(path.stem)) is not None, f"{path} is torn"
        if (folder / "metrics.json").exists():
            assert (folder / "metrics.json").read_bytes() == short_report.metrics
        if not running:
            break
    before = members(folder)
    result = commands.run(commands.flight_report(folder))
    assert result.returncode == 0, result.stderr
    assert {path: members(folder)[path] for path in before} == before
    assert (folder / "metrics.json").read_bytes() == short_report.metrics
    assert list(folder.rglob("*.part")) == []
    return done


def test_killed_at_random_moments(commands, short_report, members, tmp_path: Path) -> None:
    assert kill_and_resume(commands, short_report, members, tmp_path / "flight", KILLS, random.Random(1)) >= 2


@pytest.mark.slow
def test_killed_at_many_random_moments(commands, short_report, members, tmp_path: Path) -> None:
    chance, done, ensemble = random.Random(2), 0, 0
    while done < MANY_KILLS:
        done += kill_and_resume(commands, short_report, members, tmp_path / str(ensemble), KILLS, chance)
        ensemble += 1


def test_interrupted_from_the_terminal(commands, finished_gate, members, assert_sentence, tmp_path: Path) -> None:
    folder = tmp_path / "gate"
    process = commands.start(commands.check_cep(folder, workers=2, size=MANY))
    assert wait_until(lambda: len(members(folder)) >= 2, process)
    os.killpg(process.pid, signal.SIGINT)
    output, errors = process.communicate()
    assert process.returncode in INTERRUPTED
    assert output == ""
    assert "run the same command again" in assert_sentence(errors)
    before = members(folder)
    assert 2 <= len(before) < MANY
    assert main(commands.check_cep(folder)) == 0
    now = members(folder)
    assert {path: now[path] for path in before} == before
    for path, (_, content) in members(finished_gate).items():
        assert now[path][1] == content


def test_interrupted_while_the_workers_start(commands, assert_sentence, tmp_path: Path) -> None:
    process = commands.start(commands.check_cep(tmp_path / "gate", workers=2))
    assert wait_until(lambda: len(workers_of(process.pid)) == 2, process)
    time.sleep(0.3)
    os.killpg(process.pid, signal.SIGINT)
    _, errors = process.communicate()
    assert process.returncode in INTERRUPTED
    assert_sentence(errors)


def test_lost_worker_is_one_sentence_and_the_rest_is_kept(commands, members, assert_sentence, tmp_path: Path) -> None:
    folder = tmp_path / "gate"
    process = commands.start(commands.check_cep(folder, workers=2, size=MANY))
    assert wait_until(lambda: len(members(folder)) >= 2, process)
    os.kill(workers_of(process.pid)[0], signal.SIGKILL)
    _, errors = process.communicate()
    assert process.returncode > 0
    assert "what was finished is kept" in assert_sentence(errors)
    before = members(folder)
    assert 2 <= len(before) < MANY
    assert main(commands.check_cep(folder)) == 0
    assert {path: members(folder)[path] for path in before} == before


@pytest.mark.parametrize("ended_by", [signal.SIGKILL, signal.SIGTERM])
def test_workers_end_with_their_parent(commands, members, ended_by: int, tmp_path: Path) -> None:
    folder = tmp_path / "gate"
    process = commands.start(commands.check_cep(folder, workers=2, size=MANY))
    try:
        assert wait_until(lambda: len(members(folder)) >= 1, process)
        os.kill(process.pid, ended_by)
        process.wait()
        deadline = time.monotonic() + WORKERS_END_WITHIN_S
        while workers_of(process.pid) and time.monotonic() < deadline:
            time.sleep(POLL_S)
        assert workers_of(process.pid) == []
    finally:
        for worker in workers_of(process.pid):
            os.kill(worker, signal.SIGKILL)
        process.communicate()


@pytest.mark.parametrize("damage", ["truncated", "empty", "garbage", "a few bytes lost", "a bit flipped in the index"])
def test_damaged_member_is_computed_again(commands, finished_gate, members, damage: str, tmp_path: Path) -> None:
    folder = tmp_path / "gate"
    shutil.copytree(finished_gate, folder)
    (victim, (_, content)), *others = members(folder).items()
    (folder / victim).write_bytes(damaged(content, damage))
    assert main(commands.check_cep(folder)) == 0
    now = members(folder)
    assert now[victim][1] == content
    assert {path: now[path] for path, _ in others} == dict(others)


def damaged(content: bytes, how: str) -> bytes:
    """What a disk may make of a file."""
    index = content.index(b"PK\x01\x02")  # of the zip archive: its first entry
    return {
        "truncated": content[: len(content) // 2],
        "empty": b"",
        "garbage": random.Random(1).randbytes(4000),
        "a few bytes lost": content[:100] + content[110:],
        "a bit flipped in the index": content[: index + 6] + bytes([content[index + 6] ^ 0x80]) + content[index + 7 :],
    }[how]


def test_leftover_of_a_killed_run_is_cleared(commands, finished_gate, members, tmp_path: Path) -> None:
    folder = tmp_path / "gate"
    shutil.copytree(finished_gate, folder)
    good = members(folder)
    unfinished = folder / next(iter(good))
    leftover = unfinished.with_name(f"{unfinished.name}.{dead_process()}.part")
    unfinished.rename(leftover)
    assert main(commands.check_cep(folder)) == 0
    assert not leftover.exists()
    assert {path: content for path, (_, content) in members(folder).items()} == {
        path: content for path, (_, content) in good.items()
    }


def dead_process() -> int:
    """The number of a process that has ended."""
    process = subprocess.Popen(["true"])
    process.wait()
    return process.pid
