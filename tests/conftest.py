"""What several test files need."""

from __future__ import annotations

from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parent.parent


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Keep all tests of the small report in one worker, so that it is made once."""
    for item in items:
        if "small_report" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.xdist_group("small_report"))


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
