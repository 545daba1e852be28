"""The site of these pages: `make docs`."""

from __future__ import annotations

import importlib.metadata
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
from effect_figures import draw_effects

project = "ins_eval"
release = importlib.metadata.version("ins-eval")
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
html_theme = "furo"
html_title = f"ins_eval {release}"
html_static_path = ["site.css"]
html_css_files = ["site.css"]
html_show_copyright = False
exclude_patterns = ["_build"]
suppress_warnings = ["myst.xref_missing"]  # files of the repository beside the pages
myst_heading_anchors = 3
autodoc_typehints = "description"
smartquotes = False


def raises_first(app, what, name, obj, options, lines: list[str]) -> None:
    """What is raised stands below the parameters, where napoleon would take it for one of them: put before them."""
    heads = [k for k, line in enumerate(lines) if set(line) == {"-"}]
    said = next((k for k, line in enumerate(lines) if line.startswith("Raises: ")), 0)
    if heads and said > heads[0]:
        lines[heads[0] - 1 : heads[0] - 1] = [lines.pop(said), ""]


def setup(app) -> None:
    app.connect("autodoc-process-docstring", raises_first, priority=100)  # before napoleon
    app.connect("builder-inited", lambda app: draw_effects(Path(app.srcdir) / "effects"))
