"""The HTTP routes of the editor, for any ASGI application (docs/edits.md).

The application controls access: `walltopo view --edit` requires a token.
"""

from __future__ import annotations

from collections.abc import Sequence
from http import HTTPStatus
from importlib.metadata import entry_points
from typing import Any, TypeVar

import msgspec
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from walltopo.editing.messages import Crop, EditResult
from walltopo.editing.session import EditSession
from walltopo.scans.document import parse
from walltopo.scans.edits import EditLog, Place

EDITS = "/api/edits"
# Entry points of this group add routes: each is a function of an `EditSession` that returns routes.
ENTRY_POINTS = "walltopo.editor"

T = TypeVar("T")


class PreviewIn(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A log to preview."""

    edits: EditLog


class SaveIn(PreviewIn, frozen=True, forbid_unknown_fields=True):
    """A log to save, and the version on which it is based."""

    version: str


class LogOut(msgspec.Struct, frozen=True):
    """The saved log."""

    version: str
    edits: EditLog


class PreviewOut(msgspec.Struct, frozen=True):
    """The scan after a log."""

    result: EditResult


class SaveOut(PreviewOut, frozen=True):
    """The scan after a saved log, and the version of that log."""

    version: str


class CropsOut(msgspec.Struct, frozen=True):
    """The photos that show a place best."""

    photos: list[Crop]


def editor_routes(session: EditSession) -> list[BaseRoute]:
    """Return the routes below `/api/` that read, preview and save edits, and those of plug-ins."""
    routes = _Routes(session)
    added: list[BaseRoute] = []
    for point in sorted(entry_points(group=ENTRY_POINTS), key=lambda point: point.name):
        more: Sequence[BaseRoute] = point.load()(session)
        added += more
    return [
        Route(EDITS, routes.read, methods=["GET"]),
        Route(EDITS, routes.save, methods=["POST"]),
        Route(f"{EDITS}/try", routes.preview, methods=["POST"]),
        Route(f"{EDITS}/state", routes.status, methods=["GET"]),
        Route("/api/photos", routes.crops, methods=["GET"]),
        *added,
    ]


class _Routes:
    def __init__(self, session: EditSession) -> None:
        self._session = session

    async def read(self, request: Request) -> Response:
        log, version = await run_in_threadpool(self._session.read)
        return json_response(LogOut(version, log), version)

    async def save(self, request: Request) -> Response:
        body = await read_body(request, SaveIn)
        result, version = await run_in_threadpool(self._session.save, body.edits, body.version)
        return json_response(SaveOut(result, version), version)

    async def preview(self, request: Request) -> Response:
        body = await read_body(request, PreviewIn)
        result = await run_in_threadpool(self._session.preview, body.edits)
        return json_response(PreviewOut(result))

    async def status(self, request: Request) -> Response:
        return json_response(await run_in_threadpool(self._session.status))

    async def crops(self, request: Request) -> Response:
        at = parse_place(request.query_params.get("at", ""))
        if at is None:
            raise HTTPException(HTTPStatus.BAD_REQUEST, "expected ?at=x,y,z in metres")
        return json_response(CropsOut(await run_in_threadpool(self._session.crops, at)))


async def read_body(request: Request, kind: type[T]) -> T:
    """Return the request's JSON body; raise InputError with the location of an invalid value.

    The application limits the length of bodies.
    """
    body = await request.body()
    try:
        decoded: Any = msgspec.json.decode(body)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise HTTPException(HTTPStatus.BAD_REQUEST, f"not JSON: {error}") from error
    return parse(decoded, kind, "edits")


def parse_place(text: str) -> Place | None:
    """Return the place in "x,y,z", in metres, or None if the text is no place."""
    try:
        return msgspec.convert([float(part) for part in text.split(",")], Place)
    except (ValueError, msgspec.ValidationError):
        return None


def json_response(value: object, version: str = "") -> Response:
    """Return an uncacheable JSON response; `version` becomes its ETag."""
    headers = {"Cache-Control": "no-store"}
    if version:
        headers["ETag"] = f'"{version}"'
    return Response(msgspec.json.encode(value), media_type="application/json", headers=headers)
