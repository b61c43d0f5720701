"""A browser that was sent here by another site's page changes nothing.

Source: the algorithm of F. Valsorda, "Cross-Site Request Forgery" (2025), as in Go's
net/http.CrossOriginProtection: fetch metadata first, Origin for browsers that do not send it.
Requests of programs carry neither, and no cookie of a browser.
"""

from __future__ import annotations

from urllib.parse import urlsplit

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from walltopo_gym.api.problems import problem

_SAFE = {"GET", "HEAD", "OPTIONS"}


class CrossOriginGuard:
    """Refuses what another origin's page asks for.

    Parameters
    ----------
    origin : our own, as browsers see it; a proxy may have changed Host.
    """

    def __init__(self, app: ASGIApp, origin: str) -> None:
        self._app, self._origin = app, origin

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "http" and scope["method"] not in _SAFE:
            headers = Headers(scope=scope)
            if not self._is_ours(headers):
                answer = problem(403, "this page belongs to another site; it may change nothing")
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
