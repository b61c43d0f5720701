"""The cookies of a browser: its sign-in, and the mark of a known browser."""

from __future__ import annotations

from typing import Final
from uuid import UUID

from fastapi import Request, Response
from sqlalchemy.orm import Session

from walltopo_gym.accounts.access import COOKIE
from walltopo_gym.accounts.actor import KNOWN_DAYS, is_known, recognise_browser, sign_in
from walltopo_gym.api.services import Services

BROWSER: Final = "__Host-walltopo-browser"
_DAY_S: Final = 86400


def sign_in_here(
    session: Session,
    services: Services,
    request: Request,
    response: Response,
    person: UUID,
    *,
    confirmed: bool = True,
) -> None:
    """Sign in in this browser. The secret is always new, so a planted cookie is worthless.

    Parameters
    ----------
    confirmed : whether the person proved who they are.
    """
    days = services.settings.session_days
    browser = request.headers.get("user-agent", "")
    secret = sign_in(session, person, browser, days, confirmed=confirmed)
    _set_cookie(response, COOKIE, secret, days)
    remember_browser(session, request, response, person)


def remember_browser(session: Session, request: Request, response: Response, person: UUID) -> None:
    """Mark this browser as known to the person who has just proved their identity."""
    if known_browser(session, request, person) is None:
        _set_cookie(response, BROWSER, recognise_browser(session, person), KNOWN_DAYS)


def known_browser(session: Session, request: Request, person: UUID | None) -> str | None:
    """Return the mark of this browser if this person signed in with it before."""
    secret = request.cookies.get(BROWSER)
    if person is None or secret is None or not is_known(session, person, secret):
        return None
    return secret


def sign_out_here(response: Response) -> None:
    """Sign out in this browser; it stays known. Its cache has files of private gyms."""
    response.headers["clear-site-data"] = '"cache"'
    response.delete_cookie(COOKIE, path="/", secure=True, httponly=True, samesite="lax")


def _set_cookie(response: Response, name: str, secret: str, days: int) -> None:
    response.set_cookie(
        name, secret, max_age=days * _DAY_S, path="/", secure=True, httponly=True, samesite="lax"
    )
