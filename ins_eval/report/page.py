"""The report as one self-contained HTML page, with the figures also as files beside it."""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape
from matplotlib.figure import Figure
from mpld3.urls import D3_LOCAL

from ins_eval.figures import style
from ins_eval.files import write_whole
from ins_eval.printable import printable
from ins_eval.report.content import GLANCE, Block, Numbers, Paragraph, Picture, Section, Table
from ins_eval.wording import in_symbols, unbroken

TEMPLATES = Path(__file__).parent / "templates"
FIGURES = (Path(D3_LOCAL), TEMPLATES / "figures.js")  # the library that zooms, and what binds a drawing to it
COMMAND = re.compile(r"\bins-eval (?:loop )?[a-z][a-z-]+|(?<![\w-])--[a-z][a-z-]+(?: \d+| \w+\.toml)?")
UNIT = re.compile(r"[^\s,;&]*/\(?°[^\s,;&]*")  # after whose stroke a line could end


def write_page(
    folder: str | Path,
    *,
    title: str,
    answer: str,
    sections: Sequence[Section],
    figures: Mapping[str, Figure],
    metrics: Mapping,
) -> Path:
    """Write ``index.html`` and ``figures/<name>.svg`` into `folder` and return the path of the page.

    The page asks for nothing outside itself, and may run no script but the one that comes with it. Below the answer
    stands the section `GLANCE`, where there is one, else the first figure of all. A figure that no section mentions is
    shown at the end; a section's mention of a figure that does not exist is left out. Raises StorageError.
    """
    folder = Path(folder)
    drawings = {name: style.svg(figure) for name, figure in figures.items()}
    html = render(title=title, answer=answer, sections=sections, drawings=drawings, metrics=metrics)
    for name, drawing in drawings.items():
        write_whole(folder / "figures" / f"{name}.svg", drawing.encode())
    return write_whole(folder / "index.html", html.encode())


def render(
    *,
    title: str,
    answer: str,
    sections: Sequence[Section],
    drawings: Mapping[str, str],
    metrics: Mapping,
) -> str:
    """The page as text; `drawings` name -> SVG."""
    environment = Environment(
        loader=PackageLoader("ins_eval.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=lambda shown: in_symbols(shown) if type(shown) is str else shown,
    )
    environment.tests.update(
        {
            kind.__name__.lower(): lambda block, kind=kind: isinstance(block, kind)
            for kind in (Paragraph, Table, Picture, Numbers)
        }
    )
    environment.filters["prose"] = prose
    mentioned = {block.name for section in sections for block in section.blocks if isinstance(block, Picture)}
    further = [Picture(name, name.replace("_", " ").capitalize() + ".") for name in drawings if name not in mentioned]
    if further:
        sections = [*sections, Section("Further figures", further)]
    inline = {name: Markup(inline_svg(name, drawing)) for name, drawing in drawings.items()}
    facts = [f"{key} {metrics[key]}" for key in ("profile", "seed") if key in metrics]
    glance = [section for section in sections if section.heading == GLANCE]
    sections = [section for section in sections if section.heading != GLANCE]
    blocks = [block for section in (*glance, *sections) for block in section.blocks]
    pictures = [block for block in blocks if isinstance(block, Picture) and block.name in inline]
    lead = next(iter(pictures), None)
    sections = [section for section in sections if any(_left(block, inline, lead) for block in section.blocks)]
    script = "\n".join(map(_text, (TEMPLATES / "page.js", *(FIGURES if inline else ()))))
    html = environment.get_template("page.html").render(
        title=title,
        answer=answer,
        sections=sections,
        drawings=inline,
        facts=facts,
        glance=[block for section in glance for block in section.blocks if not isinstance(block, Picture)],
        lead=lead,
        script=Markup(script),
        script_hash=Markup(_hash(script)),
    )
    return printable(html, keep="\n\t")


def _left(block: Block, drawn: Collection[str], lead: Picture | None) -> bool:
    """Whether a block is shown in its section: a picture that was not drawn is not, nor that of the first screen."""
    return not isinstance(block, Picture) or (block.name in drawn and (lead is None or block.name != lead.name))


def prose(text: str) -> Markup:
    """Words as HTML: units with their signs, no break within a number and its unit, commands and options as code."""
    words = UNIT.sub(r'<span class="unit">\g<0></span>', str(escape(unbroken(in_symbols(text)))))
    return Markup(COMMAND.sub(r"<code>\g<0></code>", words))


def _text(file: Path) -> str:
    return file.read_text(encoding="utf-8").strip()


def _hash(script: str) -> str:
    """How a policy names the one script that it allows."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"


def embedded(
    *, title: str, answer: str, sections: Sequence[Section], figures: Mapping[str, Figure], metrics: Mapping
) -> str:
    """The page as an element of another one, whose styles and those of this do not act on each other."""
    drawings = {name: style.svg(figure) for name, figure in figures.items()}
    html = render(title=title, answer=answer, sections=sections, drawings=drawings, metrics=metrics)
    return f'<iframe srcdoc="{escape(html)}" style="width: 100%; height: 50em; border: 0"></iframe>'


def inline_svg(name: str, drawing: str) -> str:
    """An SVG file made fit to stand among others in a page: no prologue or metadata, ids of its own."""
    drawing = drawing[drawing.index("<svg") :]
    drawing = re.sub(r"<metadata>.*?</metadata>", "", drawing, flags=re.DOTALL)
    drawing = re.sub(r"<style[^>]*>.*?</style>", "", drawing, flags=re.DOTALL)  # it would act on the whole page
    drawing = re.sub(r' xmlns(:\w+)?="[^"]*"', "", drawing)
    drawing = re.sub(r'\bid="([^"]+)"', rf'id="{name}-\1"', drawing)
    drawing = re.sub(r'href="#([^"]+)"', rf'href="#{name}-\1"', drawing)
    drawing = re.sub(r"url\(#([^)]+)\)", rf"url(#{name}-\1)", drawing)
    size = re.search(r'<svg[^>]* viewBox="[^"]*"', drawing)[0]
    named = re.sub(r' (width|height)="[^"]*"', "", size) + f' role="img" aria-labelledby="caption-{name}"'
    return drawing.replace(size, named, 1)
