"""What several test files need."""

from __future__ import annotations

from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def repository() -> Path:
    """The checkout."""
    return REPOSITORY


@pytest.fixture(scope="session")
def small_report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a flight report made from a few instruments."""
    from ins_eval.cli import main

    folder = tmp_path_factory.mktemp("reports") / "flight"
    assert not main(["flight-report", "--ensemble", "4", "--output", str(folder), "--quiet"])
    return folder
