"""Errors as `application/problem+json` (RFC 9457), in words for people."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from typing import Any, Final

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from sqlalchemy.exc import IntegrityError, InterfaceError, OperationalError
from starlette.exceptions import HTTPException
from starlette.responses import JSONResponse

from walltopo.core import EnvironmentLacksError, InputError, WalltopoError
from walltopo_gym.api.messages import codes_of
from walltopo_gym.errors import (
    ConflictError,
    ForbiddenError,
    NotFoundError,
    SignInNeededError,
    TooManyError,
)

_LOG = logging.getLogger("walltopo_gym.api")

_STATUS: Final[Mapping[type[WalltopoError], int]] = {
    SignInNeededError: 401,
    ForbiddenError: 403,
    NotFoundError: 404,
    ConflictError: 409,
    InputError: 422,
    TooManyError: 429,
    EnvironmentLacksError: 507,
}

# What every endpoint may answer, for the OpenAPI document.
PROBLEMS: Final[dict[int | str, dict[str, Any]]] = {
    "4XX": {
        "description": "Why not, in words",
        "content": {
            "application/problem+json": {
                "schema": {
                    "type": "object",
                    "properties": {
                        "title": {"type": "string"},
                        "status": {"type": "integer"},
                        "hint": {"type": "string"},
                        "code": {"type": "string"},
                        "hint_code": {"type": "string"},
                        "values": {"type": "object", "additionalProperties": {"type": "string"}},
                    },
                    "required": ["title", "status"],
                }
            }
        },
    }
}


def problem(
    status: int, title: str, hint: str = "", headers: Mapping[str, str] | None = None
) -> JSONResponse:
    """An answer that says what happened, and what can be done; with codes of both where they have
    one, so that the app can say it in the reader's language."""
    body: dict[str, object] = {"title": title, "status": status}
    if hint:
        body["hint"] = hint
    body |= codes_of(title, hint)
    return JSONResponse(body, status, headers, media_type="application/problem+json")


def handle_problems(app: FastAPI) -> None:
    """Let the application answer so."""
    app.add_exception_handler(WalltopoError, _told)
    app.add_exception_handler(RequestValidationError, _not_valid)
    app.add_exception_handler(HTTPException, _http)
    app.add_exception_handler(IntegrityError, _raced)
    app.add_exception_handler(OperationalError, _away)
    app.add_exception_handler(InterfaceError, _away)


def _told(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, WalltopoError)
    status = next((code for kind, code in _STATUS.items() if isinstance(error, kind)), 500)
    headers = {}
    if isinstance(error, TooManyError):
        headers["retry-after"] = str(error.seconds)
    if isinstance(error, SignInNeededError):
        headers["www-authenticate"] = "Bearer"
    return problem(status, error.message, error.hint, headers)


def _not_valid(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, RequestValidationError)
    first = error.errors()[0]
    where = " ".join(str(part) for part in first["loc"])
    return problem(422, f"{where}: {first['msg']}")


def _http(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, HTTPException)
    return problem(error.status_code, str(error.detail), headers=error.headers)


def _raced(request: Request, error: Exception) -> JSONResponse:
    """Two that did the same at the same moment: the database let one of them in."""
    _LOG.info("conflict: %s", error)
    return problem(409, "somebody else did this at the same moment", "Look again.")


def _away(request: Request, error: Exception) -> JSONResponse:
    """The database went away, or is starting: of the request all was kept, or nothing."""
    _LOG.error("the database does not answer: %s", error)
    return problem(503, "the database does not answer", "Try again soon.", {"retry-after": "2"})
