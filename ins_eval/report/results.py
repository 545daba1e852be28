"""A finished report on disk and on the terminal: numbers, page, text."""

from __future__ import annotations

import importlib.metadata
import platform
import re
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from ins_eval.files import write_whole
from ins_eval.report import text
from ins_eval.report.content import Section
from ins_eval.report.json_file import as_json
from ins_eval.report.page import write_page


def write_results(
    output: Path,
    title: str,
    answer: str,
    sections: Sequence[Section],
    metrics: Mapping[str, Any],
    figures: Mapping[str, Figure],
    quiet: bool,
) -> None:
    """``metrics.json``, the page with its figures and the same as text into `output`; the text on the terminal."""
    write_whole(output / "metrics.json", as_json(metrics))
    page = write_page(output, title=title, answer=answer, sections=sections, figures=figures, metrics=metrics)
    words = text.render(title, answer, sections, figures=figures)
    write_whole(output / "report.txt", words.encode())
    if not quiet:
        print(words)
        print(f"page: {page}")


def made_with() -> dict[str, Any]:
    """Versions of what is installed of the requirements, extras among them, and the machine, for a manifest."""
    needed = [re.split(r"[^\w.-]", one)[0] for one in importlib.metadata.requires("ins-eval") or ()]
    versions = {"python": platform.python_version()}
    for name in ("ins-eval", *needed):
        with suppress(importlib.metadata.PackageNotFoundError):  # an extra that this installation has not
            versions[name] = importlib.metadata.version(name)
    return {
        "versions": versions,
        "machine": {"architecture": platform.machine(), "system": platform.system(), "byte_order": sys.byteorder},
    }
