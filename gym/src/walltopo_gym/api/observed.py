"""Every request is counted, timed, and noted in the log under an id; a defect, too.

The id comes from the proxy in front where it sends one (`X-Request-ID`), and is told in the answer:
what a person reports and what the operator's log says are found together.
"""

from __future__ import annotations

import logging
import re
import time
from contextvars import ContextVar
from typing import Final
from uuid import uuid4

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from walltopo_gym.api.metrics import Metrics
from walltopo_gym.api.problems import problem

# Read by the log's filter: whatever is logged during a request bears its id.
REQUEST: ContextVar[str] = ContextVar("request", default="")

_LOG = logging.getLogger("walltopo_gym.requests")
_HEADER: Final = "x-request-id"
_PLAUSIBLE: Final = re.compile(r"[\w.-]{8,64}", re.ASCII)


class Observed:
    """The outermost layer."""

    def __init__(self, app: ASGIApp, metrics: Metrics) -> None:
        self._app, self._metrics = app, metrics

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        given = Headers(scope=scope).get(_HEADER, "")
        request = given if _PLAUSIBLE.fullmatch(given) else uuid4().hex
        status = 0
        begun = time.perf_counter()

        async def send_with_id(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                MutableHeaders(scope=message)[_HEADER] = request
            await send(message)

        token = REQUEST.set(request)
        try:
            await self._app(scope, receive, send_with_id)
        except Exception:
            _LOG.exception("a defect")
            if status:  # the answer had begun; it breaks off
                raise
            answer = problem(500, "a defect in walltopo gym", "The operator's log says more.")
            await answer(scope, receive, send_with_id)
        finally:
            self._note(scope, status or 500, time.perf_counter() - begun)
            REQUEST.reset(token)

    def _note(self, scope: Scope, status: int, seconds: float) -> None:
        # The endpoint by its name, of which there are few; the path stands in the log, the query
        # nowhere.
        name = getattr(scope.get("endpoint"), "__name__", "(none)")
        self._metrics.note(name, status, seconds)
        client = scope.get("client")
        _LOG.info(
            "%s %s %s", scope["method"], scope["path"], status,
            extra={"method": scope["method"], "path": scope["path"], "status": status,
                   "ms": round(1000 * seconds, 1), "client": client[0] if client else ""},
        )  # fmt: skip
