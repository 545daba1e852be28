"""The site of the pages: it is built without a warning and asks for nothing outside itself."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ASKS = re.compile(
    r"<(?:script|img|iframe|source)\b[^>]*\bsrc=\"(https?:)?//|<link\b[^>]*rel=\"stylesheet\"[^>]*href=\"(https?:)?//"
)


@pytest.mark.slow
def test_the_site_is_built_and_asks_for_nothing_outside(repository: Path, tmp_path: Path) -> None:
    source, site = tmp_path / "docs", tmp_path / "site"
    shutil.copytree(repository / "docs", source, ignore=shutil.ignore_patterns("effects", "_build"))
    build = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html", str(source), str(site)]
    done = subprocess.run(build, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    pages = list(site.rglob("*.html"))
    assert {"index.html", "faq.html", "methods.html", "api.html"} <= {page.name for page in pages}
    assert [page.name for page in pages if ASKS.search(page.read_text(encoding="utf-8"))] == []
    assert [page.name for page in pages if "&lt;code" in page.read_text(encoding="utf-8")] == []
    assert "accelerometer.bias_creep" in (site / "effects" / "index.html").read_text(encoding="utf-8")
    assert not (site / "effects" / "accelerometer.vibration_rectification.html").exists(), "a flight without vibration"
