"""Endpoints of OAuth 2.1 for programs: tokens, their end, and the descriptions of the server.

These addresses are fixed by standards and are not part of the API. No cookie is read here, so pages
of any origin may call them.
"""

from __future__ import annotations

import base64
import binascii
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Final
from urllib.parse import unquote_plus

from fastapi import APIRouter, Depends, Request
from sqlalchemy.orm import Session
from starlette.responses import JSONResponse

from walltopo_gym.accounts.actor import Scope
from walltopo_gym.accounts.limits import count_app_token
from walltopo_gym.accounts.models import App
from walltopo_gym.api.services import Services, ServicesOf, network_of
from walltopo_gym.apps.authorization import find_app
from walltopo_gym.apps.parameters import Parameters, read_parameters
from walltopo_gym.apps.tokens import (
    ACCESS_LASTS,
    OAuthError,
    Tokens,
    check_secret,
    redeem_code,
    refresh_tokens,
    revoke,
)
from walltopo_gym.errors import TooManyError

router = APIRouter(include_in_schema=False)

_FORM: Final = "application/x-www-form-urlencoded"
_UNSTORED: Final = {"cache-control": "no-store"}
_METHODS: Final = ["none", "client_secret_basic", "client_secret_post"]


@dataclass(frozen=True)
class _Form:
    """The form of a request; `is_form`: whether the body is a form at all."""

    parameters: Parameters
    is_form: bool

    @property
    def fields(self) -> Mapping[str, str]:
        """Return the fields that come once, with a value."""
        return self.parameters.once

    def need(self, name: str) -> str:
        """Return a field.

        Raises
        ------
        OAuthError : it is missing.
        """
        if name not in self.fields:
            raise OAuthError("invalid_request", f"{name} is missing")
        return self.fields[name]


async def _read_form(request: Request) -> _Form:
    kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    try:
        found = read_parameters((await request.body()).decode())
    except ValueError:
        return _Form(Parameters({}), is_form=False)
    return _Form(found, kind == _FORM)


FormOf = Annotated[_Form, Depends(_read_form)]


@router.post("/oauth/token")
def make_tokens(form: FormOf, request: Request, services: ServicesOf) -> JSONResponse:
    """Exchange a code or a refresh token for tokens."""
    return _run_endpoint(request, lambda: _make_tokens(form, request, services))


@router.post("/oauth/revoke")
def revoke_token(form: FormOf, request: Request, services: ServicesOf) -> JSONResponse:
    """End a token (RFC 7009)."""
    return _run_endpoint(request, lambda: _revoke_token(form, request, services))


def _run_endpoint(request: Request, work: Callable[[], dict[str, Any]]) -> JSONResponse:
    """Return the response of an endpoint, or its refusal as OAuth states it."""
    try:
        return JSONResponse(work(), headers=_UNSTORED)
    except OAuthError as error:
        body = {"error": error.error, "error_description": error.why}
        if error.error != "invalid_client":
            return JSONResponse(body, 400, _UNSTORED)
        basic = {"www-authenticate": 'Basic realm="walltopo"'}
        sent = "authorization" in request.headers
        return JSONResponse(body, 401, _UNSTORED | (basic if sent else {}))
    except TooManyError as error:
        body = {"error": "temporarily_unavailable", "error_description": error.message}
        return JSONResponse(body, 429, _UNSTORED | {"retry-after": str(error.seconds)})


def _make_tokens(form: _Form, request: Request, services: Services) -> dict[str, Any]:
    _check_form(form, request, services)
    kind = form.need("grant_type")
    if kind not in ("authorization_code", "refresh_token"):
        raise OAuthError("unsupported_grant_type", "use authorization_code or refresh_token")
    with services.database.writing() as session:
        app = _identify_client(session, form, request)
        if kind == "authorization_code":
            found = redeem_code(
                session,
                app,
                form.need("code"),
                form.fields.get("redirect_uri", ""),
                form.need("code_verifier"),
            )
        else:
            scopes = form.fields.get("scope", "").split()
            found = refresh_tokens(session, app, form.need("refresh_token"), scopes)
    if isinstance(found, OAuthError):
        raise found
    return _tokens_out(found)


def _tokens_out(tokens: Tokens) -> dict[str, Any]:
    return {
        "access_token": tokens.access,
        "token_type": "Bearer",
        "expires_in": int(ACCESS_LASTS.total_seconds()),
        "refresh_token": tokens.refresh,
        "scope": " ".join(tokens.scopes),
    }


def _revoke_token(form: _Form, request: Request, services: Services) -> dict[str, Any]:
    _check_form(form, request, services)
    with services.database.writing() as session:
        revoke(session, _identify_client(session, form, request), form.need("token"))
    return {}


def _check_form(form: _Form, request: Request, services: Services) -> None:
    """Count the request and refuse a body that is not a plain form."""
    with services.database.writing() as session:
        count_app_token(session, network_of(request))
    if not form.is_form:
        raise OAuthError("invalid_request", f"the body must be {_FORM}")
    if form.parameters.twice:
        raise OAuthError("invalid_request", f"{form.parameters.twice[0]} comes twice")


def _identify_client(session: Session, form: _Form, request: Request) -> App:
    """Return the app that sent a request, by one of `_METHODS`.

    Raises
    ------
    OAuthError : it is unknown, or does not prove to be the app.
    """
    kind, _, sent = request.headers.get("authorization", "").partition(" ")
    client_id, secret = form.fields.get("client_id", ""), form.fields.get("client_secret")
    if kind:
        if secret is not None:
            raise OAuthError("invalid_request", "the client secret comes twice")
        named, secret = _parse_basic_auth(kind, sent)
        if client_id not in ("", named):
            raise OAuthError("invalid_request", "client_id differs from the header")
        client_id = named
    app = find_app(session, client_id)
    if app is None:
        raise OAuthError("invalid_client", "no such client")
    check_secret(app, secret)
    return app


def _parse_basic_auth(kind: str, sent: str) -> tuple[str, str]:
    """Return client id and secret of the header `Authorization: Basic` (OAuth 2.1, 2.4.1)."""
    try:
        text = base64.b64decode(sent.strip(), validate=True).decode()
    except (binascii.Error, ValueError) as error:
        raise OAuthError("invalid_client", "the header is not Basic") from error
    if kind.lower() != "basic" or ":" not in text:
        raise OAuthError("invalid_client", "the header is not Basic")
    client_id, _, secret = text.partition(":")
    return unquote_plus(client_id), unquote_plus(secret)


@router.get("/.well-known/oauth-authorization-server")
def describe_server(services: ServicesOf) -> dict[str, Any]:
    """Return what the authorization server can do (RFC 8414)."""
    base = services.settings.link_base
    return {
        "issuer": base,
        "authorization_endpoint": f"{base}/oauth/authorize",
        "token_endpoint": f"{base}/oauth/token",
        "revocation_endpoint": f"{base}/oauth/revoke",
        "scopes_supported": [scope.value for scope in Scope],
        "response_types_supported": ["code"],
        "response_modes_supported": ["query"],
        "grant_types_supported": ["authorization_code", "refresh_token"],
        "token_endpoint_auth_methods_supported": _METHODS,
        "revocation_endpoint_auth_methods_supported": _METHODS,
        "code_challenge_methods_supported": ["S256"],
        "authorization_response_iss_parameter_supported": True,
    }


@router.get("/.well-known/oauth-protected-resource")
@router.get("/.well-known/oauth-protected-resource/{path:path}")
def describe_resource(services: ServicesOf, path: str = "") -> dict[str, Any]:
    """Return which server gives tokens for an address of this one (RFC 9728)."""
    base = services.settings.link_base
    # The tools of assistants read alone: an assistant that asks for all scopes asks for no more.
    scopes = [Scope.READ] if path == "mcp" else list(Scope)
    return {
        "resource": f"{base}/{path}".rstrip("/"),
        "authorization_servers": [base],
        "scopes_supported": [scope.value for scope in scopes],
        "bearer_methods_supported": ["header"],
    }
