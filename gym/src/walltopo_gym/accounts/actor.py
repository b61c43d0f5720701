"""Who asks: a browser with a cookie, a program with a token, or nobody that is known."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import timedelta
from enum import StrEnum
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.models import ApiToken, Person, SignIn
from walltopo_gym.accounts.secrets import hash_of, new_secret
from walltopo_gym.clock import now
from walltopo_gym.errors import SignInNeededError

TOKEN_PREFIX = "wtg_"  # lets scanners of leaked secrets know it


class Scope(StrEnum):
    """What a token may be used for; a browser may do all that its person may."""

    READ = "read"
    UPLOAD = "upload"
    PUBLISH = "publish"
    MANAGE = "manage"


@dataclass(frozen=True)
class Actor:
    """Who asks.

    Parameters
    ----------
    person : None for nobody that is known.
    operator : whether they may do what concerns the whole server.
    sign_in : the browser's sign-in; None for a token.
    scopes : of the token; None for a browser, which has no limits.
    """

    person: UUID | None = None
    operator: bool = False
    sign_in: UUID | None = None
    scopes: frozenset[str] | None = None

    @property
    def known(self) -> UUID:
        """The person.

        Raises
        ------
        SignInNeededError : nobody is signed in.
        """
        if self.person is None:
            raise SignInNeededError("nobody is signed in", "Sign in first.")
        return self.person


NOBODY = Actor()


def by_cookie(session: Session, secret: str) -> Actor:
    """Whoever signed in in this browser; nobody where that has ended."""
    row = session.execute(
        select(SignIn.id, Person.id, Person.operator)
        .join(Person, Person.id == SignIn.person_id)
        .where(SignIn.token_hash == hash_of(secret), SignIn.expires_at > now())
    ).one_or_none()
    return NOBODY if row is None else Actor(row[1], row[2], sign_in=row[0])


def by_token(session: Session, secret: str) -> Actor:
    """Whoever made this token.

    Raises
    ------
    SignInNeededError : there is no such token, or it has expired.
    """
    row = session.execute(
        select(ApiToken.scopes, Person.id, Person.operator)
        .join(Person, Person.id == ApiToken.person_id)
        .where(ApiToken.token_hash == hash_of(secret), ApiToken.expires_at > now())
    ).one_or_none()
    if row is None:
        raise SignInNeededError("this token is not known, or it has expired", "Make a new one.")
    return Actor(row[1], row[2], scopes=frozenset(row[0]))


def sign_in(session: Session, person: UUID, browser: str, days: int) -> str:
    """Begin a sign-in; the secret for the cookie."""
    secret, kept = new_secret()
    expires = now() + timedelta(days=days)
    session.add(
        SignIn(person_id=person, token_hash=kept, expires_at=expires, browser=browser[:200])
    )
    return secret
