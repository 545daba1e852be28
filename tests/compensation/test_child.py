"""A user's model in its child: the same numbers, whatever it prints; one sentence, however it ends."""

import gc
import json
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from ins_eval.cli import main
from ins_eval.compensation import Samples, child
from ins_eval.compensation.connection import LENGTH_BYTES, Connection
from ins_eval.compensation.guard import working_model
from ins_eval.compensation.registry import load_model, make_model, model_files
from ins_eval.errors import UsageError
from ins_eval.recording import ChamberReadings

MODELS = """
import os, signal, sys, time, weakref
import numpy as np

print("imported")

class Model:
    name = "mine"
    made = weakref.WeakSet()
    def __init__(self):
        self.made.add(self)
    def fit(self, chamber):
        print("fitted")
        self.k1_ = np.polyfit(chamber.temperature_c, chamber.output, 5)
        self.said_ = (chamber.unit_id, chamber.axis, list(chamber.further), chamber.run.dtype.kind)
        self.further_ = chamber.further["chamber_c"].sum()
        return self
    def specific_force(self, samples):
        print("asked", flush=True)
        sys.stdout.write("{")
        return samples.output / np.polyval(self.k1_, samples.temperature_c) + self.further_

class Counting(Model):
    def specific_force(self, samples):
        return np.full(samples.output.shape, float(len(self.made)))

class Says(Model):
    def specific_force(self, samples):
        return self.said_

class Named(Model):
    @property
    def name(self):
        raise LookupError("no name yet")

class Exits(Model):
    def specific_force(self, samples):
        os._exit(3)

class Leaves(Model):
    def specific_force(self, samples):
        sys.exit("no licence")

class Crashes(Model):
    def specific_force(self, samples):
        os.kill(os.getpid(), signal.SIGSEGV)

class Starves(Model):
    def specific_force(self, samples):
        os.kill(os.getpid(), signal.SIGKILL)

class Hangs(Model):
    def specific_force(self, samples):
        time.sleep(60.0)

class Disturbs(Model):
    def specific_force(self, samples):
        for handle in range(3, 4096):
            try:
                os.write(handle, (2).to_bytes(4, "big") + b"{}")
            except OSError:
                pass
        return samples.output
"""
FAILURES = {
    "Exits": "ended its process (exit code 3)",
    "Leaves": "raised SystemExit: no licence, line 42 of my.py",
    "Crashes": "ended its process (SIGSEGV)",
    "Starves": "ended its process (SIGKILL, perhaps for lack of memory)",
    "Hangs": "gave no answer within 1 s",
    "Disturbs": "disturbed the connection to its process",
}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "my.py").write_text(MODELS)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(child, "_children", {})  # so that the children of a test end with it
    return tmp_path


def chamber() -> ChamberReadings:
    rng = np.random.default_rng(1)
    columns = [np.arange(90.0), np.arange(90) // 30, np.ones(90), np.full(90, 0.3), rng.normal(size=90)]
    return ChamberReadings(*columns, rng.normal(3e5, 10.0, 90), "unit", "z", {"chamber_c": rng.normal(size=90)})


def samples(count: int = 50000) -> Samples:
    rng = np.random.default_rng(2)
    return Samples(np.arange(1.0, count + 1.0), *rng.normal(size=(3, count)))


def test_same_numbers_to_the_last_digit_as_in_this_process(folder, capfd):
    """Also of views into larger arrays and of none at all; what the model prints is not on standard output."""
    here = make_model("my.py:Model").fit(chamber())
    capfd.readouterr()
    there = load_model("my.py:Model").fit(chamber())
    strided = Samples(*np.random.default_rng(3).normal(size=(40, 4)).T)
    for seen in (samples(), strided, samples(0)):
        expected = here.specific_force(seen)
        capfd.readouterr()
        assert np.array_equal(there.specific_force(seen), expected)
    assert capfd.readouterr().out == ""


def test_readings_arrive_whole(folder):
    """All but the arrays: a tuple comes back as its type alone."""
    (folder / "my.py").write_text(MODELS.replace("return self.said_", "raise ValueError(self.said_)"))
    with pytest.raises(UsageError, match=r"raised ValueError: \('unit', 'z', \['chamber_c'\], 'i'\), line"):
        working_model("my.py:Says", "x").fit(chamber()).specific_force(samples(3))


def test_what_is_no_array_comes_back_as_its_type_alone(folder):
    answer = load_model("my.py:Says").fit(chamber()).specific_force(samples(3))
    assert type(answer).__name__ == "tuple"


@pytest.mark.parametrize("claim", [["|O", [3]], ["<f8", [-3]], ["<f8", [10**12]], ["<f8", "x"], "<f8", [3, [3]]])
def test_what_is_no_plain_array_is_not_taken(claim):
    """Nor memory that is not there."""
    here, there = Connection.pair()
    text = json.dumps({"arrays": [claim]}).encode()
    there.messages.sendall(len(text).to_bytes(LENGTH_BYTES, "big") + text)
    with pytest.raises((ValueError, TypeError)):
        here.receive()
    here.close()
    there.close()


def test_models_that_nobody_holds_are_freed(folder):
    """In an ensemble of thousands of instruments each has its own models."""
    for _ in range(10):
        alive = load_model("my.py:Counting").fit(chamber()).specific_force(samples(1))[0]
        gc.collect()
    assert alive <= 2


@pytest.mark.parametrize("fault", FAILURES)
def test_failure_is_one_sentence(folder, monkeypatch, fault):
    model = working_model(f"my.py:{fault}", "instrument 0").fit(chamber())
    if fault == "Hangs":
        monkeypatch.setattr(child, "ANSWER_WITHIN_S", 1.0)
    with pytest.raises(UsageError) as refused:
        model.specific_force(samples(3))
    assert str(refused.value) == (
        f"compensation model 'my.py:{fault}': on instrument 0, specific_force {FAILURES[fault]}; mend the model"
    )


def test_check_model_refuses_one_that_ends_its_process(folder, capfd):
    (folder / "my.py").write_text(MODELS.replace('self.further_ = chamber.further["chamber_c"].sum()', "os._exit(4)"))
    assert main(["check-model", "my.py:Model"]) == 2
    assert "mine ended its process (exit code 4) while it was checked" in capfd.readouterr().err


def test_end_while_it_is_loaded(folder):
    (folder / "my.py").write_text("import os\nos._exit(5)\n")
    with pytest.raises(UsageError, match=r"'my.py:A': it ended its process \(exit code 5\) while it was loaded"):
        load_model("my.py:A")


def test_an_interrupt_leaves_no_answer_behind(folder, monkeypatch):
    """Else the next question would be given the answer to this one."""
    model = load_model("my.py:Model").fit(chamber())

    def interrupted(_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(child.Connection, "receive", interrupted)
        model.specific_force(samples(3))
    with pytest.raises(child.ModelFailed, match="ended its process"):
        model.specific_force(samples(4))
    assert load_model("my.py:Model").fit(chamber()).specific_force(samples(4)).shape == (4,)


def test_child_at_work_ends_with_its_parent(folder):
    """Without any chance for the parent to tell it."""
    (folder / "my.py").write_text(
        "import os, time\nfrom pathlib import Path\nPath('part').write_text(str(os.getpid()))\n"
        "Path('part').rename('child')\nwhile True:\n    pass\n"
    )
    command = "from ins_eval import load_model; load_model('my.py:A')"
    parent = subprocess.Popen([sys.executable, "-c", command], cwd=folder)
    deadline = time.monotonic() + 60.0
    while not (folder / "child").exists() and time.monotonic() < deadline:
        time.sleep(0.01)
    number = int((folder / "child").read_text())
    parent.kill()
    parent.wait()
    deadline = time.monotonic() + 10.0
    while running(number) and time.monotonic() < deadline:
        time.sleep(0.01)
    assert not running(number)


def running(number: int) -> bool:
    """Whether a process of that number runs; one that has ended and is not yet waited for does not."""
    try:
        with open(f"/proc/{number}/stat") as stat:
            return stat.read().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


def test_nothing_of_a_users_package_runs_here(folder, monkeypatch):
    """Not even to find its file, for which the packages above it are run."""
    package = folder / "lab_of_a_stranger"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "hot.py").write_text(MODELS)
    monkeypatch.syspath_prepend(folder)
    assert load_model("lab_of_a_stranger.hot:Model").name == "mine"
    assert model_files(["lab_of_a_stranger.hot:Model_refined"]) == [package / "hot.py"]
    mirrored = "2 lab_of_a_stranger.hot:Model - my.py:Model"
    assert set(model_files([mirrored])) == {package / "hot.py", Path("my.py")}
    assert not [name for name in sys.modules if name.startswith("lab_of_a_stranger")]
