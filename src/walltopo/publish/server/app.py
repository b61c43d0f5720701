"""The web application: the files of the page, and the editor's routes."""

from __future__ import annotations

import html
import re
from collections.abc import Callable, Sequence
from http import HTTPStatus
from pathlib import Path

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import HTMLResponse, Response
from starlette.routing import BaseRoute, Route
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp

from walltopo.core import EnvironmentLacksError, WalltopoError
from walltopo.core.errors import EditsChangedError, problem_key
from walltopo.publish.server.first_look import (
    UnfinishedScan,
    first_look_routes,
    to_first_look,
)
from walltopo.publish.server.guard import Guard, Rules, policy, problem
from walltopo.scans.folder import ScanFolder

# Matched against the raw path, so that encoded, hidden and parent paths never match.
SERVED = re.compile(
    r"(index|report)\.html|wall\.glb|(holds|routes|moves)\.json|(page|cutouts)/[A-Za-z0-9_-][A-Za-z0-9._-]{0,99}"
)
TYPES = {
    ".glb": "model/gltf-binary",
    ".js": "text/javascript; charset=utf-8",
    ".json": "application/json; charset=utf-8",
}


def make_app(
    scan: ScanFolder,
    rules: Rules,
    editor: Sequence[BaseRoute] = (),
    on_defect: Callable[[str], None] | None = None,
    unfinished: UnfinishedScan | None = None,
) -> ASGIApp:
    """Return the guarded application.

    Parameters
    ----------
    editor : routes below `/api/`, which need the token; empty without edit mode.
    unfinished : the scan while it runs, which is shown until its page is there.
    on_defect : called with a line about each request that failed by a defect.
    """

    def defect(request: Request, error: Exception) -> Response:
        if on_defect is not None:
            on_defect(f"a request failed: {type(error).__name__}: {error}")
        # The response must not reveal paths of this machine.
        path = request.scope["path"]
        return problem(path, HTTPStatus.INTERNAL_SERVER_ERROR, "walltopo failed to answer")

    pages = _Pages(scan, rules, follow=unfinished is not None)
    app = Starlette(
        routes=[
            *editor,
            *([] if unfinished is None else first_look_routes(unfinished)),
            Route("/{name:path}", pages.file, methods=["GET"]),
        ],
        exception_handlers={
            HTTPException: _http_error,
            WalltopoError: _unusable,
            ClientDisconnect: _disconnected_response,
            Exception: defect,
        },
    )
    return Guard(app, rules)


class _Pages:
    def __init__(self, scan: ScanFolder, rules: Rules, *, follow: bool) -> None:
        self.scan = scan
        self.rules = rules
        self.follow = follow
        # Starlette handles validators, ranges and not-modified; `_path` selects the file.
        self.files = StaticFiles(directory=scan.root)

    async def file(self, request: Request) -> Response:
        name = request.scope["raw_path"].decode("ascii").removeprefix("/") or "index.html"
        token = request.query_params.get("token")
        if name == "index.html" and self.rules.token is not None and token is not None:
            return await self._editor(token)
        path = await run_in_threadpool(self._path, name)
        if path is None and name == "index.html" and self.follow:
            return to_first_look()
        if path is None:
            raise HTTPException(HTTPStatus.NOT_FOUND, "not found")
        answer = self.files.file_response(path, path.stat(), request.scope)
        if path.suffix in TYPES and answer.status_code == HTTPStatus.OK:
            answer.headers["Content-Type"] = TYPES[path.suffix]
        return answer

    async def _editor(self, token: str) -> Response:
        """Return the page with the editor for a valid token; not cached, not framed."""
        if not self.rules.knows(token):
            raise HTTPException(
                HTTPStatus.FORBIDDEN,
                "the token is from an earlier run: open the address that `walltopo view` shows now",
            )
        path = await run_in_threadpool(self._path, "index.html")
        if path is None:
            raise HTTPException(HTTPStatus.NOT_FOUND, "not found")
        page = await run_in_threadpool(path.read_text, encoding="utf-8")
        page = page.replace("<wall-topo ", f'<wall-topo edit token="{html.escape(token)}" ', 1)
        headers = {"Cache-Control": "no-store", "Content-Security-Policy": policy()}
        return HTMLResponse(page, headers=headers)

    def _path(self, name: str) -> Path | None:
        """Return the file of a name, or None if the page does not use it or it is a link."""
        if not SERVED.fullmatch(name):
            return None
        if name.startswith("cutouts/") and self.scan.hidden.exists():
            return None  # they are crops of photos in which nothing is hidden
        root = self.scan.root.resolve()
        path = root / name
        return path if path.is_file() and path.resolve() == path else None


def _http_error(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    return problem(request.scope["path"], error.status_code, error.detail)


def _unusable(request: Request, error: Exception) -> Response:
    assert isinstance(error, WalltopoError)
    text = f"{error.message}. {error.hint}" if error.hint else error.message
    status = HTTPStatus.BAD_REQUEST
    if isinstance(error, EditsChangedError):
        status = HTTPStatus.PRECONDITION_FAILED
    elif isinstance(error, EnvironmentLacksError):
        status = HTTPStatus.INSUFFICIENT_STORAGE
    return problem(request.scope["path"], status, text, problem_key(error))


def _disconnected_response(request: Request, error: Exception) -> Response:
    """Return an unused response: the client has disconnected."""
    return Response(status_code=HTTPStatus.BAD_REQUEST)
