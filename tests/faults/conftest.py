"""A short flight, the commands run in a process of their own, and what a good refusal looks like."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from ins_eval.cli import main
from ins_eval.gate import ERRORS, GAINS, MEASURES, NOT_WORSE

# A circuit of ten minutes: the same code as the flight of two hours, in seconds.
SHORT = """\
name = "short"
duration_s = 600.0

[start]
latitude_deg = 34.65
longitude_deg = 108.9
height_m = 400.0
heading_deg = 60.0
stand_s = 300.0

[[speed]]
from_s = 0.0
to_s = 60.0
to_mps = 100.0

[[turn]]
at_s = 200.0
by_deg = 90.0
bank_deg = 33.0

[thermal]
self_heating_c = 20.0
time_constant_s = 600.0
"""
SIZE = 2
VAGUE = "{ value = 0.99, log_sd = 1.0 }"  # committed like this, any number is met by the gate and no gain is held
LONGEST_SENTENCE = 400  # characters, without the paths in it
TIMEOUT_S = 300.0


def _interruptible() -> None:
    """SIGINT ends the command also where the tests themselves were started in the background, which ignores it."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@dataclass(frozen=True)
class Commands:
    """`ins-eval` in a process, and a process group, of its own."""

    profile: Path
    committed: Path

    def flight_report(self, output: Path, *more: str, workers: int = 2, size: int = SIZE) -> list[str]:
        """Arguments of a flight report of the short flight."""
        return ["flight-report", *self._common(output, workers, size), *more]

    def check_cep(self, output: Path, *more: str, workers: int = 1, size: int = SIZE) -> list[str]:
        """Arguments of the gate, the quickest verb that runs an ensemble, on the short flight."""
        return ["check-cep", "--committed", str(self.committed), *self._common(output, workers, size), *more]

    def _common(self, output: Path, workers: int, size: int) -> list[str]:
        numbers = ["--ensemble", str(size), "--workers", str(workers)]
        return ["--profile", str(self.profile), "--output", str(output), *numbers, "--quiet"]

    def start(self, arguments: list[str], **options: object) -> subprocess.Popen[str]:
        """Begin; the process leads a session of its own, so that it can be killed with all its workers."""
        environment = {key: value for key, value in os.environ.items() if key != "PYTHONUNBUFFERED"}
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        command = [sys.executable, "-m", "ins_eval.cli", *arguments]
        options = {**pipes, "preexec_fn": _interruptible, **options}
        return subprocess.Popen(command, env=environment, start_new_session=True, text=True, **options)

    def run(self, arguments: list[str], **options: object) -> subprocess.CompletedProcess[str]:
        """Run to the end."""
        process = self.start(arguments, **options)
        output, errors = process.communicate(timeout=TIMEOUT_S)
        return subprocess.CompletedProcess(arguments, process.returncode, output, errors)


@dataclass(frozen=True)
class Report:
    """A finished flight report."""

    folder: Path

    @property
    def metrics(self) -> bytes:
        """Its numbers, byte by byte."""
        return (self.folder / "metrics.json").read_bytes()


@pytest.fixture(scope="session")
def short_profile(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file of the short flight."""
    path = tmp_path_factory.mktemp("profile") / "short.toml"
    path.write_text(SHORT)
    return path


@pytest.fixture(scope="session")
def commands(short_profile: Path) -> Commands:
    """The verbs on the short flight, which meets a gate that holds next to nothing."""
    committed = short_profile.with_name("gate.toml")
    tables = [f'[{flight}."{quantity}"]\n' for _, flight, quantity in (*GAINS, *NOT_WORSE, *ERRORS)]
    values = "".join(f"{measure} = {VAGUE}\n" for measure in MEASURES)
    committed.write_text(
        "seed = 0\n[size]\npaper = 3000\nmissions = 3000\n" + "".join(table + values for table in tables)
    )
    return Commands(short_profile, committed)


@pytest.fixture(scope="session")
def short_report(commands: Commands, tmp_path_factory: pytest.TempPathFactory) -> Report:
    """A flight report with two workers that nothing disturbed."""
    folder = tmp_path_factory.mktemp("undisturbed") / "flight"
    result = commands.run(commands.flight_report(folder))
    assert result.returncode == 0, result.stderr
    return Report(folder)


@pytest.fixture(scope="session")
def finished_gate(commands: Commands, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a gate that was met, with all its members."""
    folder = tmp_path_factory.mktemp("finished") / "gate"
    assert main(commands.check_cep(folder)) == 0
    return folder


@pytest.fixture(scope="session")
def assert_sentence() -> Callable[[str], str]:
    """Check that standard error holds one sentence and nothing else, and return it."""

    def check(errors: str) -> str:
        assert errors.startswith("ins-eval: "), errors
        assert errors.count("\n") == 1 and errors.endswith("\n"), errors
        assert "Traceback" not in errors
        assert not re.search(r"[a-z]\. [A-Z]", errors), f"more than one sentence: {errors}"
        assert len(re.sub(r"\S*/\S*", "", errors)) < LONGEST_SENTENCE, errors
        return errors.strip()

    return check


@pytest.fixture
def refused(
    capsys: pytest.CaptureFixture[str], assert_sentence: Callable[[str], str]
) -> Callable[[list[str], int], str]:
    """Run the command line in this process, expect the exit code, and return the sentence."""

    def run(arguments: list[str], code: int) -> str:
        capsys.readouterr()
        returned = main(arguments)
        said = capsys.readouterr()
        assert returned == code, said.err
        return assert_sentence(said.err)

    return run


@pytest.fixture(scope="session")
def members() -> Callable[[Path], dict[Path, tuple[int, bytes]]]:
    """Finished members below a folder: time of writing and content of each."""

    def look(folder: Path) -> dict[Path, tuple[int, bytes]]:
        files = sorted(path for path in folder.glob("members/*/*") if path.suffix != ".part")
        return {path.relative_to(folder): (path.stat().st_mtime_ns, path.read_bytes()) for path in files}

    return look
