"""``ins-eval open``: the latest page of a folder in the browser, or all of them as a list."""

from __future__ import annotations

import os
import sys
import webbrowser
from pathlib import Path

from ins_eval.errors import UsageError
from ins_eval.report.json_file import write_json
from ins_eval.report.pages import written
from ins_eval.report.server import PageServer


def run(
    folder: Path, serve: bool = False, port: int | None = None, json: Path | None = None, quiet: bool = False
) -> int:
    """Show the latest page, or serve a list of all until interrupted, and print where it is.

    Raises: UsageError without a page, or for a port that cannot be taken.
    """
    if port is not None and not serve:
        raise UsageError("open: --port is of --serve; add it")
    pages = written(folder)
    if not pages:
        raise UsageError(
            f"{folder}: holds no page of a report, expected one or more; write one first, as ins-eval evaluate DIR does"
        )
    rows = [{"path": str(one.path), "title": one.title, "written_s": one.written_s} for one in pages]
    write_json(json, {"format": "ins-eval-pages/1", "pages": rows})
    if not serve:
        _show(pages[0].path.resolve().as_uri(), str(pages[0].path), quiet)
        return 0
    with PageServer(folder, port or 0) as server:
        _show(server.address, f"{server.address} (until Ctrl-C)", quiet)
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            return 0
    return 0


def _show(address: str, words: str, quiet: bool) -> None:
    """Print where a page is, and open it in a browser with a window, if there is one."""
    if not quiet:
        print(f"page: {words}", flush=True)
    windows = sys.platform in ("darwin", "win32") or any(map(os.environ.get, ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")))
    if windows:
        webbrowser.open(address)
