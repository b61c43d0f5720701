"""Who may ask for what: checked on the head of a request, before its body is read.

A page of another origin, open in the same browser, must neither read the wall nor change it, and a
foreign name that leads to this machine (DNS rebinding) must not reach it. Every refusal closes its
connection, so that what is left of a refused request is never read as the next one.
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

API = "/api/"  # for those who have the token
TOKEN = "x-walltopo-token"
MOST_BODY = 8_000_000  # bytes
MOST_HEAD = 16_000  # bytes

HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
}


@dataclass(frozen=True)
class Rules:
    """What a server allows.

    Parameters
    ----------
    names : allowed values of `Host`.
    token : what a request must know to read and save edits; None: no edit mode.
    embed : origins whose pages may show this one in a frame.
    """

    names: frozenset[str]
    token: str | None = None
    embed: tuple[str, ...] = ()

    def knows(self, said: str | None) -> bool:
        """Whether this is the run's token; takes as long for a wrong one."""
        if self.token is None or said is None:
            return False
        return hmac.compare_digest(said.encode(), self.token.encode())


@dataclass(frozen=True)
class _Refusal:
    status: HTTPStatus
    text: str
    key: str = ""


def policy(embed: tuple[str, ...] = ()) -> str:
    """The Content-Security-Policy that the viewer and the report need, and no more."""
    ancestors = " ".join(embed) or "'none'"
    return (
        "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; "
        "style-src 'self' 'unsafe-inline'; img-src 'self' blob: data:; "
        "connect-src 'self' blob:; worker-src blob:; base-uri 'none'; "
        f"form-action 'none'; frame-ancestors {ancestors}"
    )


def problem(path: str, status: int, text: str, key: str = "") -> Response:
    """An error as its reader wants it: JSON for the editor, a line for a person.

    Parameters
    ----------
    key : for the editor's own words, see `walltopo.core.errors.problem_key`.
    """
    if path.startswith(API):
        return JSONResponse({"error": text, "key": key}, status)
    return PlainTextResponse(text + "\n", status)


class Guard:
    """ASGI middleware around everything, so that no answer goes without its headers."""

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
    if size <= MOST_HEAD:
        return None
    return _Refusal(HTTPStatus.REQUEST_HEADER_FIELDS_TOO_LARGE, "the request's head is too large")


def _name(request: Request, rules: Rules) -> _Refusal | None:
    hosts = request.headers.getlist("host")
    if len(hosts) == 1 and hosts[0].lower() in rules.names:
        return None
    return _Refusal(HTTPStatus.FORBIDDEN, "open the address that `walltopo view` shows")


def _other_page(request: Request, rules: Rules) -> _Refusal | None:
    """What browsers say about the page that asks; other programs say nothing."""
    headers = request.headers
    if headers.get("sec-fetch-site", "none") in ("none", "same-origin"):
        return None
    shown_as = headers.get("sec-fetch-dest")
    if headers.get("sec-fetch-mode") == "navigate" and request.method in ("GET", "HEAD"):
        if shown_as == "document":  # a link that somebody followed
            return None
        if shown_as == "iframe" and rules.embed:  # by whom: the policy's frame-ancestors
            return None
    return _Refusal(HTTPStatus.FORBIDDEN, "another web page asked for this")


def _method(request: Request, _: Rules) -> _Refusal | None:
    if request.method in ("GET", "HEAD"):
        return None
    if request.method == "POST" and request.scope["path"].startswith(API):
        return None
    return _Refusal(HTTPStatus.METHOD_NOT_ALLOWED, f"{request.method} is not for this address")


def _body(request: Request, _: Rules) -> _Refusal | None:
    """A body of declared and bounded length where one is read, none elsewhere."""
    headers = request.headers
    if request.method != "POST":
        if "transfer-encoding" in headers or headers.get("content-length", "0") != "0":
            return _Refusal(HTTPStatus.BAD_REQUEST, f"{request.method} comes without a body")
        return None
    length = headers.get("content-length", "")
    if "transfer-encoding" in headers or not (length.isascii() and length.isdigit()):
        return _Refusal(HTTPStatus.LENGTH_REQUIRED, "the length of the edits must be said first")
    if len(length) > 12 or int(length) > MOST_BODY:
        return _Refusal(
            HTTPStatus.REQUEST_ENTITY_TOO_LARGE,
            f"the edits are larger than {MOST_BODY // 1_000_000} MB",
            "large",
        )
    return None


def _editor(request: Request, rules: Rules) -> _Refusal | None:
    """Edits are for those who were given the token."""
    if not request.scope["path"].startswith(API):
        return None
    if rules.token is None:
        return _Refusal(HTTPStatus.NOT_FOUND, "this page is not in edit mode")
    if rules.knows(request.headers.get(TOKEN)):
        return None
    return _Refusal(
        HTTPStatus.FORBIDDEN,
        "edits are for the address that `walltopo view` shows now, with its token",
        "token",
    )


def _own_page(request: Request, _: Rules) -> _Refusal | None:
    """A write comes from a page of this very address, as JSON: no form of a browser sends that."""
    if request.method != "POST":
        return None
    headers = request.headers
    if headers.getlist("origin") != [f"http://{headers['host'].lower()}"]:
        return _Refusal(HTTPStatus.FORBIDDEN, "edits are taken from this page only")
    if not _is_json(headers):
        return _Refusal(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, "expected application/json")
    return None


def _is_json(headers: Headers) -> bool:
    return headers.get("content-type", "").split(";")[0].strip().lower() == "application/json"


# In this order: `_own_page` relies on a Host that `_name` has accepted.
_CHECKS: tuple[Callable[[Request, Rules], _Refusal | None], ...] = (
    _head_size,
    _name,
    _other_page,
    _method,
    _own_page,
    _editor,
    _body,
)
