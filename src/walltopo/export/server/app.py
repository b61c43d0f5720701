"""What is answered: the files that the page is made of, and the edits."""

from __future__ import annotations

import html
import re
from collections.abc import Callable
from http import HTTPStatus
from pathlib import Path
from typing import Any, TypeVar

import msgspec
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import HTMLResponse, Response
from starlette.routing import Route
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp

from walltopo.core import EnvironmentLacksError, WalltopoError
from walltopo.export.server.desk import EditDesk, EditsChangedError, problem_key
from walltopo.export.server.guard import (
    EASE,
    EDITS,
    PHOTOS,
    PROBLEMS,
    STATE,
    TRY,
    Guard,
    Rules,
    policy,
    problem,
)
from walltopo.scans.bounds import Label
from walltopo.scans.document import parse
from walltopo.scans.edits import EditLog, Place
from walltopo.scans.folder import ScanFolder
from walltopo.setting.ease import Way
from walltopo.setting.wish import Wish

__all__ = ["make_app"]

# Compared with the path as it was sent: nothing that is encoded, hidden or steps up can match.
SERVED = re.compile(
    r"(index|report)\.html|wall\.glb|(holds|routes|moves)\.json|(page|cutouts)/[A-Za-z0-9_-][A-Za-z0-9._-]{0,99}"
)
TYPES = {
    ".glb": "model/gltf-binary",
    ".js": "text/javascript; charset=utf-8",
    ".json": "application/json; charset=utf-8",
}


class _Save(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A log, made on a version."""

    version: str
    edits: EditLog


class _Try(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    edits: EditLog


class _Propose(_Try, frozen=True, forbid_unknown_fields=True):
    wish: Wish


class _Ease(_Try, frozen=True, forbid_unknown_fields=True):
    route: Label
    way: Way


def make_app(
    scan: ScanFolder,
    rules: Rules,
    desk: EditDesk | None = None,
    tell: Callable[[str], None] | None = None,
) -> ASGIApp:
    """The guarded application.

    Parameters
    ----------
    desk : where edits are tried and saved; None where there is no edit mode.
    tell : gets a line about each request that failed by a defect.
    """

    def defect(request: Request, error: Exception) -> Response:
        if tell is not None:
            tell(f"a request failed: {type(error).__name__}: {error}")
        # None of this machine's paths for the asker.
        path = request.scope["path"]
        return problem(path, HTTPStatus.INTERNAL_SERVER_ERROR, "walltopo failed here")

    pages = _Pages(scan, rules, desk)
    app = Starlette(
        routes=[
            Route(EDITS, pages.edits, methods=["GET"]),
            Route(EDITS, pages.save, methods=["POST"]),
            Route(TRY, pages.tried, methods=["POST"]),
            Route(STATE, pages.state, methods=["GET"]),
            Route(PHOTOS, pages.photos, methods=["GET"]),
            Route(PROBLEMS, pages.problems, methods=["POST"]),
            Route(EASE, pages.ease, methods=["POST"]),
            Route("/{name:path}", pages.file, methods=["GET"]),
        ],
        exception_handlers={
            HTTPException: _told,
            WalltopoError: _unusable,
            ClientDisconnect: _left,
            Exception: defect,
        },
    )
    return Guard(app, rules)


class _Pages:
    def __init__(self, scan: ScanFolder, rules: Rules, desk: EditDesk | None) -> None:
        self._desk = desk
        self.scan = scan
        self.rules = rules
        # Of Starlette's: validators, ranges and what has not changed; which file: `_path`.
        self.files = StaticFiles(directory=scan.root)

    @property
    def desk(self) -> EditDesk:
        """Without edit mode the guard lets nobody ask for it."""
        if self._desk is None:
            raise HTTPException(HTTPStatus.NOT_FOUND, "this page is not in edit mode")
        return self._desk

    async def file(self, request: Request) -> Response:
        name = request.scope["raw_path"].decode("ascii").removeprefix("/") or "index.html"
        token = request.query_params.get("token")
        if name == "index.html" and self.rules.token is not None and token is not None:
            return await self._editor(token)
        path = await run_in_threadpool(self._path, name)
        if path is None:
            raise HTTPException(HTTPStatus.NOT_FOUND, "not found")
        answer = self.files.file_response(path, path.stat(), request.scope)
        if path.suffix in TYPES and answer.status_code == HTTPStatus.OK:
            answer.headers["Content-Type"] = TYPES[path.suffix]
        return answer

    async def edits(self, request: Request) -> Response:
        log, version = await run_in_threadpool(self.desk.read)
        return _json({"version": version, "edits": log}, version)

    async def save(self, request: Request) -> Response:
        # The guard has bounded its length, h11 lets no byte more through.
        asked = _asked(await request.body(), _Save)
        result, version = await run_in_threadpool(self.desk.saved, asked.edits, asked.version)
        return _json({"version": version, "result": result}, version)

    async def tried(self, request: Request) -> Response:
        asked = _asked(await request.body(), _Try)
        return _json({"result": await run_in_threadpool(self.desk.tried, asked.edits)})

    async def problems(self, request: Request) -> Response:
        asked = _asked(await request.body(), _Propose)
        return _json(await run_in_threadpool(self.desk.proposed, asked.edits, asked.wish))

    async def ease(self, request: Request) -> Response:
        asked = _asked(await request.body(), _Ease)
        return _json(await run_in_threadpool(self.desk.eased, asked.edits, asked.route, asked.way))

    async def state(self, request: Request) -> Response:
        return _json(await run_in_threadpool(self.desk.state))

    async def photos(self, request: Request) -> Response:
        place = request.query_params.get("at", "")
        try:
            at = msgspec.convert([float(part) for part in place.split(",")], Place)
        except (ValueError, msgspec.ValidationError) as error:
            raise HTTPException(HTTPStatus.BAD_REQUEST, "expected ?at=x,y,z in metres") from error
        return _json({"photos": await run_in_threadpool(self.desk.crops, at)})

    async def _editor(self, token: str) -> Response:
        """The page with the editor, for who has the token; kept by no cache, shown in no frame."""
        if not self.rules.knows(token):
            raise HTTPException(
                HTTPStatus.FORBIDDEN,
                "the token is of an earlier run: open the address that `walltopo view` shows now",
            )
        path = await run_in_threadpool(self._path, "index.html")
        if path is None:
            raise HTTPException(HTTPStatus.NOT_FOUND, "not found")
        page = await run_in_threadpool(path.read_text, encoding="utf-8")
        page = page.replace("<wall-topo ", f'<wall-topo edit token="{html.escape(token)}" ', 1)
        headers = {"Cache-Control": "no-store", "Content-Security-Policy": policy()}
        return HTMLResponse(page, headers=headers)

    def _path(self, name: str) -> Path | None:
        """The file behind a name, if the page is made of it and no link leads elsewhere."""
        if not SERVED.fullmatch(name):
            return None
        root = self.scan.root.resolve()
        path = root / name
        return path if path.is_file() and path.resolve() == path else None


T = TypeVar("T")


def _decoded(body: bytes) -> Any:
    try:
        return msgspec.json.decode(body)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise HTTPException(HTTPStatus.BAD_REQUEST, f"not JSON: {error}") from error


def _asked(body: bytes, kind: type[T]) -> T:
    """What a request says; InputError names the place where it is something else."""
    return parse(_decoded(body), kind, "edits")


def _json(value: object, version: str = "") -> Response:
    headers = {"Cache-Control": "no-store"}
    if version:
        headers["ETag"] = f'"{version}"'
    return Response(msgspec.json.encode(value), media_type="application/json", headers=headers)


def _told(request: Request, error: Exception) -> Response:
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


def _left(request: Request, error: Exception) -> Response:
    """Nobody reads this: the connection is gone."""
    return Response(status_code=HTTPStatus.BAD_REQUEST)
