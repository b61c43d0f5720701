"""Signing in by another server. These addresses are for browsers and not part of the API."""

from __future__ import annotations

import hmac
from typing import Annotated, Final

from fastapi import APIRouter, Query, Request
from starlette.responses import RedirectResponse

from walltopo_gym.accounts.cookies import sign_in_here
from walltopo_gym.accounts.oidc import (
    Provider,
    begin_sign_in,
    claims_of,
    person_of,
    store_attempt,
    use_attempt,
)
from walltopo_gym.api.services import ServicesOf
from walltopo_gym.api.turns import turn_for
from walltopo_gym.errors import NotFoundError, SignInNeededError
from walltopo_gym.settings import GymSettings

router = APIRouter(include_in_schema=False)

_COOKIE: Final = "__Host-walltopo-oidc"
_CALLBACK: Final = "/oidc/callback"
_SIGNED_IN: Final = "/sign-in/done"  # the app leads on from there
# A provider that says nothing holds up few threads.
ProviderTurn = Annotated[None, turn_for("provider", 8)]


def _provider(settings: GymSettings) -> Provider:
    if not settings.oidc_issuer:
        raise NotFoundError("not-found")
    return Provider(
        settings.oidc_issuer,
        settings.oidc_client_id,
        settings.oidc_client_secret,
        settings.link_base + _CALLBACK,
    )


@router.get("/oidc/sign-in")
def go_to_provider(services: ServicesOf, _: ProviderTurn) -> RedirectResponse:
    """Redirect the browser to the provider."""
    provider = _provider(services.settings)
    attempt = begin_sign_in(provider)
    with services.database.writing() as session:
        store_attempt(session, attempt)
    answer = RedirectResponse(attempt.url, 303)
    answer.set_cookie(
        _COOKIE, attempt.state, max_age=600, path="/", secure=True, httponly=True, samesite="lax"
    )
    return answer


@router.get(_CALLBACK)
def come_back(
    request: Request,
    services: ServicesOf,
    _: ProviderTurn,
    state: Annotated[str, Query(max_length=200)] = "",
    code: Annotated[str, Query(max_length=4000)] = "",
) -> RedirectResponse:
    """Sign in the browser that comes back from the provider."""
    provider = _provider(services.settings)
    if not state or not hmac.compare_digest(
        request.cookies.get(_COOKIE, "").encode(), state.encode()
    ):
        raise SignInNeededError("sign-in-other-browser", "sign-in-again")
    with services.database.writing() as session:
        nonce, verifier = use_attempt(session, state)
    claims = claims_of(provider, code, nonce, verifier)
    answer = RedirectResponse(_SIGNED_IN, 303)
    with services.database.writing() as session:
        may = services.settings.sign_up == "open"
        person = person_of(session, claims, may_sign_up=may)
        sign_in_here(session, services, request, answer, person, confirmed=claims.is_fresh)
    answer.delete_cookie(_COOKIE, path="/", secure=True, httponly=True, samesite="lax")
    return answer
