"""What several test files need."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def repository() -> Path:
    """The checkout."""
    return REPOSITORY


@pytest.fixture(scope="session")
def small_report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a flight report made from a few instruments, once for all workers: it is only read."""
    from ins_eval.cli import main

    own = tmp_path_factory.getbasetemp()
    shared = own.parent if "PYTEST_XDIST_WORKER" in os.environ else own  # by the workers of this run
    folder = shared / "flight-report"
    with open(shared / "flight-report.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (shared / "flight-report.made").exists():
            assert not main(["flight-report", "--ensemble", "4", "--output", str(folder), "--quiet"])
            (shared / "flight-report.made").touch()
    return folder
