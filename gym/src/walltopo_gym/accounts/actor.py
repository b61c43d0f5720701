"""The actor of a request: a browser with a cookie, a program with a token, or anonymous."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta
from enum import StrEnum
from typing import Final
from uuid import UUID

from sqlalchemy import delete, or_, select
from sqlalchemy.orm import Session, aliased

from walltopo_gym.accounts.models import (
    ApiToken,
    App,
    AppConnection,
    AppGrant,
    KnownBrowser,
    Person,
    SignIn,
)
from walltopo_gym.accounts.secrets import hash_of, new_secret
from walltopo_gym.clock import now
from walltopo_gym.errors import ForbiddenError, SignInNeededError

TOKEN_PREFIX = "wtg_"  # lets scanners of leaked secrets know it


class Scope(StrEnum):
    """Scopes of a token. A browser may do everything that its person may."""

    READ = "read"
    UPLOAD = "upload"
    PUBLISH = "publish"
    MANAGE = "manage"


@dataclass(frozen=True)
class Actor:
    """The actor of a request.

    Parameters
    ----------
    person : None if anonymous.
    operator : whether the actor may administer the whole server.
    sign_in : the browser's sign-in; None for a token. confirmed_at : when its owner last proved who
        they are.
    scopes : scopes of the token; None for a browser, which has no limits.
    """

    person: UUID | None = None
    operator: bool = False
    sign_in: UUID | None = None
    confirmed_at: datetime | None = None
    scopes: frozenset[str] | None = None

    @property
    def known(self) -> UUID:
        """Return the person.

        Raises
        ------
        SignInNeededError : nobody is signed in.
        """
        if self.person is None:
            raise SignInNeededError("sign-in-needed", "sign-in-first")
        return self.person


NOBODY = Actor()


def by_cookie(session: Session, secret: str) -> Actor:
    """Return the actor of a browser's session; anonymous after the session has ended."""
    row = session.execute(
        select(SignIn.id, SignIn.confirmed_at, Person.id, Person.operator)
        .join(Person, Person.id == SignIn.person_id)
        .where(SignIn.token_hash == hash_of(secret), SignIn.expires_at > now())
        .where(Person.locked_at.is_(None))
    ).one_or_none()
    if row is None:
        return NOBODY
    return Actor(row[2], row[3], sign_in=row[0], confirmed_at=row[1])


def by_token(session: Session, secret: str) -> Actor:
    """Return the actor of a token.

    Raises
    ------
    SignInNeededError : the token does not exist or has expired, or it is an app's whose maker's
        account is locked.
    """
    maker = aliased(Person)
    of_locked_makers = (
        select(AppGrant.id)
        .join(AppConnection, AppConnection.id == AppGrant.connection_id)
        .join(App, App.id == AppConnection.app_id)
        .join(maker, maker.id == App.person_id)
        .where(maker.locked_at.is_not(None))
    )
    row = session.execute(
        select(ApiToken.scopes, Person.id, Person.operator)
        .join(Person, Person.id == ApiToken.person_id)
        .where(ApiToken.token_hash == hash_of(secret), ApiToken.expires_at > now())
        .where(Person.locked_at.is_(None))
        .where(or_(ApiToken.grant_id.is_(None), ApiToken.grant_id.not_in(of_locked_makers)))
    ).one_or_none()
    if row is None:
        raise SignInNeededError("token-unknown", "make-new-one")
    return Actor(row[1], row[2], scopes=frozenset(row[0]))


def sign_in(
    session: Session, person: UUID, browser: str, days: int, *, confirmed: bool = True
) -> str:
    """Begin a sign-in and return the secret for its cookie.

    Parameters
    ----------
    confirmed : whether the person proved who they are.

    Raises
    ------
    ForbiddenError : the account is locked.
    """
    # Held until the transaction ends: a lock either comes before this sign-in or ends it.
    row = select(Person.locked_at).where(Person.id == person).with_for_update(key_share=True)
    if session.scalar(row) is not None:
        raise ForbiddenError("account-locked", "ask-operator")
    secret, kept = new_secret()
    expires = now() + timedelta(days=days)
    session.add(
        SignIn(
            person_id=person,
            token_hash=kept,
            expires_at=expires,
            browser=browser[:200],
            confirmed_at=now() if confirmed else None,
        )
    )
    return secret


KNOWN_DAYS: Final = 400  # the longest that browsers keep a cookie (RFC 6265bis, 5.5)


def recognise_browser(session: Session, person: UUID) -> str:
    """Return a new secret by which the server recognises this browser."""
    secret, kept = new_secret()
    session.execute(delete(KnownBrowser).where(KnownBrowser.expires_at < now()))
    expires = now() + timedelta(days=KNOWN_DAYS)
    session.add(KnownBrowser(person_id=person, token_hash=kept, expires_at=expires))
    return secret


def is_known(session: Session, person: UUID, secret: str) -> bool:
    """Return whether this person has signed in before in the browser with this secret."""
    found = select(KnownBrowser.id).where(
        KnownBrowser.person_id == person,
        KnownBrowser.token_hash == hash_of(secret),
        KnownBrowser.expires_at > now(),
    )
    return session.scalar(found) is not None
