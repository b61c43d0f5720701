"""The scan's page on localhost, and in edit mode the place where corrections are saved.

Only the files that the page is made of are served, only to this machine, and only to pages of
this very address: another web page open in the same browser can neither read nor write here.
"""

from __future__ import annotations

import json
import mimetypes
from functools import partial
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import msgspec

from walltopo.core import EnvironmentLacksError, WalltopoError
from walltopo.export.edits import read_edits, save_edits
from walltopo.scans.folder import ScanFolder

__all__ = ["make_server", "serve"]

FILES = {"index.html", "report.html", "wall.glb", "holds.json", "routes.json"}
FOLDERS = {"page", "cutouts"}
MOST_BYTES = 4_000_000
TYPES = {".glb": "model/gltf-binary", ".js": "text/javascript", ".json": "application/json"}
POLICY = (
    "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' blob: data:; connect-src 'self' blob:; worker-src blob:; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'self'"
)


class _Handler(BaseHTTPRequestHandler):
    """One request; `scan` and `edit` come from `make_server`."""

    server_version = "walltopo"
    protocol_version = "HTTP/1.1"

    def __init__(self, scan: ScanFolder, edit: bool, *args: Any) -> None:
        self.scan = scan
        self.edit = edit
        super().__init__(*args)

    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing: the terminal shows the address and waits."""

    def do_GET(self) -> None:
        if not self._from_here():
            return
        name = unquote(urlsplit(self.path).path).lstrip("/") or "index.html"
        if name == "api/edits":
            self._answer_edits()
            return
        path = self._file(name)
        if path is None:
            self._send(HTTPStatus.NOT_FOUND, b"not found\n", "text/plain")
            return
        data = path.read_bytes()
        if self.edit and name == "index.html":
            data = data.replace(b"<wall-topo ", b"<wall-topo edit ", 1)
        kind = TYPES.get(path.suffix) or mimetypes.guess_type(path.name)[0]
        self._send(HTTPStatus.OK, data, kind or "application/octet-stream")

    do_HEAD = do_GET  # noqa: N815

    def do_POST(self) -> None:
        if not self._from_here():
            return
        length = int(self.headers.get("Content-Length") or 0)
        if urlsplit(self.path).path != "/api/edits" or not self.edit:
            self._problem(HTTPStatus.NOT_FOUND, "this page is not in edit mode")
        elif self.headers.get("Origin") not in (None, f"http://{self.headers.get('Host')}"):
            self._problem(HTTPStatus.FORBIDDEN, "edits are taken from this page only")
        elif "application/json" not in (self.headers.get("Content-Type") or ""):
            self._problem(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, "expected application/json")
        elif not 0 < length <= MOST_BYTES:
            self._problem(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, "the edits are too large")
        else:
            self._save(self.rfile.read(length))

    def _save(self, body: bytes) -> None:
        try:
            save_edits(self.scan, msgspec.json.decode(body))
        except (UnicodeDecodeError, msgspec.DecodeError) as error:
            self._problem(HTTPStatus.BAD_REQUEST, f"not JSON: {error}")
        except WalltopoError as error:
            self._problem(HTTPStatus.BAD_REQUEST, str(error))
        else:
            self._json(HTTPStatus.OK, {"saved": True})

    def _answer_edits(self) -> None:
        if not self.edit:
            self._problem(HTTPStatus.NOT_FOUND, "this page is not in edit mode")
            return
        try:
            self._json(HTTPStatus.OK, read_edits(self.scan))
        except WalltopoError as error:
            self._problem(HTTPStatus.INTERNAL_SERVER_ERROR, str(error))

    def _from_here(self) -> bool:
        """Refuse names other than localhost: a rebound domain must not reach the scan."""
        host = (self.headers.get("Host") or "").rsplit(":", 1)[0]
        if host in ("localhost", "127.0.0.1"):
            return True
        self._send(HTTPStatus.FORBIDDEN, b"open this as localhost\n", "text/plain")
        return False

    def _file(self, name: str) -> Path | None:
        """The file behind a name, if it is one that the page is made of."""
        root = self.scan.root.resolve()
        path = (root / name).resolve()
        if not path.is_relative_to(root) or not path.is_file():
            return None
        parts = path.relative_to(root).parts
        return path if parts[0] in FOLDERS or "/".join(parts) in FILES else None

    def _json(self, status: HTTPStatus, value: Any) -> None:
        self._send(status, json.dumps(value).encode("utf-8"), "application/json")

    def _problem(self, status: HTTPStatus, text: str) -> None:
        self.close_connection = True
        self._json(status, {"error": text})

    def _send(self, status: HTTPStatus, data: bytes, kind: str) -> None:
        self.send_response(status)
        text = kind.startswith("text/") or kind == "application/json"
        self.send_header("Content-Type", f"{kind}; charset=utf-8" if text else kind)
        self.send_header("Content-Length", str(len(data)))
        self.send_header("Cache-Control", "no-cache")
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("Referrer-Policy", "no-referrer")
        self.send_header("Content-Security-Policy", POLICY)
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(data)


def make_server(scan_root: Path, port: int, edit: bool) -> ThreadingHTTPServer:
    """A server on 127.0.0.1, not yet running; port 0 takes any free one.

    Raises
    ------
    EnvironmentLacksError : the port is taken.
    """
    handler = partial(_Handler, ScanFolder(scan_root), edit)
    try:
        return ThreadingHTTPServer(("127.0.0.1", port), handler)
    except OSError as error:
        raise EnvironmentLacksError(
            f"port {port} cannot be used ({error.strerror})", "Choose another with --port."
        ) from error


def serve(scan_root: Path, port: int, edit: bool) -> None:
    """Serve a scan's page until Ctrl-C, and say where."""
    from rich.console import Console

    server = make_server(scan_root, port, edit)
    console = Console(highlight=False)
    console.print(f"http://localhost:{server.server_address[1]}/", style="bold")
    console.print("Ctrl-C stops." + (" Edits are saved into the scan folder." if edit else ""))
    try:
        server.serve_forever()
    except KeyboardInterrupt:
        console.print("stopped")
    finally:
        server.server_close()
