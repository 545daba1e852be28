"""Reports that were written are found, shown and served to this machine only."""

from __future__ import annotations

import http.client
import json
import os
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from ins_eval.cli import main
from ins_eval.commands import open as verb
from ins_eval.report.page import write_page
from ins_eval.report.server import LOOPBACK, PageServer

LATEST, EARLIER = "Flight <7>", "Evaluation"


@pytest.fixture
def reports(tmp_path: Path) -> Path:
    """Two pages, a page of someone else, and a file that belongs to none."""
    folder = tmp_path / "reports"
    for age_s, (name, title) in enumerate((("flight #7", LATEST), ("evaluation", EARLIER))):
        page = write_page(folder / name, title=title, answer="Yes.", sections=[], figures={}, metrics={})
        os.utime(page, (1e9 - age_s, 1e9 - age_s))
    (folder / "evaluation" / "data").mkdir()
    (folder / "evaluation" / "data" / "figures.csv").write_text("a,b\n")
    (folder / "site").mkdir()
    (folder / "site" / "index.html").write_text("<title>Other</title>")
    (folder / "notes.txt").write_text("secret")
    (folder / "evaluation" / "out").symlink_to(folder / "notes.txt")
    return folder


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    addresses: list[str] = []
    monkeypatch.setattr(verb.webbrowser, "open", addresses.append)
    return addresses


@pytest.mark.parametrize("window", [True, False])
def test_the_latest_page_is_shown_and_its_path_printed(
    window: bool, reports: Path, opened: list[str], monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(verb.sys, "platform", "linux")
    if window:
        monkeypatch.setenv("DISPLAY", ":0")
    assert main(["open", str(reports), "--json", str(reports / "pages.json")]) == 0
    page = reports / "flight #7" / "index.html"
    assert capsys.readouterr().out == f"page: {page}\n"
    assert opened == ([page.resolve().as_uri()] if window else [])
    rows = json.loads((reports / "pages.json").read_text())["pages"]
    assert [row["title"] for row in rows] == [LATEST, EARLIER]
    assert main(["open", str(reports / "evaluation"), "--quiet"]) == 0
    assert capsys.readouterr().out == ""
    assert len(opened) == 2 * window


def test_where_no_page_is_the_sentence_says_how_to_write_one(tmp_path: Path, opened: list[str], capsys) -> None:
    for folder in (tmp_path, tmp_path / "none"):
        assert main(["open", str(folder)]) == 2
        assert "ins-eval evaluate DIR" in capsys.readouterr().err
    assert main(["open", str(tmp_path), "--port", "8080"]) == 2
    assert "--serve" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        main(["open", "--serve", "--port", "80"])
    assert opened == []


@pytest.fixture
def server(reports: Path) -> Iterator[PageServer]:
    with PageServer(reports) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        yield server
        server.shutdown()
        thread.join()


def asked(server: PageServer, path: str, method: str = "GET", **headers: str) -> tuple[int, str]:
    connection = http.client.HTTPConnection(LOOPBACK, server.server_port, timeout=10)
    try:
        connection.request(method, path, headers=headers)
        answer = connection.getresponse()
        return answer.status, answer.read().decode()
    finally:
        connection.close()


def test_the_list_leads_to_every_page(server: PageServer) -> None:
    status, page = asked(server, "/")
    assert status == 200 and page.index("Flight &lt;7&gt;") < page.index(EARLIER) and "Other" not in page
    for path in ("/flight%20%237/index.html", "/evaluation/index.html", "/evaluation/data/figures.csv"):
        assert asked(server, path)[0] == 200
    assert 'href="/flight%20%237/index.html"' in page
    assert asked(server, "/", "HEAD") == (200, "")


@pytest.mark.parametrize(
    "path", ["/notes.txt", "/site/index.html", "/evaluation/out", "/evaluation/../notes.txt",
             "/evaluation/%2e%2e/notes.txt", "/../../etc/passwd", "//etc/passwd", "/evaluation/", "/evaluation/data",
             "/a%00b", "/" + "a" * 5000]
)  # fmt: skip
def test_nothing_but_pages_is_served(path: str, server: PageServer) -> None:
    assert asked(server, path)[0] == 404


def test_it_is_read_only_and_of_this_machine(server: PageServer) -> None:
    assert server.server_address[0] == LOOPBACK
    for method in ("POST", "PUT", "DELETE"):
        assert asked(server, "/", method)[0] == 501
    assert asked(server, "/", Host=f"elsewhere.example:{server.server_port}")[0] == 403
    assert asked(server, "/", Host=f"localhost:{server.server_port}")[0] == 200


def test_a_port_that_is_taken_is_said(server: PageServer, reports: Path, opened: list[str], capsys) -> None:
    assert main(["open", str(reports), "--serve", "--port", str(server.server_port)]) == 2
    assert f"--port {server.server_port}" in capsys.readouterr().err


def test_serving_ends_with_ctrl_c(reports: Path, opened: list[str], monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    def interrupt(self) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(PageServer, "serve_forever", interrupt)
    assert main(["open", str(reports), "--serve"]) == 0
    assert capsys.readouterr().out.startswith("page: http://127.0.0.1:")
