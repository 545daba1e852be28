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
html_static_path = []
exclude_patterns = ["_build"]
suppress_warnings = ["myst.xref_missing"]  # files of the repository beside the pages
myst_heading_anchors = 3
autodoc_typehints = "description"
smartquotes = False


def setup(app) -> None:
    app.connect("builder-inited", lambda app: draw_effects(Path(app.srcdir) / "effects"))
