"""What `make env` compiles: after it, no run of the flight report waits for a compiler."""

from __future__ import annotations

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
