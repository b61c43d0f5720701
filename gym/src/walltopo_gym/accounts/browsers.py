"""Browsers in which somebody signed in before.

Who guesses passwords from elsewhere uses up the tries of elsewhere, not those of the account's
owner in their own browser. Source: OWASP, "Slow Down Online Guessing Attacks with Device Cookies".
"""

from __future__ import annotations

from datetime import timedelta
from typing import Final
from uuid import UUID

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.models import KnownBrowser
from walltopo_gym.accounts.secrets import hash_of, new_secret
from walltopo_gym.clock import now

KNOWN_DAYS: Final = 400  # the longest that browsers keep a cookie (RFC 6265bis, 5.5)


def remember(session: Session, person: UUID) -> str:
    """The secret by which this browser is known from now on."""
    secret, kept = new_secret()
    session.execute(delete(KnownBrowser).where(KnownBrowser.expires_at < now()))
    expires = now() + timedelta(days=KNOWN_DAYS)
    session.add(KnownBrowser(person_id=person, token_hash=kept, expires_at=expires))
    return secret


def is_known(session: Session, person: UUID, secret: str) -> bool:
    """Whether this person signed in in the browser that has this secret."""
    found = select(KnownBrowser.id).where(
        KnownBrowser.person_id == person,
        KnownBrowser.token_hash == hash_of(secret),
        KnownBrowser.expires_at > now(),
    )
    return session.scalar(found) is not None
