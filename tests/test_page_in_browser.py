"""The report page, opened in a real headless browser, asks the network for nothing and has no complaint."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from dataclasses import dataclass
from html import unescape
from html.parser import HTMLParser
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
from matplotlib.figure import Figure

from ins_eval.figures import style
from ins_eval.figures.side_by_side import Value, side_by_side
from ins_eval.report.content import Number, Paragraph, Picture, Section, Table, at_a_glance
from ins_eval.report.page import write_page as write_report

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
BROWSER = next((path for name in BROWSERS if (path := shutil.which(name))), None)
FLAGS = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--disable-dev-shm-usage",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--host-resolver-rules=MAP * ~NOTFOUND",  # nothing that the browser itself wants leaves the machine
    "--enable-logging=stderr",
    "--virtual-time-budget=5000",
    "--dump-dom",
]
BROWSER_LIMIT_S = 120
PIXEL = 1.0  # of a figure, within which a browser reports where a click was

needs_browser = pytest.mark.skipif(BROWSER is None, reason=f"no browser here (looked for {', '.join(BROWSERS)})")


@dataclass(frozen=True)
class Visit:
    """What the browser showed, asked for and complained about when it opened a page."""

    document: str
    requests: list[str]
    console: list[str]


def page_requests(netlog: dict) -> list[str]:
    """URLs that the page asked for; what the browser asks for on its own account has no origin as initiator."""
    start = netlog["constants"]["logEventTypes"]["URL_REQUEST_START_JOB"]
    jobs = [event.get("params", {}) for event in netlog["events"] if event["type"] == start]
    return [job["url"] for job in jobs if "url" in job and job["initiator"] != "not an origin"]


def open_page(page: Path, scratch: Path, *flags: str) -> Visit:
    """Open a file in the browser and wait until its timers of the first seconds have run."""
    log = scratch / "netlog.json"
    places = [f"--user-data-dir={scratch / 'profile'}", f"--log-net-log={log}"]
    command = [BROWSER, *FLAGS, *flags, *places, page.as_uri()]
    result = subprocess.run(command, capture_output=True, text=True, check=True, timeout=BROWSER_LIMIT_S)
    console = re.findall(r":CONSOLE[:(]\d+\)?\] (.*)", result.stderr)
    return Visit(result.stdout, page_requests(json.loads(log.read_text())), console)


class References(HTMLParser):
    """What a page loads by itself (`loaded`) and what its links lead to (`linked`)."""

    LOADING = frozenset({"src", "srcset", "href", "xlink:href", "data", "poster", "background", "action", "manifest"})

    def __init__(self) -> None:
        super().__init__()
        self.loaded: list[str] = []
        self.linked: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if name in self.LOADING:
                (self.linked if tag == "a" else self.loaded).append(value or "")
            elif name == "style":
                self.handle_data(value or "")

    def handle_data(self, data: str) -> None:
        self.loaded += re.findall(r"(?:url\(|@import)\s*['\"]?([^'\")\s;]+)", data)


def references(document: str) -> References:
    """Read the references of an HTML document."""
    reader = References()
    reader.feed(document)
    reader.close()
    return reader


def not_inline(document: str) -> list[str]:
    """References that make a browser open anything but the page itself."""
    return [where for where in references(document).loaded if not where.startswith(("data:", "#"))]


CONTROLS = {
    "image": '<img src="http://127.0.0.1:9/x.png">',
    "style": "<style>body { background: url(http://127.0.0.1:9/x.png) }</style>",
    "fetch": '<script>fetch("http://127.0.0.1:9/x.json").catch(() => 0)</script>',
    "late fetch": '<script>setTimeout(() => fetch("http://127.0.0.1:9/x.json").catch(() => 0), 3000)</script>',
    "name": '<script src="https://example.org/x.js"></script>',
}
COMPLAINTS = {
    "throw": ('<script>throw new Error("broken")</script>', "Uncaught Error: broken"),
    "late throw": ('<script>setTimeout(() => { throw new Error("broken") }, 3000)</script>', "Uncaught Error: broken"),
    "promise": ('<script>Promise.reject(new Error("broken"))</script>', "Uncaught (in promise) Error: broken"),
    "console": ('<script>console.error("broken")</script>', "broken"),
}


def write_page(folder: Path, body: str) -> Path:
    """Write a small page."""
    page = folder / "control page.html"
    page.write_text(f"<!doctype html><html><head><title>control</title></head><body>{body}</body></html>")
    return page


@needs_browser
def test_a_clean_page_is_silent(tmp_path: Path) -> None:
    image = '<img src="data:image/gif;base64,R0lGODlhAQABAIAAAAAAAP///yH5BAEAAAAALAAAAAABAAEAAAIBRAA7">'
    visit = open_page(write_page(tmp_path, image), tmp_path)
    assert "<title>control</title>" in visit.document
    assert visit.requests == []
    assert visit.console == []


@needs_browser
@pytest.mark.parametrize("name", CONTROLS)
def test_a_request_is_seen(tmp_path: Path, name: str) -> None:
    visit = open_page(write_page(tmp_path, CONTROLS[name]), tmp_path)
    (url,) = visit.requests
    assert url in CONTROLS[name]


@needs_browser
@pytest.mark.parametrize("name", COMPLAINTS)
def test_a_complaint_is_seen(tmp_path: Path, name: str) -> None:
    body, message = COMPLAINTS[name]
    visit = open_page(write_page(tmp_path, body), tmp_path)
    (line,) = visit.console
    assert message in line


@pytest.mark.parametrize(
    "body",
    [
        '<img src="figures/path.png">',
        '<img srcset="https://example.org/x.png 2x">',
        '<link rel="stylesheet" href="page.css">',
        '<svg><image xlink:href="//example.org/x.png"/></svg>',
        "<p style=\"background: url('x.png')\"></p>",
        "<style>@import 'x.css';</style>",
    ],
)
def test_a_reference_outwards_is_seen(body: str) -> None:
    assert len(not_inline(body)) == 1


def test_references_within_the_page_are_allowed() -> None:
    assert not_inline('<a href="#top">top</a><a href="figures/path.svg">figure</a><svg><use href="#mark"/></svg>') == []


@needs_browser
def test_the_report_asks_for_nothing_and_shows_no_error(small_report: Path, tmp_path: Path) -> None:
    alone = tmp_path / "index.html"
    shutil.copy(small_report / "index.html", alone)
    visit = open_page(alone, tmp_path)
    assert "</html>" in visit.document
    assert visit.requests == []
    assert visit.console == []


ACTS = """<script>
const field = document.querySelector(".filter"), rows = [...field.nextElementSibling.querySelectorAll("tbody tr")];
field.value = rows[0].cells[0].textContent;
field.dispatchEvent(new Event("input"));
const count = (all) => document.querySelectorAll(all).length;
document.querySelector("[data-open]").click();
const frame = document.querySelector(".wide"), svg = frame.querySelector("svg");
const sheet = svg.querySelector("g"), view = svg.getAttribute("viewBox").split(" ").map(Number);
const box = () => {
  const { a, e, f } = sheet.transform.baseVal.consolidate()?.matrix ?? new DOMMatrix();
  return [(view[0] - e) / a, (view[1] - f) / a, view[2] / a, view[3] / a].join(" ");
};
const at = (x, y) => {
  const { left, top, width, height } = svg.getBoundingClientRect();
  return { clientX: left + x * width, clientY: top + y * height, bubbles: true, cancelable: true, view: window };
};
const wheel = (how) => svg.dispatchEvent(new WheelEvent("wheel", { ...at(0.5, 0.5), deltaY: -100, ...how }));
const drag = (x, y) => {
  svg.dispatchEvent(new MouseEvent("mousedown", at(0.5, 0.5)));
  window.dispatchEvent(new MouseEvent("mousemove", at(x, y)));
  window.dispatchEvent(new MouseEvent("mouseup", at(x, y)));
};
const touch = (kind, places, changed = places) => {
  const made = ([identifier, x, y]) => new Touch({ identifier, target: svg, ...at(x, y) });
  const event = new TouchEvent(kind, {
    touches: places.map(made), changedTouches: changed.map(made), bubbles: true, cancelable: true,
  });
  return svg.dispatchEvent(event);
};
const whole = box(), press = (key) => frame.dispatchEvent(new KeyboardEvent("keydown", { key }));
press("ArrowLeft");
const unmoved = box();
press("+");
press("+");
const near = box();
press("ArrowRight");
const right = box();
press("0");
const back = box();
const { right: clientX, bottom: clientY } = svg.getBoundingClientRect();
svg.dispatchEvent(new MouseEvent("dblclick", { clientX, clientY, bubbles: true }));
const corner = box(), [nearer, , all] = frame.previousElementSibling.querySelectorAll("button");
all.click();
const shown = box();
nearer.click();
const clicked = box();
all.click();
drag(0.2, 0.5);
const held = wheel({}) && box(), turned = !wheel({ ctrlKey: true }) && box();
drag(0.75, 0.5);
const dragged = box();
press("0");
touch("touchstart", [[1, 0.4, 0.5]]);
const scrolled = touch("touchmove", [[1, 0.4, 0.6]]) && box();
touch("touchstart", [[1, 0.4, 0.5], [2, 0.6, 0.5]], [[2, 0.6, 0.5]]);
touch("touchmove", [[1, 0.3, 0.5], [2, 0.7, 0.5]]);
const pinched = box();
touch("touchend", [], [[1, 0.3, 0.5], [2, 0.7, 0.5]]);
dispatchEvent(new Event("beforeprint"));
document.body.dataset.boxes = [whole, unmoved, near, right, back, corner, shown, clicked, held, turned, dragged,
  scrolled, pinched, box()].join(";");
document.title = [rows.length, rows.filter((row) => !row.hidden).length,
  count("details") - count("details[open]")].join(" ");
</script>"""


def check_zoom(document: str) -> None:
    """Two steps of + are 2.25 times nearer about the middle, an arrow moves, 0 shows all, a double-click goes there.

    Buttons do as + and 0 do. A wheel turns nearer with Ctrl alone, what is nearer is dragged, two fingers pinch, and
    one scrolls the page. Paper shows all.
    """
    (boxes,) = re.findall(r'data-boxes="([^"]*)"', document)
    whole, unmoved, near, right, back, corner, shown, nearer, held, turned, dragged, scrolled, pinched, printed = (
        [float(x) for x in box.split()] for box in boxes.split(";")
    )
    assert whole == unmoved == pytest.approx(back)
    assert whole == pytest.approx(shown)
    assert nearer[2] == pytest.approx(whole[2] / 1.5)
    x, y, width, height = whole
    middle = [x + width * (1 - 1 / 2.25) / 2, y + height * (1 - 1 / 2.25) / 2, width / 2.25, height / 2.25]
    assert near == pytest.approx(middle)
    assert right[0] == pytest.approx(near[0] + 0.2 * near[2]) and right[1:] == near[1:]
    assert corner == pytest.approx([x + width / 2, y + height / 2, width / 2, height / 2], abs=PIXEL)
    assert whole == held == scrolled == printed
    (_, _, across, down) = turned
    assert across < 0.8 * width
    middle = [x + (width - across) / 2, y + (height - down) / 2, across, down]
    assert turned == pytest.approx(middle, abs=PIXEL)
    assert dragged == pytest.approx([max(turned[0] - across / 4, 0.0), *turned[1:]], abs=PIXEL)
    assert pinched[2] == pytest.approx(width / 2, rel=0.02)


@needs_browser
def test_tables_filter_sections_open_and_figures_zoom(small_report: Path, tmp_path: Path) -> None:
    """A script that the policy of the page would refuse clicks its buttons in a copy without it."""
    document = (small_report / "index.html").read_text()
    document = re.sub(r"script-src [^\"]*", "script-src 'unsafe-inline'", document, count=1)
    page = tmp_path / "acted.html"
    page.write_text(document.replace("</body>", f"{ACTS}</body>"))
    visit = open_page(page, tmp_path, "--touch-events=enabled")
    check_zoom(visit.document)
    (title,) = re.findall(r"<title>(.*?)</title>", visit.document)
    rows, shown, closed = map(int, title.split())
    assert 0 < shown < rows
    assert closed == 0
    assert (visit.requests, visit.console) == ([], [])


READINGS = """<script>
const frames = [...document.querySelectorAll(".wide")], said = [];
const at = (frame, across) => {
  const svg = frame.querySelector("svg"), box = svg.querySelector("[data-box]").dataset.box;
  const [left, top, width, height] = box.split(" ").map(Number);
  return new DOMPoint(left + across * width, top + height / 2).matrixTransform(svg.getScreenCTM());
};
const hover = (frame, across) => {
  const { x, y } = at(frame, across);
  frame.querySelector("svg").dispatchEvent(new PointerEvent("pointermove", { clientX: x, clientY: y, bubbles: true }));
  said.push(frame.querySelector("output").textContent);
};
const transform = (frame) => frame.querySelector("svg > g").getAttribute("transform");
const press = (frame, key, shiftKey = false) => frame.dispatchEvent(new KeyboardEvent("keydown", { key, shiftKey }));
const ticks = (frame) => [...frame.querySelectorAll("[id*='axis_1'] g:not([style*='none']) > g > text")]
  .filter((one) => one.checkVisibility()).map((one) => one.textContent).join(" ");
frames.slice(0, 3).forEach((frame) => hover(frame, 0.5));
said.push(ticks(frames[1]));
const { x, y } = at(frames[0], 0.5);
frames[0].querySelector("svg").dispatchEvent(new MouseEvent("dblclick", { clientX: x, clientY: y, bubbles: true }));
frames.slice(0, 2).forEach((frame) => { hover(frame, 0.5); said.push(ticks(frame)); });
press(frames[1], "ArrowRight");
hover(frames[0], 0.5);
press(frames[1], "0");
hover(frames[0], 0.5);
press(frames[0], "ArrowRight", true);
said.push(frames[0].querySelector("output").textContent);
press(frames[0], "ArrowRight", true);
press(frames[3], "ArrowDown", true);
said.push(frames[0].querySelector("output").textContent, transform(frames[2]));
said.push(frames[3].querySelector("output").textContent);
for (const kind of ["pointerdown", "pointerleave"]) {
  const { x: clientX, y: clientY } = at(frames[0], 0.5), svg = frames[0].querySelector("svg");
  svg.dispatchEvent(new PointerEvent(kind, { clientX, clientY, pointerType: "touch" }));
}
said.push(frames[0].querySelector("output").textContent);
document.body.dataset.said = said.join(";");
</script>"""


def drawn(title: str, x: list[float], unit: str, **axes: str) -> Figure:
    """One curve of y = 2 x."""
    figure, ax = style.sheet(3.0, title, "")
    ax.plot(x, [2.0 * one for one in x], label="line")
    ax.set(xlim=(x[0], x[-1]), ylim=(2.0 * x[0], 2.0 * x[-1]), ylabel=f"error [{unit}]", **axes)
    return figure


SORTS = """<script>
const body = document.querySelector("table").tBodies[0], [name, value] = document.querySelectorAll("th button");
const said = [name, value, value].map((button) => {
  button.click();
  return [...body.rows].map((row) => row.textContent.trim()).join(",");
});
said.push(value.parentNode.ariaSort, name.parentNode.ariaSort);
document.body.dataset.said = said.join(";");
</script>"""


@needs_browser
def test_a_long_table_is_sorted_by_size_and_its_remarks_go_along(tmp_path: Path) -> None:
    values = ["–", "−2.5", "10 [9, 11]", "3.1", *map(str, range(20, 28))]
    rows = [(chr(ord("m") - k), value) for k, value in enumerate(values)]
    remarks = [Paragraph(f"of {name}") for name, _ in rows]
    sections = [Section("All", [Table("", ("name", "value"), rows, remarks=remarks)])]
    page = write_report(tmp_path, title="t", answer="a", sections=sections, figures={}, metrics={})
    document = re.sub(r"script-src [^\"]*", "script-src 'unsafe-inline'", page.read_text(), count=1)
    page.write_text(document.replace("</body>", f"{SORTS}</body>"))
    visit = open_page(page, tmp_path)
    (said,) = re.findall(r'data-said="([^"]*)"', visit.document)
    by_name, up, down, of_value, of_name = unescape(said).replace("\u00a0", " ").split(";")
    shown = {name: f"{name}{value},of {name}" for name, value in rows}
    assert by_name == ",".join(shown[name] for name in sorted(shown))
    ordered = ["l", "j", "k", *(name for name, _ in rows[4:]), "m"]  # -2.5, 3.1, 10, 20 and on, what has no number
    assert up == ",".join(shown[name] for name in ordered)
    assert down == ",".join(shown[name] for name in reversed(ordered))
    assert (of_value, of_name) == ("descending", "")
    assert (visit.requests, visit.console) == ([], [])


@needs_browser
def test_figures_over_the_same_time_zoom_together_and_tell_their_values(tmp_path: Path) -> None:
    """The second begins later; the third is over logarithms and zooms alone."""
    figures = {
        "one": drawn("One", [0.0, 40.0, 100.0], "m", xlabel="time [s]"),
        "two": drawn("Two", [20.0, 60.0, 100.0], "m/s", xlabel="time [s]"),
        "three": drawn("Three", [1.0, 10.0, 100.0], "1", xlabel="averaging time [s]", xscale="log", yscale="log"),
    }
    figures["four"] = side_by_side(
        values=[Value("first", 1.0, of="one"), Value("second", 2.0, of="one")], title="Four", rows="row", axis="x [m/s]"
    )
    page = write_report(tmp_path, title="t", answer="a", sections=[], figures=figures, metrics={})
    document = re.sub(r"script-src [^\"]*", "script-src 'unsafe-inline'", page.read_text(), count=1)
    page.write_text(document.replace("</body>", f"{READINGS}</body>").replace("<details>", "<details open>"))
    visit = open_page(page, tmp_path)
    (said,) = re.findall(r'data-said="([^"]*)"', visit.document)
    assert said.split(";") == [
        *("line: 50 s, 100 m", "line: 60.0 s, 120 m/s", "line: 10 s, error 20", "20 30 40 50 60 70 80 90 100"),
        *("line: 50.0 s, 100 m", "30 40 50 60 70"),  # from 25 to 75 s, so with one digit more
        *("line: 50.3 s, 101 m/s", "30 40 50 60 70"),  # the nearest point: the curve passes below the pointer
        *("line: 59.7 s, 119 m", "line: 50 s, 100 m"),  # the first moved with the second, and came back
        *("line: 0 s, 0 m", "line: 40 s, 80 m", ""),
        "one: 2.00 m/s",  # rows have names, not numbers
        "line: 50 s, 100 m",  # stays when the finger is lifted
    ]
    assert (visit.requests, visit.console) == ([], [])


SHOWN = """<script>
const [frame] = document.querySelectorAll(".scroll"), verdict = frame.querySelector("tbody td:last-child");
const seen = verdict.getBoundingClientRect().right <= innerWidth && frame.scrollWidth <= frame.clientWidth;
const label = getComputedStyle(verdict, "::before").content;
document.body.dataset.said = [innerWidth, seen, label, frame.querySelectorAll("th button").length].join(";");
</script>"""


@needs_browser
def test_on_a_phone_a_statement_is_a_card_that_shows_its_verdict(tmp_path: Path) -> None:
    """A cell of the header without a name has no button to sort by it."""
    words = "a statement of so many words that they fill more than one line of a narrow page"
    rows = [(words, "10.5 [9.1, 12.0]", "10.7 [9.9, 11.5]", f"reproduced {k}") for k in range(12)]
    table = Table(
        "", ("", "printed", "ours", "verdict"), rows, remarks=[Paragraph(words, "A1")] * 12, tones=["good"] * 12
    )
    page = write_report(tmp_path, title="t", answer="a", sections=[Section("All", [table])], figures={}, metrics={})
    document = re.sub(r"script-src [^\"]*", "script-src 'unsafe-inline'", page.read_text(), count=1)
    page.write_text(document.replace("</body>", f"{SHOWN}</body>"))
    visit = open_page(page, tmp_path, "--window-size=400,900")
    (said,) = re.findall(r'data-said="([^"]*)"', visit.document)
    width, seen, label, buttons = unescape(said).split(";")
    assert int(width) < 640, "the browser's window is no narrower"
    assert (seen, label.strip('"').strip(), buttons) == ("true", "verdict", "3")


def serious(page: Path, scratch: Path, *flags: str) -> list[str]:
    """What axe-core finds serious or critical in a page whose sections are open: rule and first element."""
    script = (files("axe_core_python") / "axe.min.js").read_text(encoding="utf-8")
    document = re.sub(r"script-src [^\"]*", "script-src 'unsafe-inline'", page.read_text(), count=1)
    examined = scratch / "examined.html"
    examined.write_text(
        document.replace("<details>", "<details open>").replace("</body>", f"<script>{script}</script>{EXAMINE}</body>")
    )
    (found,) = re.findall(r'data-found="([^"]*)"', open_page(examined, scratch, *flags).document)
    return [one for one in unescape(found).split("\n") if one]


EXAMINE = """<script>axe.run().then(({ violations }) => {
  document.body.dataset.found = violations.filter(({ impact }) => impact === "serious" || impact === "critical")
    .map(({ id, nodes }) => `${id}: ${nodes[0].html.slice(0, 200)}`).join("\\n");
});</script>"""
DARK = "--blink-settings=preferredColorScheme=0"
needs_axe = pytest.mark.skipif(find_spec("axe_core_python") is None, reason="no axe-core here: make env")


@needs_browser
@needs_axe
@pytest.mark.slow
@pytest.mark.parametrize("flags", [(), (DARK,)], ids=["light", "dark"])
def test_axe_finds_nothing_serious_in_a_report(small_report: Path, tmp_path: Path, flags: tuple[str, ...]) -> None:
    assert serious(small_report / "index.html", tmp_path, *flags) == []


@needs_browser
@needs_axe
@pytest.mark.parametrize("flags", [(), (DARK,)], ids=["light", "dark"])
def test_axe_finds_nothing_serious_in_each_kind_of_block(tmp_path: Path, flags: tuple[str, ...]) -> None:
    rows = [(f"row {k}", f"{k}.0 ug") for k in range(12)]
    remarks = [Paragraph("ins-eval evaluate DIR", "Said.") for _ in rows]
    blocks = [
        Paragraph("Words.", "Lead."), Picture("one", "A curve."),
        Table("Numbers", ("name", "value"), rows, "A note."),
        *(Table("Tones", ("name", "value"), rows[:1], remarks=remarks[:1], tones=[tone])
          for tone in ("good", "weak", "bad", "odd", "quiet")),
    ]  # fmt: skip
    first = at_a_glance([Number("what", "1.0 m/s", "95 %: 0.9 to 1.1 m/s")], Picture("two", "Another."), "A step.")
    figures = {name: drawn(name, [0.0, 1.0, 2.0], "m", xlabel="time [s]") for name in ("one", "two")}
    page = write_report(
        tmp_path, title="t", answer="a\nb", sections=[first, Section("All", blocks)], figures=figures, metrics={}
    )
    assert serious(page, tmp_path, *flags) == []


@needs_browser
@needs_axe
def test_axe_finds_an_image_without_words(tmp_path: Path) -> None:
    assert [one[:9] for one in serious(write_page(tmp_path, '<img src="data:,">'), tmp_path)].count("image-alt") == 1


@needs_browser
def test_a_script_that_is_not_of_the_page_is_refused(small_report: Path, tmp_path: Path) -> None:
    page = tmp_path / "foreign.html"
    foreign = "<script>document.title = 'foreign'</script></body>"
    page.write_text((small_report / "index.html").read_text().replace("</body>", foreign))
    visit = open_page(page, tmp_path)
    assert "<title>foreign</title>" not in visit.document
    assert any("Content Security Policy" in line for line in visit.console)


def test_the_report_is_one_file_and_its_links_lead_somewhere(small_report: Path) -> None:
    document = (small_report / "index.html").read_text()
    assert not_inline(document) == []
    named = set(re.findall(r"\bid=[\"']([^\"']+)", document))
    for link in references(document).linked:
        parts = urlsplit(link)
        assert not parts.scheme, link
        assert not parts.path or (small_report / unquote(parts.path)).is_file(), link
        assert parts.path or parts.fragment in named, link
