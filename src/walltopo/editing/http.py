"""The HTTP routes of the editor, for any ASGI application (docs/edits.md).

Who may call them is the application's business: `walltopo view --edit` asks for a token.
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

from walltopo.editing.session import EditSession
from walltopo.scans.document import parse
from walltopo.scans.edits import EditLog, Place

EDITS = "/api/edits"
# Other distributions add routes: name -> function of an `EditSession` that returns routes.
ENTRY_POINTS = "walltopo.editor"

T = TypeVar("T")


class PreviewIn(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A log to try."""

    edits: EditLog


class SaveIn(PreviewIn, frozen=True, forbid_unknown_fields=True):
    """A log to save, and the version that it was made on."""

    version: str


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
        return json_response({"version": version, "edits": log}, version)

    async def save(self, request: Request) -> Response:
        body = await read_body(request, SaveIn)
        result, version = await run_in_threadpool(self._session.save, body.edits, body.version)
        return json_response({"version": version, "result": result}, version)

    async def preview(self, request: Request) -> Response:
        body = await read_body(request, PreviewIn)
        return json_response({"result": await run_in_threadpool(self._session.preview, body.edits)})

    async def status(self, request: Request) -> Response:
        return json_response(await run_in_threadpool(self._session.status))

    async def crops(self, request: Request) -> Response:
        place = request.query_params.get("at", "")
        try:
            at = msgspec.convert([float(part) for part in place.split(",")], Place)
        except (ValueError, msgspec.ValidationError) as error:
            raise HTTPException(HTTPStatus.BAD_REQUEST, "expected ?at=x,y,z in metres") from error
        return json_response({"photos": await run_in_threadpool(self._session.crops, at)})


async def read_body(request: Request, kind: type[T]) -> T:
    """Return the request's JSON body; InputError names the place where it is something else.

    The application bounds the length of bodies.
    """
    body = await request.body()
    try:
        decoded: Any = msgspec.json.decode(body)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise HTTPException(HTTPStatus.BAD_REQUEST, f"not JSON: {error}") from error
    return parse(decoded, kind, "edits")


def json_response(value: object, version: str = "") -> Response:
    """Return a value as JSON that no cache keeps; `version` becomes its ETag."""
    headers = {"Cache-Control": "no-store"}
    if version:
        headers["ETag"] = f'"{version}"'
    return Response(msgspec.json.encode(value), media_type="application/json", headers=headers)
