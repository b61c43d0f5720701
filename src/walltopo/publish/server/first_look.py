"""The page of a scan that still runs: its stages, and the wall as far as it is known."""

from __future__ import annotations

import re
import threading
from typing import Protocol

import msgspec
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, HTMLResponse, RedirectResponse, Response
from starlette.routing import BaseRoute, Route

from walltopo.publish.web_page import render, viewer_script

BELOW = "/first-look/"
_LOOK = re.compile(r"[a-z]{1,20}-[0-9a-f]{1,64}")


class UnfinishedScan(Protocol):
    """A scan while it runs; see `walltopo.pipeline.first_look`."""

    title: str

    def status(self) -> object:
        """Return how far the scan has come, a dataclass with `look` and `finished`."""

    def look(self, name: str) -> bytes:
        """Return the GLB of a look."""


def first_look_routes(scan: UnfinishedScan) -> list[BaseRoute]:
    """Return the routes that show a scan until its own page is there."""
    page = _FirstLook(scan)
    script = viewer_script()

    def file(name: str) -> Response:
        return FileResponse(script.with_name(name), media_type="text/javascript; charset=utf-8")

    return [
        Route("/first-look", page.page, methods=["GET"]),
        Route(f"{BELOW}status", page.status, methods=["GET"]),
        Route(f"{BELOW}wall.glb", page.look, methods=["GET"]),
        Route(f"{BELOW}viewer.js", lambda _: file(script.name), methods=["GET"]),
        Route(f"{BELOW}first_look.js", lambda _: file("first_look.js"), methods=["GET"]),
    ]


def to_first_look() -> Response:
    """Return the answer to requests of a page that does not exist yet."""
    return RedirectResponse("/first-look", status_code=307)


class _FirstLook:
    def __init__(self, scan: UnfinishedScan) -> None:
        self._scan = scan
        self._making = threading.Lock()  # one look at a time; it takes a core for seconds
        self._made: tuple[str, bytes] | None = None

    async def page(self, request: Request) -> Response:
        text = render("page", "first_look.html.jinja", title=self._scan.title, below=BELOW)
        return HTMLResponse(text, headers={"Cache-Control": "no-store"})

    async def status(self, request: Request) -> Response:
        status = await run_in_threadpool(self._scan.status)
        headers = {"Cache-Control": "no-store"}
        return Response(msgspec.json.encode(status), media_type="application/json", headers=headers)

    async def look(self, request: Request) -> Response:
        name = request.query_params.get("look", "")
        if _LOOK.fullmatch(name) is None:
            raise HTTPException(404, "not found")
        return Response(await run_in_threadpool(self._cached, name), media_type="model/gltf-binary")

    def _cached(self, name: str) -> bytes:
        with self._making:
            if self._made is None or self._made[0] != name:
                self._made = (name, self._scan.look(name))
            return self._made[1]
