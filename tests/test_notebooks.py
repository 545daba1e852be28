"""The notebooks run from beginning to end in an empty folder, and hold no outputs."""

from __future__ import annotations

from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

FOLDER = Path(__file__).resolve().parent.parent / "docs" / "notebooks"
NAMES = ("first-report", "own-recording", "own-model", "better-model", "ensemble")
QUICK = "first-report"  # runs in every suite


def test_these_are_all_notebooks_and_none_holds_an_output() -> None:
    assert {path.stem for path in FOLDER.iterdir()} == set(NAMES)
    for name in NAMES:
        cells = [cell for cell in opened(name).cells if cell.cell_type == "code"]
        assert [cell for cell in cells if cell.outputs or cell.execution_count is not None] == [], name


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name == QUICK else pytest.mark.slow) for name in NAMES]
)
def test_a_notebook_runs(name: str, tmp_path: Path) -> None:
    book = opened(name)
    NotebookClient(book, timeout=600, kernel_name="python3", resources={"metadata": {"path": str(tmp_path)}}).execute()
    shown = [output for cell in book.cells if cell.cell_type == "code" for output in cell.outputs]
    assert not [output for output in shown if output.get("name") == "stderr"]
    assert any("image/svg+xml" in output.get("data", {}) for output in shown)


def opened(name: str) -> nbformat.NotebookNode:
    return nbformat.read(FOLDER / f"{name}.ipynb", as_version=4)
