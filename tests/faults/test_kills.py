"""Every verb that writes, killed at random moments: no file is torn, and the next run ends with the same bytes."""

from __future__ import annotations

import random
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.faults.parked import parked
from tests.faults.test_interruption import kill
from tests.faults.verbs import Verb, verbs

KILLS = 20  # of each verb
LATEST = 0.9  # of the time that an undisturbed run takes
TIMEOUT_S = 600.0
WRITING = ("evaluate", "compare", "calibrate", "diagnose", "diagnose, chamber", "simulate", "loop simulate")
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Verb]:
    """The verbs that write, `import` and a folder of cases that are diagnosed one after the other."""
    folder = tmp_path_factory.mktemp("kills")
    found = {name: verb for name, verb in verbs(folder / "sound").items() if name in WRITING}
    unit = {path.name: path.read_bytes() for path in parked(folder / "unit").iterdir()}
    text = "t,wx,wy,wz,ax,ay,az\n" + "".join(f"{0.1 * k:.1f},5.59e-5,0,-4.69e-5,0,0,-9.8\n" for k in range(1, 600))
    mapping = IMPORTED.encode()
    found["import"] = Verb(
        {"unit.csv": text.encode(), "unit.toml": mapping},
        lambda at: ["import", "csv", f"{at / 'unit.csv'}", "-o", f"{at / 'out'}"],
    )
    found["concealed"] = Verb({f"cases/{k}/{name}": held for k in "ab" for name, held in unit.items()}, lambda at: [])
    return found


IMPORTED = """\
kind = "static"
axes = "FRD"
time = { column = "t", unit = "s" }
gyro = { columns = ["wx", "wy", "wz"], unit = "rad/s" }
accelerometer = { columns = ["ax", "ay", "az"], unit = "m/s^2" }
[start]
latitude_deg = 40.0
longitude_deg = 17.0
height_m = 100.0
"""


def begun(verb: Verb, at: Path) -> subprocess.Popen[str]:
    """The verb on its files below `at`, in a session of its own."""
    words = verb.arguments(at)
    program = ["ins_eval.cli", *words] if words else ["benchmark.runners.run", f"{at / 'cases'}", f"{at / 'out'}"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    return subprocess.Popen([sys.executable, "-m", *program], start_new_session=True, text=True, **pipes)


def ended(verb: Verb, at: Path) -> None:
    process = begun(verb, at)
    _, said = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == 0, said


def written(at: Path) -> dict[str, bytes]:
    """What a run wrote, without the times that a folder of cases took."""
    return {
        str(path.relative_to(at)): path.read_bytes()
        for path in sorted(at.rglob("*"))
        if path.is_file() and path.relative_to(at).parts[0].startswith("out") and path.name != "runs.json"
    }


def laid(verb: Verb, at: Path, before: dict[str, bytes]) -> None:
    shutil.rmtree(at, ignore_errors=True)
    for name, content in {**verb.files, **before}.items():
        (at / name).parent.mkdir(parents=True, exist_ok=True)
        (at / name).write_bytes(content)


@pytest.mark.parametrize("name", [*WRITING, "import", "concealed"])
def test_killed_at_any_moment(made: dict[str, Verb], tmp_path: Path, record_property, name: str) -> None:
    verb, at, chance = made[name], tmp_path / "at", random.Random(sum(name.encode()))
    laid(verb, at, {})
    began = time.monotonic()
    ended(verb, at)
    took_s, whole = time.monotonic() - began, written(at)
    assert whole
    met = 0
    for attempt in range(KILLS):
        laid(verb, at, whole if attempt % 2 else {})
        process = begun(verb, at)
        time.sleep(chance.uniform(0.0, LATEST) * took_s)
        met += process.poll() is None
        kill(process)
        after = written(at)
        torn = [file for file, held in after.items() if not file.endswith(".part") and held != whole[file]]
        assert torn == [], f"attempt {attempt}"
        if attempt % 2:
            assert whole.keys() <= after.keys(), f"attempt {attempt}: a file that stood there is gone"
        ended(verb, at)
        assert written(at) == whole, f"attempt {attempt}"
    record_property("outcomes", f"{KILLS} kills, {met} of a run at work")
    assert met > KILLS // 2


@pytest.mark.parametrize("name", [*WRITING, "import", "concealed"])
def test_two_runs_into_one_folder(made: dict[str, Verb], tmp_path: Path, name: str) -> None:
    """Both end, or one says in a sentence that it will not write there; what stands there is whole."""
    verb, at = made[name], tmp_path / "at"
    laid(verb, at, {})
    ended(verb, at)
    whole = written(at)
    laid(verb, at, {})
    both = [begun(verb, at), begun(verb, at)]
    said = [process.communicate(timeout=TIMEOUT_S)[1] for process in both]
    for process, words in zip(both, said, strict=True):
        assert process.returncode == 0 or words.startswith("ins-eval: ") and words.count("\n") == 1, words
    assert 0 in [process.returncode for process in both]
    assert written(at) == whole
