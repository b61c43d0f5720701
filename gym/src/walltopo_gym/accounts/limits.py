"""How often something may be tried: counted in the database, so over all servers."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from datetime import timedelta
from typing import Final
from uuid import UUID

from sqlalchemy import delete, func, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.mailed_links import Kind
from walltopo_gym.accounts.models import Try
from walltopo_gym.clock import now
from walltopo_gym.errors import TooManyError

_KEPT: Final = timedelta(days=1)


@dataclass(frozen=True)
class Limit:
    """At most `most` tries within `seconds`."""

    name: str
    most: int
    seconds: int


# Of one account: in a browser that its owner signed in with before, from one network elsewhere,
# and from everywhere else together. The last one shuts out no browser that is known.
_KNOWN: Final = Limit("sign-in-known", 10, 900)
_NETWORK: Final = Limit("sign-in-account-network", 10, 900)
_ELSEWHERE: Final = Limit("sign-in-account", 100, 900)
# Of all accounts together; a whole gym may sit behind one address.
_CLIENT: Final = Limit("sign-in-client", 100, 900)
_OLD_PASSWORD: Final = Limit("old-password", 10, 900)
_REPORTS: Final = Limit("report", 30, 86400)
_DOCUMENTS: Final = Limit("document", 120, 3600)
_CODE: Final = Limit("second-factor", 10, 900)
# Of mails, each kind by itself: mails of one kind that others ask for block no mail of another.
# A whole hall may sign up behind one address; resets are few.
_MAILS_FROM: Final = {
    "sign-up": Limit("mail-sign-up-client", 60, 3600),
    "reset": Limit("mail-reset-client", 30, 3600),
}
# To one address: from one network, and from everywhere together.
_MAILS_TO_FROM: Final = 3
_MAILS_TO: Final = {"sign-up": 3, "reset": 10}
_MAILS_KNOWN: Final = 5  # in a browser that the account's owner signed in with before


def count_sign_in(session: Session, email: str, network: str, known: str | None) -> None:
    """Count a try to sign in; in a transaction of its own.

    Parameters
    ----------
    known : what a browser is known by in which this account's owner signed in before.

    Raises
    ------
    TooManyError : as in `_count_try`.
    """
    if known is not None:
        _count_try(session, _KNOWN, known)
        return
    _count_try(session, _CLIENT, network)
    _count_try(session, _NETWORK, f"{email} {network}")
    _count_try(session, _ELSEWHERE, email)


def count_old_password(session: Session, person: UUID) -> None:
    """Count a try at the old password of somebody who is signed in, likewise."""
    _count_try(session, _OLD_PASSWORD, str(person))


def count_report(session: Session, person: UUID) -> None:
    """Count a comment that somebody reports, likewise."""
    _count_try(session, _REPORTS, str(person))


def count_document(session: Session, person: UUID) -> None:
    """Count a document that somebody has made, likewise."""
    _count_try(session, _DOCUMENTS, str(person))


def count_code(session: Session, person: UUID) -> None:
    """Count a try at the second factor of somebody whose password was right, likewise."""
    _count_try(session, _CODE, str(person))


def count_mail(session: Session, kind: Kind, email: str, network: str, known: str | None) -> None:
    """Count a mail that somebody asked for, likewise.

    Parameters
    ----------
    known : as in `count_sign_in`; such a browser is not blocked by what others ask for.
    """
    if known is not None:
        _count_try(session, Limit(f"mail-{kind}-known", _MAILS_KNOWN, 3600), known)
        return
    _count_try(session, _MAILS_FROM[kind], network)
    _count_try(session, Limit(f"mail-{kind}-network", _MAILS_TO_FROM, 3600), f"{email} {network}")
    _count_try(session, Limit(f"mail-{kind}", _MAILS_TO[kind], 3600), email)


def _count_try(session: Session, limit: Limit, subject: str) -> None:
    """Count one try of `subject` (an account, a network).

    Raises
    ------
    TooManyError : the limit is reached; the try is not counted, so that waiting helps.
    """
    key = hashlib.sha256(f"{limit.name} {subject}".encode()).hexdigest()
    start = now() - timedelta(seconds=limit.seconds)
    session.execute(delete(Try).where(Try.at < now() - _KEPT))
    seen = select(func.count()).select_from(Try).where(Try.key == key, Try.at > start)
    if (session.scalar(seen) or 0) >= limit.most:
        raise TooManyError("tried too often", limit.seconds)
    session.add(Try(key=key, at=now()))
