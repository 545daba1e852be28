"""Verbs on inputs of seconds, each with the files that it reads: what a fuzzer damages."""

from __future__ import annotations

import contextlib
import gzip
import io
import shutil
import signal
import time
import tomllib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ins_eval.accelerometer.model import PRESETS
from ins_eval.cli import main
from ins_eval.digital_loop.parameters import find as loop_preset
from ins_eval.recording import form
from tests.faults.conftest import SHORT
from tests.faults.mutations import moved, mutated
from tests.faults.parked import parked, rewritten
from tests.recording.readers.conftest import CSV_MAPPING, csv_rows, drive, psins_mat

BEYOND_NORMAL_S = 2.0  # of processor time
LARGEST_KIB = 1_500_000_000 // 1024  # of memory beyond what stood there before
MOVED = 0.1  # share of the descriptions of a recording
HANG_S = 120  # of the wall clock, on a busy machine
KINDS = ("accepted", "refused", "defect", "slow", "large", "hang")


@dataclass(frozen=True)
class Verb:
    """Files below a folder, and the command line on them; `outputs` are what it writes there."""

    files: dict[str, bytes]
    arguments: Callable[[Path], list[str]]
    normal_s: float = 0.0


@dataclass(frozen=True)
class Outcome:
    """How a damaged input ended, what was said, and the file that was damaged."""

    kind: str
    said: str
    file: str


def _files(folder: Path, below: str = "") -> dict[str, bytes]:
    return {f"{below}{path.name}": path.read_bytes() for path in sorted(folder.iterdir()) if path.is_file()}


def verbs(folder: Path) -> dict[str, Verb]:
    """Each verb and what it reads, made in an empty folder; how long a sound input takes is measured."""
    folder.mkdir(parents=True)
    unit = _files(parked(folder / "unit"), "unit/")
    recording = form.read(folder / "unit")
    attitude = np.zeros((recording.gps.time_s.size, 3))
    form.write(replace(recording, reference=replace(recording.gps, attitude_rad=attitude)), folder / "led")
    _run(["simulate", "chamber", "--ramps", "4", "--no-dwell", "-o", f"{folder / 'chamber'}", "--quiet"])
    (folder / "short.toml").write_text(SHORT)
    flight = ["simulate", "flight", "--profile", f"{folder / 'short.toml'}", "--rate", "5", "--quiet"]
    _run([*flight, "-o", f"{folder / 'flight'}"])
    _run(
        [
            "calibrate",
            f"{folder / 'chamber'}",
            "--write-model",
            f"{folder / 'model.toml'}",
            "--output",
            f"{folder / 'c'}",
            "--quiet",
        ]
    )
    _run(["loop", "simulate", "paper-unit", "-o", f"{folder / 'loop'}", "--quiet"])
    loop = {name: (folder / "loop" / name).read_bytes() for name in ("scan.csv", "current.csv")}
    for name in ("one", "two"):
        _run(["evaluate", f"{folder / 'unit'}", "--output", f"{folder / name}", "--quiet"])
    (folder / "chamber" / "model.toml").write_bytes((folder / "model.toml").read_bytes())
    rewritten(folder / "chamber", "[accelerometer.x]", '[accelerometer.x]\ncompensation = "model.toml"')
    metrics = {f"{name}/metrics.json": (folder / name / "metrics.json").read_bytes() for name in ("one", "two")}
    belief = b"[gps]\nlever_arm_m = [0.1, 0.0, 0.0]\n[gyro]\nbias_radps = [0.0, 0.0, 0.0]\n[accelerometer]\n"
    model = {"model.toml": (folder / "model.toml").read_bytes()}
    chamber = _files(folder / "chamber", "chamber/")
    log = {"log.csv": gzip.compress(csv_rows(drive(10.0, 60.0)), mtime=0), "log.toml": CSV_MAPPING.encode()}
    made = {
        "import": Verb(log, lambda at: ["import", "csv", f"{at / 'log.csv'}", "-o", f"{at / 'out'}"]),
        "import, mat": Verb(
            {"log.mat": psins_mat(rate_hz=10.0, lasted_s=60.0)},
            lambda at: ["import", "psins-mat", f"{at / 'log.mat'}", "-o", f"{at / 'out'}"],
        ),
        "evaluate": Verb(unit, lambda at: ["evaluate", f"{at / 'unit'}", "--output", f"{at / 'out'}", "--quiet"]),
        "evaluate, belief": Verb(
            unit | {"belief.toml": belief},
            lambda at: ["evaluate", f"{at / 'unit'}", "--belief", f"{at / 'belief.toml'}", "--output", f"{at / 'out'}"],
        ),
        "evaluate, pulses": Verb(
            _files(folder / "flight", "flight/"),
            lambda at: ["evaluate", f"{at / 'flight'}", "--output", f"{at / 'out'}", "--quiet"],
        ),
        "compare": Verb(
            _files(folder / "led", "led/"),
            lambda at: ["compare", f"{at / 'led'}", "--output", f"{at / 'out'}", "--quiet"],
        ),
        "diagnose": Verb(
            unit,
            lambda at: [
                *("diagnose", f"{at / 'unit'}", "--json", f"{at / 'out.json'}", "--output", f"{at / 'out'}", "--quiet"),
            ],
        ),
        "diagnose, chamber": Verb(
            chamber, lambda at: ["diagnose", f"{at / 'chamber'}", "--json", f"{at / 'out.json'}", "--quiet"]
        ),
        "calibrate": Verb(
            chamber, lambda at: ["calibrate", f"{at / 'chamber'}", "--output", f"{at / 'out'}", "--quiet"]
        ),
        "loop calibrate": Verb(loop, lambda at: ["loop", "calibrate", *(f"{at / name}" for name in loop), "--quiet"]),
        "loop simulate": Verb(
            {"loop.toml": loop_preset("digital-qfa").read_bytes()},
            lambda at: ["loop", "simulate", f"{at / 'loop.toml'}", "-o", f"{at / 'out'}", "--quiet"],
        ),
        "results": Verb(metrics, lambda at: ["results", f"{at / 'one'}", f"{at / 'two'}", "--output", f"{at / 'out'}"]),
        "simulate": Verb(
            {"short.toml": SHORT.encode(), "mine.toml": (PRESETS / "jb-kt8.toml").read_bytes()},
            lambda at: [
                *("simulate", "flight", "--profile", f"{at / 'short.toml'}", "--rate", "5", "--quiet"),
                *("--population", f"{at / 'mine.toml'}", "-o", f"{at / 'out'}"),
            ],
        ),
        "check-model": Verb(model, lambda at: ["check-model", f"{at / 'model.toml'}"]),
    }
    return {name: replace(verb, normal_s=normal_s(verb, folder / "sound")) for name, verb in made.items()}


def damaged(verb: Verb, folder: Path, rng: np.random.Generator, only: str = "") -> Outcome:
    """The verb on one of its files damaged, or on a recording that was made somewhere else; `only` names the file."""
    name = only or list(verb.files)[int(rng.integers(len(verb.files)))]
    if (
        name.endswith("/recording.toml")
        and "start" in tomllib.loads(verb.files[name].decode())
        and rng.random() < MOVED
    ):
        _written(moved(verb.files, rng), folder)
    else:
        _written(verb.files | {name: mutated(name, verb.files[name], rng)}, folder)
    before_kib, began = _peak_kib(afresh=True), time.process_time()
    code, said = _run(verb.arguments(folder))
    took_s = time.process_time() - began
    if code == "hang":
        return Outcome("hang", said, name)
    if code not in (0, 1, 2, 3, 4) or (code and not _one_sentence(said)):
        return Outcome("defect", said, name)
    if _peak_kib() - before_kib > LARGEST_KIB:
        return Outcome("large", said, name)
    if took_s > 2.0 * verb.normal_s + BEYOND_NORMAL_S:
        return Outcome("slow", f"{took_s:.1f} s for {verb.normal_s:.1f} s: {said}", name)
    return Outcome("refused" if code else "accepted", said, name)


def _peak_kib(afresh: bool = False) -> int:
    """The most memory that this process held; from now on if `afresh`."""
    if afresh:
        Path("/proc/self/clear_refs").write_text("5")
    (line,) = [line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM")]
    return int(line.split()[1])


def _one_sentence(said: str) -> bool:
    return said.startswith("ins-eval: ") and said.count("\n") == 1 and said[:-1].isprintable()


def normal_s(verb: Verb, folder: Path) -> float:
    """How long the verb takes on its sound files, which it accepts, once everything is compiled."""
    took_s = []
    for _ in range(2):
        _written(verb.files, folder)
        began = time.process_time()
        code, said = _run(verb.arguments(folder))
        assert code == 0, said
        took_s.append(time.process_time() - began)
    return min(took_s)


def _written(files: dict[str, bytes], folder: Path) -> None:
    shutil.rmtree(folder, ignore_errors=True)
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)


class _Hang(BaseException):
    pass


def _run(arguments: list[str]) -> tuple[int | str | None, str]:
    """Exit code, or "hang", and standard error."""

    def too_long(*_: object) -> None:
        raise _Hang

    said, before = io.StringIO(), signal.signal(signal.SIGALRM, too_long)
    signal.alarm(HANG_S)
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(said), np.errstate(all="ignore"):
            return main(arguments), said.getvalue()
    except SystemExit as ended:
        return ended.code, said.getvalue()
    except _Hang:
        return "hang", said.getvalue()
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
