"""What Paper A's tests share with those of the reports."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

_report = runpy.run_path(str(Path(__file__).parents[2] / "report" / "conftest.py"))


@pytest.fixture
def flight_metrics() -> dict:
    """Invented metrics of a flight."""
    return _report["make_flight_metrics"]()
