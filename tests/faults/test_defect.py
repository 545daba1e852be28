"""A defect of ours: exit code 5, one sentence, and the details in a file."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path

import pytest

from ins_eval.commands import check_model


@pytest.fixture
def broken(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A verb that fails as no verb should, and where the details go."""

    def run(**_: object) -> int:
        raise RuntimeError("the impossible happened")

    monkeypatch.setattr(check_model, "run", run)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def test_the_details_are_kept_in_a_file(broken: Path, refused) -> None:
    sentence = refused(["check-model", "simple"], 5)
    assert "RuntimeError: the impossible happened" in sentence
    file = Path(re.search(r"the details are in (\S+\.txt)", sentence)[1])
    assert file.parent == broken
    details = file.read_text()
    assert "Traceback" in details
    assert "the impossible happened" in details
    assert "test_defect.py" in details


def test_details_that_cannot_be_kept_hide_nothing(broken: Path, refused, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(broken / "gone"))
    assert "RuntimeError: the impossible happened" in refused(["check-model", "simple"], 5)
