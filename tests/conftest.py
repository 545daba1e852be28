"""What several test files need."""

from __future__ import annotations

from pathlib import Path

import pytest

MADE_ONCE = ("short_report", "finished_gate", "small_report")  # session fixtures that take long
REPOSITORY = Path(__file__).resolve().parent.parent


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """One worker for the tests of a file, and for all tests of what is made once (``--dist loadgroup``)."""
    for item in items:
        needed = getattr(item, "fixturenames", ())
        group = next((name for name in MADE_ONCE if name in needed), item.nodeid.partition("::")[0])
        item.add_marker(pytest.mark.xdist_group(group))


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
