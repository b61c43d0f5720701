"""Middleware of every request: size, rate, origin, headers."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final
from urllib.parse import urlsplit

from limits import RateLimitItemPerMinute
from limits.strategies import SlidingWindowCounterRateLimiter
from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from walltopo_gym.api.error_responses import error_response
from walltopo_gym.api.request_counts import SharedCounts
from walltopo_gym.api.services import network_of, token_of
from walltopo_gym.errors import RequestError

LONGEST_BODY: Final = 2_000_000  # bytes; a photo's are bounded by what was announced

_LENGTH: Final = re.compile("[0-9]{1,18}")  # what is longer is too long

# The app's files cost nothing to send, and a phone that installs the app asks for all of them at
# once: a few at a hall's entrance would be as many requests as one network may make.
_FREE: Final = "/assets/"


class Bounds:
    """Refuses networks that send too many requests.

    Parameters
    ----------
    per_minute : requests of one network; 0: no limit.
    counts : of the requests so far.
    """

    def __init__(self, app: ASGIApp, per_minute: int, counts: SharedCounts) -> None:
        self._app = app
        self._limit = RateLimitItemPerMinute(per_minute) if per_minute else None
        self._counter = SlidingWindowCounterRateLimiter(counts)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        is_free = scope["type"] != "http" or scope["path"].startswith(_FREE)
        if is_free or self._limit is None:
            await self._app(scope, receive, send)
            return
        if not self._counter.hit(self._limit, network_of(Request(scope))):
            answer = error_response(
                RequestError("too-many-requests", "wait-a-minute"), 429, {"retry-after": "60"}
            )
            await answer(scope, receive, send)
            return
        await self._app(scope, receive, send)


class BodyLimit:
    """Refuses bodies that are too long: by their announced length, or as soon as they exceed it.

    The 413 is sent at once, and the application then reads that the client is gone. A response that
    has begun cannot become a 413: it breaks off.

    Parameters
    ----------
    longer : endpoints whose limit is another one, as patterns of "METHOD path"; in bytes.
    """

    def __init__(self, app: ASGIApp, longer: Sequence[tuple[re.Pattern[str], int]] = ()) -> None:
        self._app, self._longer = app, longer

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        limit = self._limit_of(scope)
        announced = Headers(scope=scope).get("content-length", "0")
        if not _LENGTH.fullmatch(announced) or int(announced) > limit:
            await _too_large()(scope, receive, send)
            return
        size, has_begun, is_refused = 0, False, False

        async def receive_counted() -> Message:
            nonlocal size, is_refused
            if is_refused:
                return {"type": "http.disconnect"}
            message = await receive()
            size += len(message.get("body", b""))
            if size <= limit:
                return message
            is_refused = True
            if not has_begun:
                await _too_large()(scope, receive, send)
            return {"type": "http.disconnect"}

        async def send_unless_refused(message: Message) -> None:
            nonlocal has_begun
            if not is_refused:
                has_begun = True
                await send(message)

        try:
            await self._app(scope, receive_counted, send_unless_refused)
        except ClientDisconnect:
            if not is_refused:
                raise

    def _limit_of(self, scope: Scope) -> int:
        endpoint = f"{scope['method']} {scope['path']}"
        return next((most for form, most in self._longer if form.fullmatch(endpoint)), LONGEST_BODY)


def _too_large() -> Response:
    return error_response(RequestError("body-too-large"), 413)


_SAFE = {"GET", "HEAD", "OPTIONS"}


# Endpoints outside of the API that read no cookie.
_COOKIELESS: Final = re.compile(r"/oauth/(token|revoke)|/mcp")


class CrossOriginGuard:
    """Refuses changes by pages of other origins, unless the request has a token, which no page can
    have by accident, or its endpoint reads no cookie.

    Parameters
    ----------
    origin : our own, as browsers see it; a proxy may have changed Host.
    """

    def __init__(self, app: ASGIApp, origin: str) -> None:
        self._app, self._origin = app, origin

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "http" and scope["method"] not in _SAFE:
            headers = Headers(scope=scope)
            is_bare = _COOKIELESS.fullmatch(scope["path"]) or token_of(headers) is not None
            if not is_bare and not self._is_ours(headers):
                answer = error_response(RequestError("other-site"), 403)
                await answer(scope, receive, send)
                return
        await self._app(scope, receive, send)

    def _is_ours(self, headers: Headers) -> bool:
        site = headers.get("sec-fetch-site")
        if site is not None:
            return site in ("same-origin", "none")
        origin = headers.get("origin")
        if origin is None or origin == self._origin:
            return True
        return urlsplit(origin).netloc == headers.get("host")


_SHARED: Final = re.compile(r"/api/v1/.*|/oembed|/mcp|/oauth/(token|revoke)|/\.well-known/.*")
_PREFLIGHT: Final = {
    "access-control-allow-origin": "*",
    "access-control-allow-methods": "GET, HEAD, POST, PUT, PATCH, DELETE",
    # `*` covers all headers but this one.
    "access-control-allow-headers": "*, authorization",
    "access-control-max-age": "7200",
}


class CrossOriginSharing:
    """Lets pages of any origin use the API as programs do, anonymously or with a token (CORS).

    Credentials are never allowed, so browsers send no cookie along and show no response to a
    request that had one. A browser may still hand over a kept response to a request with a cookie,
    so such a response does not allow it, unless it is public. Public files may also be embedded,
    such as pictures.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or not _SHARED.fullmatch(scope["path"]):
            await self._app(scope, receive, send)
            return
        request = Headers(scope=scope)
        is_bare = "cookie" not in request or token_of(request) is not None
        wanted = request.get("access-control-request-method")
        if scope["method"] == "OPTIONS" and wanted is not None:
            await Response(status_code=204, headers=_PREFLIGHT)(scope, receive, send)
            return

        async def send_shared(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                is_public = headers.get("cache-control", "").startswith("public")
                if is_bare or is_public:
                    headers["access-control-allow-origin"] = "*"
                    headers["access-control-expose-headers"] = "*"
                if is_public:
                    headers["cross-origin-resource-policy"] = "cross-origin"
                else:
                    headers.add_vary_header("Cookie, Authorization")
            await send(message)

        await self._app(scope, receive, send_shared)


_ALWAYS: Final = {
    # An API's answer is no page; a page of ours says what it needs by itself.
    "content-security-policy": "default-src 'none'; frame-ancestors 'none'",
    "x-content-type-options": "nosniff",
    "referrer-policy": "same-origin",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    # No shared cache may keep answers for one person; public files set their own header.
    "cache-control": "private, no-cache",
}


class SafeHeaders:
    """Adds the security headers that an endpoint has not set itself."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def send_with(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in _ALWAYS.items():
                    headers.setdefault(name, value)
            await send(message)

        await self._app(scope, receive, send_with if scope["type"] == "http" else send)
