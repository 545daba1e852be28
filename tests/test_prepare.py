"""What `make env` compiles: after it, no run of the flight report waits for a compiler, and all runs have one code."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest


@pytest.mark.slow
def test_after_it_a_flight_report_compiles_nothing(tmp_path: Path) -> None:
    def run(*words: str) -> set[Path]:
        environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
        subprocess.run([sys.executable, *words], check=True, env=environment, cwd=tmp_path, capture_output=True)
        return set((tmp_path / "cache").rglob("*.nbc"))

    prepared = run("-m", "ins_eval.prepare")
    block = "from ins_eval.ensemble import Plan, World, linear; linear.member(World(Plan(experiment='linear')), 1)"
    assert run("-c", block) == prepared
    report = ["flight-report", "--ensemble", "11", "--missions", "11", "--workers", "1", "-o", "flight", "--quiet"]
    assert run("-m", "ins_eval.cli", *report) == prepared


def powers(source: str) -> list[int]:
    """The lines of functions that numba compiles in which something is raised to a power."""
    functions = [one for one in ast.walk(ast.parse(source)) if isinstance(one, ast.FunctionDef)]
    compiled = [one for one in functions if any("numba.njit" in ast.unparse(by) for by in one.decorator_list)]
    assert bool(compiled) == ("@numba.njit" in source)
    inside = [one for function in compiled for one in ast.walk(function)]
    return [one.lineno for one in inside if isinstance(one, ast.BinOp | ast.AugAssign) and isinstance(one.op, ast.Pow)]


def test_no_machine_code_depends_on_what_was_compiled_before_it(repository: Path) -> None:
    """Numba compiles `x**2` once in a process, with the rounding that the first function around it asks for.

    So kernels write products: with powers, what `make env` compiles and what a first run compiles round differently.
    """
    sources = {path: path.read_text() for path in (repository / "ins_eval").rglob("*.py")}
    assert powers("import numba\n@numba.njit(cache=True)\ndef square(x):\n    return x**2\n") == [4]
    assert {path: lines for path, source in sources.items() if (lines := powers(source))} == {}
