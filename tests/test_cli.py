"""The command line: verbs, help, exit codes, a user's own model from the README to the page."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from ins_eval.cli import main

MODEL = """\
from ins_eval import four_point

class MyModel:
    name = "mine"
    def fit(self, chamber):
        points = four_point(chamber)
        self.scale, self.bias_ug = points.scale.mean(), points.bias_ug.mean()
        return self
    def specific_force(self, samples):
        return 9.80665 * (samples.output / self.scale - 1e-6 * self.bias_ug)
"""
PROFILE = """\
name = "hop"
duration_s = 300.0

[start]
latitude_deg = 34.65
longitude_deg = 108.9
height_m = 400.0
heading_deg = 60.0
stand_s = 120.0

[[speed]]
from_s = 0.0
to_s = 60.0
to_mps = 100.0

[thermal]
self_heating_c = 20.0
time_constant_s = 600.0
"""
CONTRACT_POINTS = 6  # at least: ahead, unit, input, shape, finite, repeatable


def help_of(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """What ``--help`` prints."""
    with pytest.raises(SystemExit) as ended:
        main([*arguments, "--help"])
    assert ended.value.code == 0
    return capsys.readouterr().out


def python(
    *arguments: str, folder: Path, unbuffered: bool = False, **options: object
) -> subprocess.CompletedProcess[str]:
    """``python -m ins_eval.cli`` in a process of its own."""
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONUNBUFFERED"}
    command = [sys.executable, *(["-u"] if unbuffered else []), "-m", "ins_eval.cli", *arguments]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **options}
    return subprocess.run(command, cwd=folder, env=environment, text=True, check=False, **pipes)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A user's folder with a model and a profile in it."""
    (tmp_path / "my.py").write_text(MODEL)
    (tmp_path / "hop.toml").write_text(PROFILE)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_help_names_the_verbs_and_the_exit_codes(capsys) -> None:
    text = help_of(capsys)
    for verb in ("flight-report", "evaluate", "check-model", "check-cep"):
        assert re.search(rf"^ +{verb}\b", text, re.MULTILINE)
    assert "exit codes: 0 done, 1 gate not met, 2 " in text


def test_each_verb_has_help_for_each_option(capsys) -> None:
    verbs = re.findall(r"^ {4}([a-z-]+)\b", help_of(capsys), re.MULTILINE)
    assert len(verbs) >= 4
    for verb in verbs:
        text = help_of(capsys, verb)
        assert f"ins-eval {verb}" in text
        for option in set(re.findall(r"\[(--[a-z-]+)", text)):
            assert re.search(rf"^ +(-\w( \w+)?, )?{option}\b", text, re.MULTILINE), f"{verb} {option} has no help"


def test_runs_as_a_module_and_returns_its_code(folder: Path) -> None:
    good = python("check-model", "simple", folder=folder)
    assert (good.returncode, good.stderr) == (0, "")
    assert good.stdout.endswith("keeps the contract of a compensation model\n")
    bad = python("check-model", "simpel", folder=folder)
    assert (bad.returncode, bad.stdout) == (2, "")
    assert "did you mean 'simple'" in bad.stderr


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], "VERB"),
        (["fligth-report"], "invalid choice: 'fligth-report'"),
        (["flight-report", "--ensembel", "4"], "--ensembel"),
        (["flight-report", "--ensemble", "0"], "--ensemble: 0, expected at least"),
        (["flight-report", "--ensemble", "1"], "--ensemble: 1, expected at least 2"),
        (["flight-report", "--ensemble", "-3"], "--ensemble: -3, expected at least"),
        (["flight-report", "--ensemble", "many"], "--ensemble"),
        (["flight-report", "--workers", "0"], "--workers: 0, expected at least 1"),
        (["flight-report", "--seed", "one"], "--seed"),
        (["flight-report", "--seed", "-1"], "--seed: -1, expected at least 0"),
        (["check-cep", "--seed", "-1"], "--seed: -1, expected at least 0"),
        (["check-cep", "--ensemble", "1"], "--ensemble: 1, expected at least 2"),
        (["check-model"], "model"),
    ],
    ids=lambda value: "-".join(value) if isinstance(value, list) else "",
)
def test_unusable_option_is_refused_at_once(folder: Path, capsys, arguments: list[str], said: str) -> None:
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 2
    errors = capsys.readouterr().err
    assert said in errors.splitlines()[-1]
    assert "Traceback" not in errors
    assert sorted(path.name for path in folder.iterdir()) == ["hop.toml", "my.py"]


def test_check_model_prints_a_line_for_each_point_of_the_contract(folder: Path, capsys) -> None:
    assert main(["check-model", "my.py:MyModel"]) == 0
    *points, not_seen, last = capsys.readouterr().out.splitlines()
    assert len(points) >= CONTRACT_POINTS
    assert all(line.endswith(": ok") for line in points)
    assert not_seen.startswith("not seen by this check: whether the model opens files")
    assert last == "my.py:MyModel keeps the contract of a compensation model"


def test_check_model_refuses_with_the_sentence_and_the_line(folder: Path, capsys) -> None:
    (folder / "my.py").write_text(MODEL.replace("return 9.80665 * (", "return ("))
    assert main(["check-model", "my.py:MyModel"]) == 2
    said = capsys.readouterr()
    assert "looks like g" in said.err
    assert said.err.count("\n") == 1
    assert len([line for line in said.out.splitlines() if line.endswith(": refused")]) == 1
    assert "looks like g" not in said.out  # on a terminal it would stand there twice
    assert "keeps the contract" not in said.out


def test_a_users_model_of_ten_lines_stands_beside_the_others(folder: Path) -> None:
    assert len([line for line in MODEL.splitlines() if line.strip()]) <= 10
    model = str(folder / "my.py") + ":MyModel"  # a path, as a shell may complete it
    result = python(
        *("flight-report", "--profile", "hop.toml", "--model", model, "--ensemble", "2", "--output", "out"),
        folder=folder,
    )
    assert result.returncode == 0, result.stderr
    numbers = json.loads((folder / "out" / "metrics.json").read_text())
    for arm in ("mine", "mine_refined"):
        assert numbers["ensemble"][arm]["velocity_rms_mps"]["north"]["value"] > 0.0
        assert arm in numbers["flight"]
        name = arm.replace("_", "[_ ,]*")
        assert re.search(rf"^\W*{name}\b.*\d\.\d", result.stdout, re.MULTILINE), f"no row for {arm}"
        assert re.search(name, (folder / "out" / "index.html").read_text())
    assert "mine/simple" in numbers["ensemble"]["improvement"]
    assert "mine_refined/hysteresis_refined" in numbers["ensemble"]["improvement"]
    assert "your model “mine” changes" in " ".join(result.stdout.partition("\n\n")[0].split("\n")[:3])
    assert (folder / "out" / "report.txt").read_text() in result.stdout
    assert result.stderr == ""  # a bar is for a terminal
    manifest = json.loads((folder / "out" / "manifest.json").read_text())
    assert {"hop.toml", "my.py", "worldwide.toml"} == set(manifest["inputs"])
    assert str(folder) not in (folder / "out" / "metrics.json").read_text()
    assert not (folder / "__pycache__").exists()


def test_model_of_the_readme_keeps_the_contract(repository: Path, folder: Path, capsys) -> None:
    (code,) = re.findall(r"```python\n(.*?class MyModel.*?)```", (repository / "README.md").read_text(), re.DOTALL)
    (folder / "readme.py").write_text(code)
    assert main(["check-model", "readme.py:MyModel"]) == 0
    assert "keeps the contract" in capsys.readouterr().out


@pytest.mark.parametrize("unbuffered", [False, True])
def test_reader_that_leaves_is_no_failure(folder: Path, unbuffered: bool) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    try:
        result = python("check-model", "simple", folder=folder, unbuffered=unbuffered, stdout=writing)
    finally:
        os.close(writing)
    assert (result.returncode, result.stderr) == (0, "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
@pytest.mark.parametrize("unbuffered", [False, True])
def test_text_that_cannot_be_written_is_a_full_disk(folder: Path, unbuffered: bool) -> None:
    with open("/dev/full", "w") as full:
        result = python("check-model", "simple", folder=folder, unbuffered=unbuffered, stdout=full)
    assert result.returncode == 4
    assert "No space left on device" in result.stderr
    assert result.stderr.count("\n") == 1
