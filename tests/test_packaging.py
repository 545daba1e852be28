"""What a user installs: the wheel, the lock file and the targets of the Makefile."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tomllib
import zipfile
from importlib import metadata
from pathlib import Path

import pytest

from benchmark.runners.quick import whole_set
from ins_eval.report.results import made_with

PIP = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet"]


@pytest.fixture(scope="module")
def wheel(repository: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, built from the checkout."""
    folder = tmp_path_factory.mktemp("wheel")
    build = [*PIP, "wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", str(folder), str(repository)]
    subprocess.run(build, check=True, cwd=folder)
    (path,) = folder.glob("*.whl")
    return path


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder, far from the checkout, that holds the installed wheel."""
    folder = tmp_path_factory.mktemp("installed")
    subprocess.run([*PIP, "install", "--no-deps", "--target", str(folder), str(wheel)], check=True, cwd=folder)
    return folder


def run_installed(installed: Path, folder: Path, *arguments: str) -> str:
    """Run Python in `folder` with the installed wheel before everything else, and return what it prints."""
    environment = {**os.environ, "PYTHONPATH": str(installed)}
    command = [sys.executable, *arguments]
    result = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    return result.stdout


def files_under(folder: Path) -> set[str]:
    """Names of the files under a folder of the checkout as the wheel should hold them."""
    files = (path for path in folder.rglob("*") if path.is_file() and "__pycache__" not in path.parts)
    return {f"ins_eval/{path.relative_to(folder).as_posix()}" for path in files}


def test_the_wheel_holds_the_package_and_its_data_and_nothing_else(repository: Path, wheel: Path) -> None:
    held = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
    folder = repository / "trajectories"
    profiles = {f"ins_eval/trajectories/{path.relative_to(folder)}" for path in folder.rglob("*.toml")}
    assert held == files_under(repository / "ins_eval") | profiles
    assert "ins_eval/trajectories/climb-cruise-landing.toml" in held
    assert "ins_eval/trajectories/missions/worldwide.toml" in held
    assert any(re.fullmatch(r"ins_eval/accelerometer/presets/.*\.toml", name) for name in held)
    assert any(re.fullmatch(r"ins_eval/report/templates/.*", name) for name in held)
    assert {"ins_eval/gate.toml", "ins_eval/py.typed"} <= held


def test_the_installed_wheel_runs_outside_the_checkout(installed: Path, tmp_path: Path) -> None:
    where = run_installed(installed, tmp_path, "-c", "import ins_eval; print(ins_eval.__file__)")
    assert Path(where.strip()).is_relative_to(installed)
    assert "flight-report" in run_installed(installed, tmp_path, "-m", "ins_eval", "--help")


NOTEBOOK = """
import ins_eval as ie
result = ie.evaluate(ie.read("flight"))
print(result.to_frame()["velocity_rms_horizontal_mps"].to_json())
result.plot("position_error").savefig("position_error.png")
"""


@pytest.mark.slow
def test_the_installed_wheel_loads_navigates_and_scores_a_recording_in_five_lines(installed: Path, tmp_path: Path):
    assert len(NOTEBOOK.strip().splitlines()) < 5
    simulate = ("-m", "ins_eval.cli", "simulate", "flight", "--profile", "straight", "--rate", "10", "-o", "flight")
    run_installed(installed, tmp_path, *simulate)
    found = json.loads(run_installed(installed, tmp_path, "-c", NOTEBOOK))
    assert found["hysteresis"] < found["none"]
    assert (tmp_path / "position_error.png").stat().st_size > 10_000


def test_the_installed_gate_knows_what_was_committed(installed: Path, tmp_path: Path) -> None:
    """Its file is read before the profile, so where the profile is refused the file was found."""
    environment = {**os.environ, "PYTHONPATH": str(installed)}
    command = [sys.executable, "-m", "ins_eval.cli", "check-cep", "--profile", "no-such-flight"]
    result = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert result.returncode == 2
    assert result.stderr.startswith("ins-eval: no profile 'no-such-flight'"), result.stderr


@pytest.mark.slow
def test_the_installed_wheel_makes_the_flight_report(installed: Path, tmp_path: Path) -> None:
    command = str(installed / "bin" / "ins-eval")
    run_installed(installed, tmp_path, command, "flight-report", "--ensemble", "4", "--output", "flight", "--quiet")
    assert (tmp_path / "flight" / "index.html").stat().st_size > 0
    assert (tmp_path / "flight" / "metrics.json").stat().st_size > 0


def test_every_locked_requirement_has_a_hash_and_no_address(repository: Path) -> None:
    text = (repository / "requirements.lock").read_text()
    entries = re.split(r"\n(?=[A-Za-z0-9])", text.replace("\\\n", " ").strip())
    pinned = re.compile(r"[A-Za-z0-9._-]+==\S+( ; [^#]+?)?( +--hash=sha256:[0-9a-f]{64})+(\s+#.*)*")
    assert len(entries) > 20
    assert [entry for entry in entries if not pinned.fullmatch(entry.rstrip())] == []
    assert "://" not in text


def test_the_lock_holds_every_dependency(repository: Path) -> None:
    project = tomllib.loads((repository / "pyproject.toml").read_text())
    wanted = project["project"]["dependencies"] + project["dependency-groups"]["dev"]
    locked = re.findall(r"^([A-Za-z0-9._-]+)==", (repository / "requirements.lock").read_text(), re.MULTILINE)
    assert {re.match(r"[A-Za-z0-9_-]+", line)[0] for line in wanted} <= set(locked)


def test_the_version_is_the_newest_of_the_changelog(repository: Path) -> None:
    project = tomllib.loads((repository / "pyproject.toml").read_text())["project"]
    entries = re.findall(r"^## \[(\d+\.\d+\.\d+)\] - \d{4}-\d\d-\d\d$", (repository / "CHANGELOG.md").read_text(), re.M)
    assert entries[0] == project["version"]
    assert sorted(entries, key=lambda version: [int(part) for part in version.split(".")], reverse=True) == entries


def test_continuous_integration_runs_every_python_that_is_named(repository: Path) -> None:
    project = tomllib.loads((repository / "pyproject.toml").read_text())["project"]
    named = [one.rpartition(" ")[2] for one in project["classifiers"] if "Python ::" in one]
    workflow = (repository / ".github" / "workflows" / "ci.yml").read_text()
    (matrix,) = re.findall(r"^ +python-version: \[(.*)\]$", workflow, re.MULTILINE)
    assert re.findall(r'"([\d.]+)"', matrix) == named
    assert project["requires-python"] == f">={named[0]}"
    assert "python-version: ${{ matrix.python-version }}" in workflow


def test_make_alone_prints_every_target(repository: Path) -> None:
    makefile = (repository / "Makefile").read_text()
    targets = set(re.search(r"^\.PHONY: (.*)$", makefile, re.MULTILINE)[1].split())
    defined = set(re.findall(r"^([a-z-]+):", makefile, re.MULTILINE))
    printed = subprocess.run(["make", "-s"], cwd=repository, capture_output=True, text=True, check=True).stdout
    assert targets == defined
    assert set(re.findall(r"^  make ([a-z-]+) +\S", printed, re.MULTILINE)) == targets


def test_the_readme_names_the_two_commands(repository: Path) -> None:
    readme = (repository / "README.md").read_text()
    assert "make flight-report" in readme
    assert "make test" in readme


def test_what_the_readme_says_of_diagnose_is_what_was_counted(repository: Path) -> None:
    last = whole_set(json.loads((repository / "reports" / "concealed" / "log.json").read_text()))
    found = {key: line["found"] for key, line in last["found"].items()}
    alarms = [found[f"5b false alarms, {kind} nulls"] for kind in ("plain", "adversarial")]
    row = (
        "detected {} of {}, truth named or listed {} of {}, confidently wrong {} of {}, false alarms {} of {} |".format(
            *found["6a detected, D of at least 16"],
            *found["6b of the detected, truth named or listed"],
            *found["6c confidently wrong inside the vocabulary"],
            *map(sum, zip(*alarms, strict=True)),
        )
    )
    readme = (repository / "README.md").read_text()
    assert row in readme
    assert f"the last sealed set of {sum(last['cases'].values())} " in readme


def test_the_citation_is_of_this_version(repository: Path) -> None:
    project = tomllib.loads((repository / "pyproject.toml").read_text())["project"]
    citation = (repository / "CITATION.cff").read_text()
    assert f"\nversion: {project['version']}\n" in citation and f"\nlicense: {project['license']}\n" in citation


def test_a_manifest_leaves_out_an_extra_that_is_not_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    """A wheel comes without its extras: the flight report ended there with exit code 5."""
    monkeypatch.setattr(metadata, "requires", lambda _: ["numpy>=2.0", 'no-such-thing>=1; extra == "cluster"'])
    assert list(made_with()["versions"]) == ["python", "ins-eval", "numpy"]
