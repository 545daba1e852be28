"""The page is one file that asks for nothing, escapes what it is given, and loses no figure; the text says the same."""

from __future__ import annotations

import re
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import pytest
from mpld3.urls import D3_LOCAL

from ins_eval.errors import StorageError
from ins_eval.figures import style
from ins_eval.report import page, text
from ins_eval.report.content import Number, Numbers, Paragraph, Picture, Section, Table
from ins_eval.report.flight import flight_content

LARGEST = 3e6  # bytes of a page
WIDTHS = (80, 100, 110)
VOID = {"meta", "link", "br", "hr", "img", "input"}
NASTY = "<script>alert('x')</script> & \"5 < 6\""


class Balance(HTMLParser):
    """Refuses a page whose tags do not close in order; collects ids and references."""

    def __init__(self):
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.references: list[str] = []

    def handle_starttag(self, tag, attributes):
        if tag not in VOID:
            self.open.append(tag)
        for name, value in attributes:
            if name == "id":
                self.ids.append(value)
            if name in ("href", "xlink:href", "src", "action", "data", "srcset", "poster"):
                self.references.append(value)
            self.references += re.findall(r"url\(([^)]*)\)", value or "")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


@pytest.fixture(scope="module")
def drawings(drawn):
    return {name: style.svg(figure) for name, figure in drawn.items()}


@pytest.fixture
def html(flight_metrics, drawings):
    answer, sections = flight_content(flight_metrics)
    return page.render(
        title="Flight report", answer=answer, sections=sections, drawings=drawings, metrics=flight_metrics
    )


def test_page_is_self_contained_and_well_formed(html):
    parser = Balance()
    parser.feed(html)
    assert parser.open == []
    assert len(parser.ids) == len(set(parser.ids)), "an id stands twice"
    inside = {f"#{name}" for name in parser.ids}
    assert {r for r in parser.references if r != "data:,"} <= inside
    library = Path(D3_LOCAL).read_text(encoding="utf-8").strip()  # in it are names of namespaces
    assert html.count(library) == 1
    html = html.replace(library, "")
    assert "http://" not in html and "https://" not in html and "@import" not in html


def test_a_page_is_small_and_without_figures_has_no_library(html, flight_metrics):
    answer, sections = flight_content(flight_metrics)
    without = page.render(title="t", answer=answer, sections=sections, drawings={}, metrics=flight_metrics)
    assert len(without.encode()) + Path(D3_LOCAL).stat().st_size < len(html.encode()) < LARGEST


def test_first_words_of_the_body_are_the_answer(html, flight_metrics):
    body = re.sub(r"<[^>]+>", " ", html[html.index("<body>") :]).replace("\u00a0", " ")
    assert body.split()[:4] == flight_content(flight_metrics)[0].split()[:4]


def test_a_figure_without_a_place_is_still_shown(html, drawn):
    assert html.count("<figure ") == html.count("<svg") == len(drawn)
    assert html.index("<h2>Further figures") < html.index('id="figure-activity"')


def test_units_have_their_signs_wherever_they_stand():
    plain = "1 ug/degC^2"
    numbers = Numbers([Number(plain, plain, plain)])
    sections = [Section("s", [numbers, Paragraph(plain, plain), Table(plain, (plain,), [(plain,)], plain)])]
    figure, _ = style.sheet(3.0, plain, plain)
    html = page.render(
        title=plain, answer=plain, sections=sections, drawings={"f": style.svg(style.as_written(figure))}, metrics={}
    )
    for shown in (html, text.render(plain, plain, sections)):
        assert "degC" not in shown and "^2" not in shown and shown.count("µg/°C²") >= 9


def test_commands_and_options_are_code_that_is_not_broken():
    said = str(page.prose("Add --restart-every 30 <b>; ins-eval diagnose says why, - and a--b."))
    assert said == (
        "Add <code>--restart-every 30</code> &lt;b&gt;; <code>ins-eval diagnose</code> says why, - and a--b."
    )


def test_no_line_ends_within_a_unit():
    said = str(page.prose("by 15 ug/degC, (deg/h)/(degC/min) or <km/h>"))
    assert said == (
        'by 15\u00a0<span class="unit">µg/°C</span>, <span class="unit">(°/h)/(°C/min)</span> or &lt;km/h&gt;'
    )


def test_everything_given_is_escaped():
    sections = [
        Section(NASTY, [Paragraph(NASTY, NASTY), Table(NASTY, (NASTY,), [(NASTY,)], NASTY), Picture("none", NASTY)])
    ]
    html = page.render(title=NASTY, answer=NASTY, sections=sections, drawings={}, metrics={"profile": NASTY})
    assert "<script>alert" not in html
    assert html.count("&lt;script&gt;") == 13  # one of them says what the table scrolls


def test_files_are_written_whole_and_the_same_each_time(tmp_path, drawn, flight_metrics):
    answer, sections = flight_content(flight_metrics)
    some = {name: drawn[name] for name in ("position_error", "error_budget")}
    arguments = {
        "title": "Flight report",
        "answer": answer,
        "sections": sections,
        "figures": some,
        "metrics": flight_metrics,
    }
    first, second = page.write_page(tmp_path / "a", **arguments), page.write_page(tmp_path / "b", **arguments)
    assert first == tmp_path / "a" / "index.html" and first.read_bytes() == second.read_bytes()
    names = sorted(str(p.relative_to(tmp_path / "a")) for p in (tmp_path / "a").rglob("*") if p.is_file())
    assert names == ["figures/error_budget.svg", "figures/position_error.svg", "index.html"]
    for name in names[:2]:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
        assert ElementTree.parse(tmp_path / "a" / name).getroot().tag.endswith("svg")


def test_a_folder_that_cannot_be_written_is_one_sentence(tmp_path):
    (tmp_path / "taken").write_text("a file, not a folder")
    with pytest.raises(StorageError, match=r"cannot be written .*choose another folder"):
        page.write_page(tmp_path / "taken", title="t", answer="a", sections=[], figures={}, metrics={})


@pytest.mark.parametrize("width", WIDTHS)
def test_text_keeps_its_width_and_says_what_the_page_says(flight_metrics, drawn, width):
    answer, sections = flight_content(flight_metrics)
    report = text.render("Flight report", answer, sections, figures=drawn, width=width)
    assert max(map(len, report.splitlines())) <= width
    flat = " ".join(report.split())
    assert flat.startswith(answer.split("\n")[0])
    for section in sections:
        assert section.heading in report
        for block in section.blocks:
            if isinstance(block, Paragraph):
                assert " ".join(f"{block.lead} {block.text}".split()) in flat
            if isinstance(block, Picture):
                assert f"[figure: figures/{block.name}.svg]" in report


def test_text_table_is_aligned_and_wraps_words_before_numbers():
    table = Table(
        "",
        ("a compensation with a long name", "value"),
        [("one two three four five six", "1.26 [1.18, 1.35]"), ("seven", "2")],
    )
    lines = text.format_table(table, width=34).splitlines()
    assert max(map(len, lines)) <= 34
    assert sum("1.26 [1.18, 1.35]" in line for line in lines) == 1
    assert lines[-1].endswith(" 2") and len(lines[-1]) == max(map(len, lines))


def test_figures_that_do_not_exist_are_not_mentioned(flight_metrics):
    answer, sections = flight_content(flight_metrics)
    assert "[figure" not in text.render("Flight report", answer, sections)
