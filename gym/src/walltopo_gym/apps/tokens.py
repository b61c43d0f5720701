"""Tokens of apps: codes and refresh tokens are exchanged once, and a second use ends them all."""

from __future__ import annotations

import base64
import hashlib
import hmac
import re
from collections.abc import Collection
from dataclasses import dataclass
from datetime import timedelta
from typing import Final
from uuid import UUID

from sqlalchemy import ColumnElement, Select, delete, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.actor import TOKEN_PREFIX
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.limits import count_refresh
from walltopo_gym.accounts.models import (
    ApiToken,
    App,
    AppConnection,
    AppGrant,
    AppRefreshToken,
    Person,
)
from walltopo_gym.accounts.secrets import hash_of, new_secret
from walltopo_gym.clock import now

ACCESS_LASTS: Final = timedelta(hours=1)
# A refresh token that an app does not use for so long ends.
_REFRESH_LASTS: Final = timedelta(days=90)
_REFRESH_PREFIX: Final = "wtgr_"
# Used refresh tokens are known for so long; later a second use is that of an unknown one.
_REUSE_SEEN: Final = timedelta(days=7)
_VERIFIER: Final = re.compile(r"[A-Za-z0-9._~-]{43,128}")


class OAuthError(Exception):
    """A refusal of the token endpoint (OAuth 2.1, 3.2.4).

    Parameters
    ----------
    error : code of the specification; why : in English, for the app's developer.
    """

    def __init__(self, error: str, why: str) -> None:
        super().__init__(why)
        self.error, self.why = error, why


@dataclass(frozen=True)
class Tokens:
    """New tokens of an app; their secrets are stored as hashes only."""

    access: str
    refresh: str
    scopes: tuple[str, ...]


@dataclass(frozen=True)
class _Subject:
    """A grant with its owner and app."""

    grant: AppGrant
    connection: AppConnection


def check_secret(app: App, secret: str | None) -> None:
    """Refuse a client that does not prove to be the app.

    Parameters
    ----------
    secret : as sent; None: none was sent, as by a public client.

    Raises
    ------
    OAuthError : the secret is wrong or missing, or a public client sent one.
    """
    if app.password_hash is None:
        if secret is not None:
            raise OAuthError("invalid_client", "a public client has no secret")
        return
    if secret is None or not hmac.compare_digest(app.password_hash, hash_of(secret)):
        raise OAuthError("invalid_client", "the client secret is wrong or missing")


def redeem_code(
    session: Session, app: App, code: str, redirect: str, verifier: str
) -> Tokens | OAuthError:
    """Exchange a code for tokens. A second use ends all tokens that came from the code.

    Parameters
    ----------
    redirect : as the app repeats it; "" if it does not. verifier : of PKCE.

    Returns
    -------
    The tokens, or a refusal, which is not raised because its consequences must be committed.
    """
    found = _locked_grant(session, app, AppGrant.code_hash == hash_of(code))
    unknown = OAuthError("invalid_grant", "the code is unknown, expired or used")
    if found is None:
        return unknown
    grant = found.grant
    if grant.used_at is not None:
        _end_after_reuse(session, found, "code")
        return unknown
    if grant.expires_at < now():
        return unknown
    if redirect and redirect != grant.redirect:
        return OAuthError("invalid_grant", "redirect_uri differs from the authorization request")
    fits = hmac.compare_digest(_challenge_of(verifier), grant.challenge)
    if not fits or not _VERIFIER.fullmatch(verifier):
        return OAuthError("invalid_grant", "code_verifier does not fit code_challenge")
    grant.used_at = now()
    return _issue_tokens(session, found, grant.scopes)


def _challenge_of(verifier: str) -> str:
    digest = hashlib.sha256(verifier.encode("utf-8", "surrogatepass")).digest()
    return base64.urlsafe_b64encode(digest).decode().rstrip("=")


def refresh_tokens(
    session: Session, app: App, secret: str, wanted: Collection[str]
) -> Tokens | OAuthError:
    """Exchange a refresh token for new tokens. A second use ends all tokens of its grant.

    Parameters
    ----------
    wanted : scopes of the new access token, no more than were granted; empty: all.

    Returns
    -------
    As `redeem_code`.
    """
    unknown = OAuthError("invalid_grant", "the refresh token is unknown, expired or used")
    is_it = AppRefreshToken.token_hash == hash_of(secret)
    token = session.scalar(select(AppRefreshToken).where(is_it))
    found = None if token is None else _locked_grant(session, app, AppGrant.id == token.grant_id)
    if token is None or found is None:
        return unknown
    session.refresh(token)  # another request may have used it before the grant was locked
    if token.used_at is not None:
        _end_after_reuse(session, found, "refresh token")
        return unknown
    if found.grant.expires_at < now():
        return unknown
    if not set(wanted) <= set(found.grant.scopes):
        return OAuthError("invalid_scope", "a refresh token gives no further scopes")
    token.used_at = now()
    return _issue_tokens(
        session, found, [s for s in found.grant.scopes if not wanted or s in wanted]
    )


def _locked_grant(session: Session, app: App, named: ColumnElement[bool]) -> _Subject | None:
    """Return a grant of an app, locked so that two requests cannot both use it; None if there is
    none or its owner's account is locked."""
    _lock_connection(session, named)
    row = session.execute(
        select(AppGrant, AppConnection)
        .join(AppConnection, AppConnection.id == AppGrant.connection_id)
        .join(Person, Person.id == AppConnection.person_id)
        .where(named, AppConnection.app_id == app.id, Person.locked_at.is_(None))
        .with_for_update(of=AppGrant)
    ).one_or_none()
    return None if row is None else _Subject(row[0], row[1])


def _lock_connection(session: Session, named: ColumnElement[bool]) -> None:
    """Lock the connection of a grant before the grant, as the deletion of a connection does: two
    transactions that lock both in opposite orders would end each other."""
    ids = select(AppGrant.connection_id).where(named)
    session.execute(select(AppConnection.id).where(AppConnection.id.in_(ids)).with_for_update())


def _issue_tokens(session: Session, found: _Subject, scopes: Collection[str]) -> Tokens:
    grant, connection = found.grant, found.connection
    access, access_hash = new_secret(TOKEN_PREFIX)
    refresh, refresh_hash = new_secret(_REFRESH_PREFIX)
    at = now()
    count_refresh(session, grant.id)
    old = ApiToken.grant_id == grant.id, ApiToken.expires_at < at
    session.execute(delete(ApiToken).where(*old))
    used = AppRefreshToken.grant_id == grant.id, AppRefreshToken.used_at < at - _REUSE_SEEN
    session.execute(delete(AppRefreshToken).where(*used))
    name = session.get_one(App, connection.app_id).name
    session.add(
        ApiToken(
            person_id=connection.person_id,
            name=name,
            token_hash=access_hash,
            scopes=list(scopes),
            expires_at=at + ACCESS_LASTS,
            grant_id=grant.id,
        )
    )
    session.add(AppRefreshToken(grant_id=grant.id, token_hash=refresh_hash))
    grant.expires_at = at + _REFRESH_LASTS
    connection.used_at = at
    return Tokens(access, refresh, tuple(scopes))


def _end_after_reuse(session: Session, found: _Subject, what: str) -> None:
    app = session.get_one(App, found.connection.app_id)
    person = found.connection.person_id
    log_change(session, "app.reuse", person=person, subject=app.name, app=str(app.id), secret=what)
    _end_grant(session, found.grant.id)


def revoke(session: Session, app: App, secret: str) -> None:
    """End a token of an app (RFC 7009): an access token alone, or with a refresh token the whole
    grant. Unknown tokens, and those of other apps, are left alone."""
    kept = hash_of(secret)
    grant = session.scalar(_own_grant(app, AppRefreshToken, kept))
    if grant is not None:
        _lock_connection(session, AppGrant.id == grant)
        _end_grant(session, grant)
    elif session.scalar(_own_grant(app, ApiToken, kept)) is not None:
        session.execute(delete(ApiToken).where(ApiToken.token_hash == kept))


def _own_grant(app: App, kind: type[AppRefreshToken] | type[ApiToken], kept: str) -> Select[UUID]:
    return (
        select(AppGrant.id)
        .join(kind, kind.grant_id == AppGrant.id)
        .join(AppConnection, AppConnection.id == AppGrant.connection_id)
        .where(kind.token_hash == kept, AppConnection.app_id == app.id)
    )


def _end_grant(session: Session, grant: UUID) -> None:
    """Delete a grant with its tokens; the last one takes its connection along."""
    gone = delete(AppGrant).where(AppGrant.id == grant).returning(AppGrant.connection_id)
    connection = session.scalar(gone)
    others = select(AppGrant.id).where(AppGrant.connection_id == connection)
    if connection is not None and session.scalars(others).first() is None:
        session.execute(delete(AppConnection).where(AppConnection.id == connection))
