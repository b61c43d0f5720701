"""Access rules of the local server, checked on a request's head before its body is read.

A page of another origin in the same browser must neither read nor change the wall. A foreign name
that resolves to this machine (DNS rebinding) must not reach the wall. Every refusal closes its
connection, so that the rest of a refused request is never parsed as the next one.
"""

from __future__ import annotations

import hmac
from collections.abc import Callable
from dataclasses import dataclass
from http import HTTPStatus

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import Request
from starlette.responses import JSONResponse, PlainTextResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

API = "/api/"  # needs the token
TOKEN = "x-walltopo-token"
MAX_BODY = 8_000_000  # bytes
MAX_HEAD = 16_000  # bytes

HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
}


@dataclass(frozen=True)
class Rules:
    """The access rules of a server.

    Parameters
    ----------
    names : allowed values of `Host`.
    token : secret that a request needs to read and save edits; None disables edit mode.
    embed : origins whose pages may embed this one in a frame.
    """

    names: frozenset[str]
    token: str | None = None
    embed: tuple[str, ...] = ()

    def knows(self, token_sent: str | None) -> bool:
        """Return whether this is the run's token, in constant time."""
        if self.token is None or token_sent is None:
            return False
        return hmac.compare_digest(token_sent.encode(), self.token.encode())


@dataclass(frozen=True)
class _Refusal:
    status: HTTPStatus
    text: str
    key: str = ""


def policy(embed: tuple[str, ...] = ()) -> str:
    """Return the minimal Content-Security-Policy for the viewer and the report."""
    ancestors = " ".join(embed) or "'none'"
    return (
        "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; "
        "style-src 'self' 'unsafe-inline'; img-src 'self' blob: data:; "
        "connect-src 'self' blob:; worker-src blob:; base-uri 'none'; "
        f"form-action 'none'; frame-ancestors {ancestors}"
    )


def problem(path: str, status: int, text: str, key: str = "") -> Response:
    """Return an error response: JSON for the editor, a line of text for a person.

    Parameters
    ----------
    key : `walltopo.core.errors.problem_key`, with which the editor translates the error.
    """
    if path.startswith(API):
        return JSONResponse({"error": text, "key": key}, status)
    return PlainTextResponse(text + "\n", status)


class Guard:
    """ASGI middleware around the whole application, so that every response gets the headers."""

    def __init__(self, app: ASGIApp, rules: Rules) -> None:
        self.app = app
        self.rules = rules

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                self._complete(MutableHeaders(scope=message), message["status"])
            await send(message)

        request = Request(scope)
        refusal = next(filter(None, (check(request, self.rules) for check in _CHECKS)), None)
        if refusal is None:
            await self.app(scope, receive, guarded)
        else:
            answer = problem(request.scope["path"], refusal.status, refusal.text, refusal.key)
            await answer(scope, receive, guarded)

    def _complete(self, headers: MutableHeaders, status: int) -> None:
        headers.update(HEADERS)
        headers.setdefault("Content-Security-Policy", policy(self.rules.embed))
        headers.setdefault("Cache-Control", "no-cache")
        if status >= 400:
            headers["Connection"] = "close"


def _head_size(request: Request, _: Rules) -> _Refusal | None:
    size = sum(len(name) + len(value) + 4 for name, value in request.scope["headers"])
    size += len(request.scope["raw_path"]) + len(request.scope["query_string"])
    if size <= MAX_HEAD:
        return None
    return _Refusal(HTTPStatus.REQUEST_HEADER_FIELDS_TOO_LARGE, "the request's head is too large")


def _name(request: Request, rules: Rules) -> _Refusal | None:
    hosts = request.headers.getlist("host")
    if len(hosts) == 1 and hosts[0].lower() in rules.names:
        return None
    return _Refusal(HTTPStatus.FORBIDDEN, "open the address that `walltopo view` shows")


def _other_page(request: Request, rules: Rules) -> _Refusal | None:
    """Refuse requests of other pages, by the browser's fetch metadata; other programs send none."""
    headers = request.headers
    if headers.get("sec-fetch-site", "none") in ("none", "same-origin"):
        return None
    shown_as = headers.get("sec-fetch-dest")
    if headers.get("sec-fetch-mode") == "navigate" and request.method in ("GET", "HEAD"):
        if shown_as == "document":  # the person followed a link
            return None
        if shown_as == "iframe" and rules.embed:  # frame-ancestors of the policy limits by whom
            return None
    return _Refusal(HTTPStatus.FORBIDDEN, "another web page sent this request")


def _method(request: Request, _: Rules) -> _Refusal | None:
    if request.method in ("GET", "HEAD"):
        return None
    if request.method == "POST" and request.scope["path"].startswith(API):
        return None
    return _Refusal(HTTPStatus.METHOD_NOT_ALLOWED, f"{request.method} is not allowed here")


def _check_body(request: Request, _: Rules) -> _Refusal | None:
    """Require a declared, bounded length for the body of a POST, and no body elsewhere."""
    headers = request.headers
    if request.method != "POST":
        if "transfer-encoding" in headers or headers.get("content-length", "0") != "0":
            return _Refusal(HTTPStatus.BAD_REQUEST, f"{request.method} must not have a body")
        return None
    length = headers.get("content-length", "")
    if "transfer-encoding" in headers or not (length.isascii() and length.isdigit()):
        return _Refusal(HTTPStatus.LENGTH_REQUIRED, "the length of the edits must be declared")
    if len(length) > 12 or int(length) > MAX_BODY:
        return _Refusal(
            HTTPStatus.REQUEST_ENTITY_TOO_LARGE,
            f"the edits are larger than {MAX_BODY // 1_000_000} MB",
            "large",
        )
    return None


def _check_editor_token(request: Request, rules: Rules) -> _Refusal | None:
    """Require the token for the API."""
    if not request.scope["path"].startswith(API):
        return None
    if rules.token is None:
        return _Refusal(HTTPStatus.NOT_FOUND, "this page is not in edit mode")
    if rules.knows(request.headers.get(TOKEN)):
        return None
    return _Refusal(
        HTTPStatus.FORBIDDEN,
        "edits need the address, with its token, that `walltopo view` shows now",
        "token",
    )


def _own_page(request: Request, _: Rules) -> _Refusal | None:
    """Require that a write comes from this page as JSON, which no HTML form can send."""
    if request.method != "POST":
        return None
    headers = request.headers
    if headers.getlist("origin") != [f"http://{headers['host'].lower()}"]:
        return _Refusal(HTTPStatus.FORBIDDEN, "edits are accepted from this page only")
    if not _is_json(headers):
        return _Refusal(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, "expected application/json")
    return None


def _is_json(headers: Headers) -> bool:
    return headers.get("content-type", "").split(";")[0].strip().lower() == "application/json"


# The order matters: `_own_page` relies on a Host that `_name` has accepted.
_CHECKS: tuple[Callable[[Request, Rules], _Refusal | None], ...] = (
    _head_size,
    _name,
    _other_page,
    _method,
    _own_page,
    _check_editor_token,
    _check_body,
)
