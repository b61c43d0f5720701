"""Count, time and log every request under an id; the log's format.

The id comes from the proxy if it sends one (`X-Request-ID`), and the response has it, so that a
person's report and the operator's log can be matched.
"""

from __future__ import annotations

import logging
import re
import time
from contextvars import ContextVar
from typing import Any, Final, Literal
from urllib.parse import quote
from uuid import uuid4

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from walltopo_gym.api.error_responses import error_response
from walltopo_gym.database.lock import lock_scope
from walltopo_gym.errors import RequestError
from walltopo_gym.log_lines import PlainFormatter
from walltopo_gym.operating.metrics import Metrics

# Read by the log's filter: whatever is logged during a request bears its id.
REQUEST: ContextVar[str] = ContextVar("request", default="")

_LOG = logging.getLogger("walltopo_gym.requests")

_HEADER: Final = "x-request-id"

_PLAUSIBLE: Final = re.compile(r"[\w.-]{8,64}", re.ASCII)


class RequestLogMiddleware:
    """The outermost middleware."""

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
            with lock_scope():
                await self._app(scope, receive, send_with_id)
        except Exception:
            _LOG.exception("a defect")
            if status:  # the answer had begun; it breaks off
                raise
            answer = error_response(RequestError("defect", "defect-log"), 500)
            await answer(scope, receive, send_with_id)
        finally:
            self._note(scope, status or 500, time.perf_counter() - begun)
            REQUEST.reset(token)

    def _note(self, scope: Scope, status: int, seconds: float) -> None:
        # The endpoint by its name, of which there are few; the path stands in the log, the query
        # nowhere.
        name = getattr(scope.get("endpoint"), "__name__", "(none)")
        self._metrics.count_request(name, status, seconds)
        client, path = scope.get("client"), _raw_path(scope)
        _LOG.info(
            "%s %s %s",
            scope["method"],
            path,
            status,
            extra={
                "method": scope["method"],
                "path": path,
                "status": status,
                "ms": round(1000 * seconds, 1),
                "client": client[0] if client else "",
            },
        )


def _raw_path(scope: Scope) -> str:
    """Return a request's path as it was sent, percent-encoded; ASGI lets servers leave it out."""
    raw = scope.get("raw_path")
    if raw is None:
        return quote(scope["path"])
    return bytes(raw).partition(b"?")[0].decode("ascii", "backslashreplace")


class _WithRequest(logging.Filter):
    """Adds the id of the current request to each log line."""

    def filter(self, record: logging.LogRecord) -> bool:
        record.request = REQUEST.get()
        return True


def log_config(kind: Literal["plain", "json"]) -> dict[str, Any]:
    """Return the configuration for `logging.config.dictConfig` and uvicorn, whose own access log is
    off.

    Libraries log to the same handler, because what they log has strangers' texts, too.
    """
    line = "%(asctime)s %(levelname)s %(name)s %(message)s %(request)s"
    plain = {"()": PlainFormatter, "fmt": line}
    objects = {
        "()": "pythonjsonlogger.json.JsonFormatter",
        "format": line,
        "rename_fields": {"asctime": "at", "levelname": "level", "name": "logger"},
    }
    own = {"handlers": ["stderr"], "level": "INFO", "propagate": False}
    return {
        "version": 1,
        "disable_existing_loggers": False,
        "filters": {"request": {"()": _WithRequest}},
        "formatters": {"lines": plain if kind == "plain" else objects},
        "handlers": {
            "stderr": {
                "class": "logging.StreamHandler",
                "stream": "ext://sys.stderr",
                "formatter": "lines",
                "filters": ["request"],
            }
        },
        # DBOS adds a handler of its own to a logger that has none.
        "loggers": {"walltopo_gym": own, "uvicorn": own, "dbos": {**own, "level": "WARNING"}},
        "root": {"handlers": ["stderr"], "level": "WARNING"},
    }
