"""The answer of a server whose data are being replaced: 503, as a plain page or for the app."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from html import escape
from typing import Final

import uvicorn
from starlette.responses import HTMLResponse, Response
from starlette.types import Receive, Scope, Send

from walltopo_gym.api.error_responses import error_response
from walltopo_gym.api.middleware import SafeHeaders
from walltopo_gym.errors import RequestError
from walltopo_gym.languages import LANGUAGES
from walltopo_gym.messages import sentences

_KEY: Final = "server-restoring"
_HEADERS: Final = {"retry-after": "10", "cache-control": "no-store"}


@contextmanager
def in_maintenance(listener: socket.socket) -> Iterator[None]:
    """Answer every request with 503 for the duration of the block."""
    config = uvicorn.Config(
        SafeHeaders(_answer),
        log_config=None,
        access_log=False,
        lifespan="off",
        server_header=False,
        timeout_graceful_shutdown=1,
    )
    server = uvicorn.Server(config)
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener.dup()]})
    thread.start()
    try:
        yield
    finally:
        server.should_exit = True
        thread.join()


async def _answer(scope: Scope, receive: Receive, send: Send) -> None:
    if scope["type"] == "http":
        await _response(scope["path"])(scope, receive, send)


def _response(path: str) -> Response:
    if path.startswith("/api/"):
        return error_response(RequestError(_KEY, "try-again-soon"), 503, _HEADERS)
    lines = (f'<p lang="{code}">{escape(sentences(code)[_KEY])}</p>' for code in LANGUAGES)
    page = f"<!doctype html><title>walltopo</title><body>{''.join(lines)}"
    return HTMLResponse(page, 503, _HEADERS)
