"""The site of these pages: `make docs`."""

from __future__ import annotations

import importlib.metadata
import re
import sys
from html import escape
from pathlib import Path

from docutils import nodes

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
autodoc_preserve_defaults = True
autodoc_typehints = "description"
smartquotes = False
LONGEST_WHOLE = 12  # characters of a name that does not break


def raises_first(app, what, name, obj, options, lines: list[str]) -> None:
    """What is raised stands below the parameters, where napoleon would take it for one of them: put before them."""
    heads = [k for k, line in enumerate(lines) if set(line) == {"-"}]
    said = next((k for k, line in enumerate(lines) if line.startswith("Raises: ")), 0)
    if heads and said > heads[0]:
        lines[heads[0] - 1 : heads[0] - 1] = [lines.pop(said), ""]


def break_names(app, doctree, page: str) -> None:
    """A long name breaks after a dot, a stroke or a bracket; a short one, an option, and a number and its % do not."""
    for text in [one for one in doctree.findall(nodes.Text) if isinstance(one.parent, nodes.title)]:
        text.parent.replace(text, nodes.raw("", _broken(text), format="html"))
    for literal in list(doctree.findall(nodes.literal)):
        literal.replace_self(nodes.raw("", f'<code class="docutils literal">{_broken(literal)}</code>', format="html"))
    for text in [one for one in doctree.findall(nodes.Text) if " %" in one]:
        text.parent.replace(text, nodes.Text(re.sub(r"(?<=\d) (?=%)", "\u00a0", text)))


def _broken(node) -> str:
    return re.sub(r"\S+", _word, escape(node.astext(), quote=False))


def _word(found: re.Match[str]) -> str:
    word = found[0]
    if len(word) <= LONGEST_WHOLE or word.startswith("-"):
        return f'<span class="whole">{word}</span>'
    return re.sub(r"(?<=[\w\]])([._/])(?=\w\w)", r"\1<wbr>", word)


def without_fields(app, what, name, obj, skip, options) -> bool | None:
    """The fields of a tuple stand among its parameters."""
    return True if (getattr(obj, "__doc__", None) or "").startswith("Alias for field number") else None


def setup(app) -> None:
    app.connect("autodoc-skip-member", without_fields)
    app.connect("doctree-resolved", break_names)
    app.connect("autodoc-process-docstring", raises_first, priority=100)  # before napoleon
    app.connect("builder-inited", lambda app: draw_effects(Path(app.srcdir) / "effects"))
