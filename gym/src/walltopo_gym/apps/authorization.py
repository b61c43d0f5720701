"""Authorization requests of apps (OAuth 2.1, 4.1), and the person's answer.

Written here rather than taken from Authlib: its server part is an optional dependency of this
package, has no FastAPI integration, and stores codes and tokens through mixins that query for
themselves. Single use with its consequences, rotation with reuse detection, free loopback ports and
`iss` would still be ours. The rest of it is shorter here than its adapters would be.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import timedelta
from typing import Final
from urllib.parse import urlencode
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.actor import Scope
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.models import App, AppConnection, AppGrant, Person
from walltopo_gym.accounts.secrets import new_secret
from walltopo_gym.apps.parameters import Parameters, read_parameters
from walltopo_gym.apps.redirects import is_registered
from walltopo_gym.clock import now
from walltopo_gym.database.engine import take_turn
from walltopo_gym.errors import RequestError

_CODE_LASTS: Final = timedelta(seconds=60)
_CHALLENGE: Final = re.compile(r"[A-Za-z0-9_-]{43}")
# Targets that an app may name for its tokens (RFC 8707), below the server's address.
_RESOURCES: Final = ("", "/", "/api/v1", "/mcp")


class AuthorizationError(Exception):
    """A request that is answered to the app, not to the person.

    Parameters
    ----------
    address : where the browser goes, with the error (OAuth 2.1, 4.1.2.1).
    """

    def __init__(self, address: str) -> None:
        super().__init__(address)
        self.address = address


@dataclass(frozen=True)
class AuthorizationRequest:
    """A valid request of an app.

    Parameters
    ----------
    redirect : where the answer goes. challenge : of PKCE, S256. state : handed back; None: none.
    issuer : this server, in answers (RFC 9207).
    """

    app: App
    redirect: str
    scopes: tuple[Scope, ...]
    challenge: str
    state: str | None
    issuer: str

    def answer(self, **fields: str) -> str:
        """Return the address that hands an answer to the app."""
        return _answer_address(self.redirect, self.issuer, self.state, fields)


def _answer_address(
    redirect: str, issuer: str, state: str | None, fields: Mapping[str, str]
) -> str:
    known = {**fields, **({} if state is None else {"state": state}), "iss": issuer}
    # The registered address stays as it is, letter by letter; it has no fragment.
    joint = "" if redirect.endswith(("?", "&")) else "&" if "?" in redirect else "?"
    return f"{redirect}{joint}{urlencode(known)}"


def read_request(session: Session, issuer: str, query: str) -> AuthorizationRequest:
    """Return the request in the query of `/oauth/authorize`.

    Raises
    ------
    RequestError : the app or its redirect address is unknown, so that nobody gets an answer.
    AuthorizationError : anything else is wrong.
    """
    given = _parse_query(query)
    values = given.once
    app = _app_named(session, values.get("client_id", ""))
    redirect = _redirect_of(app, given)
    state = values.get("state")

    def refuse(error: str, why: str) -> AuthorizationError:
        fields = {"error": error, "error_description": why}
        return AuthorizationError(_answer_address(redirect, issuer, state, fields))

    if given.twice:
        raise refuse("invalid_request", f"{min(given.twice)} comes twice")
    if values.get("response_type") != "code":
        raise refuse("unsupported_response_type", "response_type must be code")
    if values.get("code_challenge_method") != "S256":
        raise refuse("invalid_request", "code_challenge_method must be S256")
    challenge = values.get("code_challenge", "")
    if not _CHALLENGE.fullmatch(challenge):
        raise refuse("invalid_request", "code_challenge must have 43 characters of base64url")
    targets = {issuer + path for path in _RESOURCES}
    if not targets.issuperset(given.resources):
        raise refuse("invalid_target", f"resource must be {issuer}/api/v1 or {issuer}/mcp")
    wanted = set(values.get("scope", Scope.READ).split())
    if not wanted or not wanted <= set(Scope):
        raise refuse("invalid_scope", f"scopes are {' '.join(Scope)}")
    scopes = tuple(scope for scope in Scope if scope in wanted)
    return AuthorizationRequest(app, redirect, scopes, challenge, state, issuer)


def _parse_query(query: str) -> Parameters:
    try:
        return read_parameters(query.removeprefix("?"))
    except ValueError as error:
        raise RequestError("app-request-odd", "app-ask-maker") from error


def _app_named(session: Session, client_id: str) -> App:
    found = find_app(session, client_id)
    if found is None:
        raise RequestError("app-unknown", "app-ask-maker")
    return found


def find_app(session: Session, client_id: str) -> App | None:
    """Return the app with a client id; None if there is none or its maker's account is locked."""
    try:
        key = UUID(client_id)
    except ValueError:
        return None
    found = select(App).join(Person, Person.id == App.person_id)
    return session.scalar(found.where(App.id == key, Person.locked_at.is_(None)))


def _redirect_of(app: App, given: Parameters) -> str:
    address = given.once.get("redirect_uri", "")
    if not address and "redirect_uri" not in given.twice and len(app.redirects) == 1:
        return app.redirects[0]
    if not is_registered(address, app.redirects):
        raise RequestError("app-redirect-unknown", "app-ask-maker")
    return address


def approve(session: Session, person: UUID, request: AuthorizationRequest) -> str:
    """Store a person's consent, and return the address that hands a code to the app.

    Consents in force stay: the person may use the app on several devices.
    """
    take_turn(session, f"app {request.app.id} {person}")
    named = AppConnection.app_id == request.app.id, AppConnection.person_id == person
    connection = session.scalar(select(AppConnection).where(*named))
    if connection is None:
        connection = AppConnection(app_id=request.app.id, person_id=person)
        session.add(connection)
        session.flush()
    code, kept = new_secret()
    scopes = [scope.value for scope in request.scopes]
    session.add(
        AppGrant(
            connection_id=connection.id,
            code_hash=kept,
            challenge=request.challenge,
            redirect=request.redirect,
            scopes=scopes,
            expires_at=now() + _CODE_LASTS,
        )
    )
    app = str(request.app.id)
    allowed = " ".join(scopes)
    log_change(
        session, "app.connect", person=person, subject=request.app.name, app=app, scopes=allowed
    )
    return request.answer(code=code)
