"""Errors as `application/problem+json` (RFC 9457), in plain sentences."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from typing import Any, Final

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from obstore.exceptions import BaseError as StoreError
from pydantic import BaseModel
from sqlalchemy.exc import IntegrityError, InterfaceError, OperationalError
from starlette.exceptions import HTTPException
from starlette.responses import JSONResponse

from walltopo.core import EnvironmentLacksError, InputError, WalltopoError
from walltopo_gym.database.errors import explain_error
from walltopo_gym.errors import (
    RequestError,
    SignInNeededError,
    TooManyError,
    UnavailableError,
    without_folders,
)
from walltopo_gym.spreadsheets import Fault

_LOG = logging.getLogger("walltopo_gym.api")

# Status codes of the product's errors, which have no keys.
_STATUS: Final[Mapping[type[WalltopoError], int]] = {InputError: 422, EnvironmentLacksError: 507}

# The error answers of every endpoint, for the OpenAPI document.
ERROR_RESPONSES: Final[dict[int | str, dict[str, Any]]] = {
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


def codes_of(error: RequestError) -> dict[str, object]:
    """Return `code`, `hint_code` and `values` of an error, as far as it has them."""
    found: dict[str, object] = {"code": error.key}
    if error.hint_key:
        found["hint_code"] = error.hint_key
    if error.values:
        found["values"] = {name: str(value) for name, value in error.values.items()}
    return found


class FaultOut(BaseModel):
    """An error in a line of a table, with a hint; the heading is line 1. Codes as in any error."""

    line: int
    column: str
    why: str
    hint: str
    code: str = ""
    hint_code: str = ""
    values: dict[str, str] = {}

    @classmethod
    def of(cls, fault: Fault) -> FaultOut:
        """Return it as the API has it."""
        error = fault.error
        facts = {
            "line": fault.line,
            "column": fault.column,
            "why": error.message,
            "hint": error.hint,
            **codes_of(error),
        }
        return cls.model_validate(facts)


def error_response(
    error: RequestError, status: int | None = None, headers: Mapping[str, str] | None = None
) -> JSONResponse:
    """Return a response that says what happened and what to do, in English and by key. The app
    translates the key.

    Parameters
    ----------
    status : overrides the error's own status.
    """
    return _error_response(status or error.status, error.message, error.hint, headers, error)


def _error_response(
    status: int,
    title: str,
    hint: str = "",
    headers: Mapping[str, str] | None = None,
    error: RequestError | None = None,
) -> JSONResponse:
    body: dict[str, object] = {"title": title, "status": status}
    if hint:
        body["hint"] = hint
    if error is not None:
        body |= codes_of(error)
    return JSONResponse(body, status, headers, media_type="application/problem+json")


def handle_errors(app: FastAPI) -> None:
    """Register the handlers of errors in the application."""
    app.add_exception_handler(RequestError, _handle_request_error)
    app.add_exception_handler(WalltopoError, _handle_error_of_walltopo)
    app.add_exception_handler(RequestValidationError, _handle_invalid)
    app.add_exception_handler(HTTPException, _handle_http)
    app.add_exception_handler(IntegrityError, _handle_race)
    app.add_exception_handler(OperationalError, _handle_away)
    app.add_exception_handler(InterfaceError, _handle_away)
    app.add_exception_handler(StoreError, _handle_away)


def _handle_request_error(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, RequestError)
    headers = {}
    if isinstance(error, TooManyError):
        headers["retry-after"] = str(error.seconds)
    if isinstance(error, SignInNeededError):
        headers["www-authenticate"] = "Bearer"
    return error_response(error, headers=headers)


def _handle_error_of_walltopo(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, WalltopoError)
    status = next((code for kind, code in _STATUS.items() if isinstance(error, kind)), 500)
    return _error_response(status, without_folders(error.message), without_folders(error.hint))


def _handle_invalid(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, RequestValidationError)
    first = error.errors()[0]
    where = " ".join(str(part) for part in first["loc"])
    return _error_response(422, f"{where}: {first['msg']}")


def _handle_http(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, HTTPException)
    return _error_response(error.status_code, str(error.detail), headers=error.headers)


def _handle_race(request: Request, error: Exception) -> JSONResponse:
    """Answer the loser of two simultaneous requests; the database accepted the other."""
    _LOG.info("conflict: %s", error)
    return error_response(RequestError("same-moment", "look-again"), 409)


def _handle_away(request: Request, error: Exception) -> JSONResponse:
    """Answer that the database or the file store is away, full or damaged.

    The database keeps all of a request or nothing.
    """
    _LOG.error("the database or the file store does not answer: %s", error)
    found = explain_error(error)
    if isinstance(found, UnavailableError):
        return error_response(found)
    away = found or RequestError("database-away", "try-again-soon")
    return error_response(away, 503, {"retry-after": "2"})
