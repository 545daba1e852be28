"""Pages that were written: which a folder holds, and a list of them as a page."""

from __future__ import annotations

import html
import os
import re
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from ins_eval.errors import UsageError
from ins_eval.printable import printable

INDEX = "index.html"
OURS = b'<meta name="generator" content="ins_eval">'
HEAD_BYTES = 4096  # of a page, which hold its mark and its title
_TITLE = re.compile(rb"<title>(.*?)</title>", re.DOTALL)
_LIST = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'; img-src data:">
<meta name="color-scheme" content="light dark">
<link rel="icon" href="data:,">
<title>Reports</title>
<style>
body {{ font: 16px/1.5 system-ui, sans-serif; max-width: 54rem; margin: 2rem auto; padding: 0 1.5rem; }}
li {{ margin: .5rem 0; }}
small {{ display: block; }}
</style>
</head>
<body>
<main>
<h1>Reports</h1>
<p>{count}, the latest first.</p>
<ol>
{rows}
</ol>
</main>
</body>
</html>
"""


@dataclass(frozen=True)
class WrittenPage:
    """A page of a report on disk: its file, its title, and when it was written, in seconds since 1970."""

    path: Path
    title: str
    written_s: float


def written(folder: Path) -> list[WrittenPage]:
    """The pages of reports in `folder` and below, the latest first. Raises UsageError where there is no such folder."""
    if not folder.is_dir():
        raise UsageError(
            f"{folder}: there is no such folder, expected one that holds reports; name it, or write a report first, as "
            "ins-eval evaluate DIR does"
        )
    return sorted(_found(folder), key=lambda page: (-page.written_s, str(page.path)))


def _found(folder: Path) -> Iterator[WrittenPage]:
    for inner, folders, files in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        if INDEX in files and (page := page_of(Path(inner))):
            yield page


def page_of(folder: Path) -> WrittenPage | None:
    """The page of a report that lies in a folder itself, if it holds one that can be read."""
    path = folder / INDEX
    try:
        with open(path, "rb") as file:
            head = file.read(HEAD_BYTES)
        written_s = path.stat().st_mtime
    except OSError:
        return None
    if OURS not in head:
        return None
    title = _TITLE.search(head)
    words = html.unescape(title[1].decode("utf-8", errors="replace")) if title else folder.name
    return WrittenPage(path, printable(words), written_s)


def as_list(pages: Sequence[WrittenPage], folder: Path) -> str:
    """A page that leads to each of `pages` by its path below `folder`."""
    rows = [
        f'<li><a href="/{html.escape(_address(page.path, folder))}">{html.escape(page.title)}</a>'
        f"<small>{html.escape(page.path.parent.relative_to(folder).as_posix())}, "
        f"{time.strftime('%Y-%m-%d %H:%M', time.localtime(page.written_s))}</small></li>"
        for page in pages
    ]
    count = f"{len(pages)} page{'' if len(pages) == 1 else 's'}"
    return _LIST.format(count=count, rows="\n".join(rows))


def _address(path: Path, folder: Path) -> str:
    return quote(path.relative_to(folder).as_posix())
