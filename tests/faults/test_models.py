"""A stranger's model that fails: its own line and reason, exit code 2, never a defect of ours."""

from __future__ import annotations

from pathlib import Path

import pytest

from ins_eval.cli import main

# sound on the textbook chamber and flight of `check-model`, which have other temperatures than the real ones
BASE = """\
import numpy as np
from ins_eval import four_point

class Base:
    def fit(self, chamber):
        points = four_point(chamber)
        self.k1, self.k0 = points.scale.mean(), points.bias_ug.mean()
        return self
    def specific_force(self, samples):
        return 9.80665 * (samples.output / self.k1 - 1e-6 * self.k0)
"""
TEXTBOOK = "textbook"  # name of the unit in the chamber of check-model
BAD = {
    "raises in fit": (
        f"""
class Bad(Base):
    name = "bad"
    def fit(self, chamber):
        if chamber.unit_id != "{TEXTBOOK}":
            raise ZeroDivisionError("singular normal matrix")
        return super().fit(chamber)
""",
        "singular normal matrix, line 16 of my.py",
    ),
    "raises in flight": (
        f"""
class Bad(Base):
    name = "bad"
    def fit(self, chamber):
        self.real = chamber.unit_id != "{TEXTBOOK}"
        return super().fit(chamber)
    def specific_force(self, samples):
        if self.real and samples.time_s.size > 3000:
            raise IndexError("table too short")
        return super().specific_force(samples)
""",
        "table too short, line 19 of my.py",
    ),
    "wrong shape in flight": (
        f"""
class Bad(Base):
    name = "bad"
    def fit(self, chamber):
        self.real = chamber.unit_id != "{TEXTBOOK}"
        return super().fit(chamber)
    def specific_force(self, samples):
        return super().specific_force(samples)[int(self.real):]
""",
        "instrument 0",
    ),
    "not finite in flight": (
        f"""
class Bad(Base):
    name = "bad"
    def fit(self, chamber):
        self.real = chamber.unit_id != "{TEXTBOOK}"
        return super().fit(chamber)
    def specific_force(self, samples):
        force = super().specific_force(samples)
        return force * np.nan if self.real and samples.time_s.size > 3000 else force
""",
        "not finite",
    ),
}
REFUSED = {
    "does not import": ("import numpy as np\nimport no_such_thing_at_all\n", "no_such_thing_at_all"),
    "does not parse": ("class Bad\n    pass\n", "SyntaxError"),
    "raises when imported": ("raise RuntimeError('licence expired')\n", "licence expired"),
    "name of a built-in": (BASE + '\nclass Bad(Base):\n    name = "simple"\n', "that of a built-in model"),
    "name with a slash": (BASE + '\nclass Bad(Base):\n    name = "lab/bad"\n', "lab/bad"),
    "name that the report keeps for itself": (BASE + '\nclass Bad(Base):\n    name = "size"\n', "'size'"),
    "not that class": (BASE, "did you mean 'Base'"),
    "looks ahead": (
        BASE
        + '\nclass Bad(Base):\n    name = "bad"\n    def specific_force(self, samples):\n'
        + "        return super().specific_force(samples)[::-1][::-1] - samples.output.mean() * 1e-9\n",
        "looks ahead",
    ),
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("fault", REFUSED)
def test_refused_before_anything_is_computed(commands, folder: Path, refused, fault: str) -> None:
    text, said = REFUSED[fault]
    (folder / "my.py").write_text(text)
    output = folder / "never"
    assert said in refused(commands.flight_report(output, "--model", "my.py:Bad"), 2)
    assert not output.exists()


@pytest.mark.parametrize("spec", ["my.py:Bad", "nowhere/my.py:Bad", "my.py", "no_such_package_at_all.sub:Bad"])
def test_model_that_is_not_there(commands, folder: Path, refused, spec: str) -> None:
    assert spec in refused(commands.flight_report(folder / "never", "--model", spec), 2)
    assert not (folder / "never").exists()


def test_folder_in_place_of_a_model(commands, folder: Path, refused) -> None:
    (folder / "my.py").mkdir()
    assert "my.py" in refused(commands.flight_report(folder / "never", "--model", "my.py:Bad"), 2)


@pytest.mark.parametrize("fault", BAD)
def test_fails_only_on_real_instruments(commands, folder: Path, refused, fault: str) -> None:
    text, said = BAD[fault]
    (folder / "my.py").write_text(BASE + text)
    assert main(["check-model", "my.py:Bad"]) == 0
    sentence = refused(commands.flight_report(folder / "out", "--model", "my.py:Bad", workers=1), 2)
    assert "my.py:Bad" in sentence
    assert said in sentence


def test_fails_in_a_worker_with_the_same_sentence(commands, folder: Path, assert_sentence) -> None:
    text, said = BAD["raises in fit"]
    (folder / "my.py").write_text(BASE + text)
    result = commands.run(commands.flight_report(folder / "out", "--model", str(folder / "my.py") + ":Bad"))
    assert result.returncode == 2
    assert said in assert_sentence(result.stderr)
