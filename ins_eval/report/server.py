"""A folder of reports for the browser of this machine: a list of its pages, and their files, read-only.

Only this machine reaches it (127.0.0.1), by GET and HEAD. A file is sent where it truly lies, links resolved, in the
folder of a page or below it; nothing else is.
"""

from __future__ import annotations

from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from mimetypes import guess_type
from pathlib import Path
from urllib.parse import unquote, urlsplit

from ins_eval.errors import UsageError
from ins_eval.report.pages import as_list, page_of, written

LOOPBACK = "127.0.0.1"


class PageServer(ThreadingHTTPServer):
    """Serves the pages of `folder` on a port of the loopback interface; 0 takes a free one. Raises UsageError."""

    daemon_threads = True

    def __init__(self, folder: Path, port: int = 0) -> None:
        self.folder = folder.resolve()
        try:
            super().__init__((LOOPBACK, port), _Handler)
        except OSError as error:
            raise UsageError(
                f"--port {port}: cannot be taken ({error.strerror}), expected a free one; name another"
            ) from None

    @property
    def address(self) -> str:
        return f"http://{LOOPBACK}:{self.server_port}/"


class _Handler(BaseHTTPRequestHandler):
    server: PageServer
    server_version, sys_version = "ins_eval", ""

    def do_GET(self) -> None:
        self._answer(body=True)

    def do_HEAD(self) -> None:
        self._answer(body=False)

    def log_message(self, *_) -> None:
        """Nothing is logged."""

    def _answer(self, body: bool) -> None:
        # a page of another site that was given this machine's address by name is turned away
        if self.headers.get("Host", "").rpartition(":")[0] not in (LOOPBACK, "localhost"):
            self.send_error(HTTPStatus.FORBIDDEN)
            return
        path = unquote(urlsplit(self.path).path)
        content, kind = self._list() if path == "/" else self._file(path)
        if content is None:
            self.send_error(HTTPStatus.NOT_FOUND)
            return
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(content)))
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        if body:
            self.wfile.write(content)

    def _list(self) -> tuple[bytes, str]:
        return as_list(written(self.server.folder), self.server.folder).encode(), "text/html; charset=utf-8"

    def _file(self, path: str) -> tuple[bytes | None, str]:
        """The bytes of a file of a page; None where there is none."""
        try:
            root = self.server.folder
            place = (root / path.lstrip("/")).resolve()
            ours = (page_of(above) for above in place.parents if above.is_relative_to(root))
            if not place.is_file() or not any(ours):
                return None, ""
            kind = guess_type(place.name)[0] or "application/octet-stream"
            return place.read_bytes(), f"{kind}; charset=utf-8" if kind.startswith("text/") else kind
        except (OSError, ValueError):  # a zero byte, a name too long, a file gone meanwhile
            return None, ""
