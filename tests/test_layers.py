"""The directions of imports hold, and the check that says so can fail."""

from __future__ import annotations

import shutil
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path

import grimp
import pytest

ROOMS_OF_A_DIAGNOSIS = ("ins_eval.diagnosis", "ins_eval.estimation", "ins_eval.error_model", "ins_eval.policy")
LONGEST_CHAIN = 9  # of modules, each of which imports the next
LINT = "from importlinter.cli import lint_imports_command; lint_imports_command()"


def lint_imports(folder: Path, contract: str) -> subprocess.CompletedProcess[str]:
    """Check the package in `folder` against one contract of its pyproject.toml."""
    command = [sys.executable, "-c", LINT, "--no-logo", "--no-cache", "--contract", contract]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


@pytest.fixture
def copy(repository: Path, tmp_path: Path) -> Path:
    """A copy of the package that a test may spoil."""
    for package in ("ins_eval", "benchmark"):
        shutil.copytree(repository / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(repository / "pyproject.toml", tmp_path)
    return tmp_path


def add_import(folder: Path, importer: str, imported: str) -> None:
    """Let one module of the copy import another."""
    path = folder / "ins_eval" / importer
    path = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    path.write_text(f"{path.read_text()}\nimport ins_eval.{imported}\n")


@pytest.mark.parametrize("contract", ["layers", "rooms", "wall", "blind", "independent", "worlds"])
def test_the_package_keeps_its_contracts(repository: Path, contract: str) -> None:
    result = lint_imports(repository, contract)
    assert result.returncode == 0, result.stdout
    assert "1 kept, 0 broken" in result.stdout


@pytest.mark.parametrize("estimator", ["calibration", "compensation"])
@pytest.mark.parametrize("truth", ["accelerometer", "gyro", "imu", "laboratory"])
def test_the_wall_refuses_an_estimator_that_sees_the_truth(copy: Path, estimator: str, truth: str) -> None:
    add_import(copy, estimator, truth)
    result = lint_imports(copy, "wall")
    assert result.returncode == 1, result.stdout
    assert f"ins_eval.{estimator} is not allowed to import ins_eval.{truth}" in result.stdout


def test_the_wall_refuses_a_way_round(copy: Path) -> None:
    add_import(copy, "compensation", "units")
    add_import(copy, "units", "imu")
    result = lint_imports(copy, "wall")
    assert result.returncode == 1, result.stdout
    assert "ins_eval.compensation is not allowed to import ins_eval.imu" in result.stdout
    assert "ins_eval.units -> ins_eval.imu" in result.stdout


def test_the_layers_refuse_an_import_upwards(copy: Path) -> None:
    add_import(copy, "earth", "strapdown")
    result = lint_imports(copy, "layers")
    assert result.returncode == 1, result.stdout
    assert "ins_eval.earth is not allowed to import ins_eval.strapdown" in result.stdout


@pytest.mark.parametrize("importer", ["commands", "report", "analysis"])
def test_only_the_command_line_enters_the_studies(copy: Path, importer: str) -> None:
    add_import(copy, importer, "studies.papers")
    result = lint_imports(copy, "layers")
    assert result.returncode == 1, result.stdout
    assert f"ins_eval.{importer} is not allowed to import ins_eval.studies" in result.stdout


@pytest.mark.parametrize("room", ["worlds", "scores"])
def test_what_examines_the_tool_may_not_use_it(copy: Path, room: str) -> None:
    path = copy / "benchmark" / room / "__init__.py"
    path.write_text(f"{path.read_text()}\nimport ins_eval.units\n")
    result = lint_imports(copy, "worlds")
    assert result.returncode == 1, result.stdout
    assert f"benchmark.{room} is not allowed to import ins_eval" in result.stdout


def test_the_layers_refuse_a_module_without_a_place(copy: Path) -> None:
    (copy / "ins_eval" / "nowhere.py").write_text('"""A module that no layer names."""\n')
    result = lint_imports(copy, "layers")
    assert result.returncode == 1, result.stdout
    assert "nowhere" in result.stdout


def imports(annotations: bool) -> dict[str, set[str]]:
    """Every module of the package with those that it imports; with what only its `annotations` need, or without."""
    graph = grimp.build_graph("ins_eval", exclude_type_checking_imports=not annotations, cache_dir=None)
    return {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}


def test_no_module_imports_itself_by_a_way_round() -> None:
    """Not even for annotations."""
    TopologicalSorter(imports(annotations=True)).prepare()  # raises CycleError


def test_no_chain_of_imports_in_a_diagnosis_is_long() -> None:
    found, length = imports(annotations=False), {}
    for module in TopologicalSorter(found).static_order():
        if module.startswith(ROOMS_OF_A_DIAGNOSIS):
            length[module] = 1 + max((length.get(other, 0) for other in found[module]), default=0)
    assert 3 < max(length.values()) <= LONGEST_CHAIN
