"""Limits on attempts, counted in the database and so across all servers."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from datetime import timedelta
from typing import Final
from uuid import UUID

from sqlalchemy import delete, func, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.mails import Kind
from walltopo_gym.accounts.models import Try
from walltopo_gym.clock import now
from walltopo_gym.database.engine import take_turn
from walltopo_gym.errors import TooManyError

_KEPT: Final = timedelta(days=1)


@dataclass(frozen=True)
class Limit:
    """At most `most` attempts within `seconds`."""

    name: str
    most: int
    seconds: int


# Attempts on one account: in a browser that its owner signed in with before, in other browsers of
# one network, and in all other browsers. The last limit does not lock known browsers out.
_KNOWN: Final = Limit("sign-in-known", 10, 900)
_NETWORK: Final = Limit("sign-in-account-network", 10, 900)
_ELSEWHERE: Final = Limit("sign-in-account", 100, 900)
# Attempts on all accounts together; a whole gym may sit behind one address.
_CLIENT: Final = Limit("sign-in-client", 100, 900)
_OLD_PASSWORD: Final = Limit("old-password", 10, 900)
_REPORTS: Final = Limit("report", 30, 86400)
_HOLD_REPORTS: Final = Limit("hold-report", 30, 86400)
_PROBLEMS: Final = Limit("problem", 60, 86400)
_LISTS: Final = Limit("list", 60, 86400)
_CLIPS: Final = Limit("clip", 20, 86400)
_ESTIMATES: Final = Limit("problem-estimate", 300, 3600)
_DOCUMENTS: Final = Limit("document", 120, 3600)
_CODE: Final = Limit("second-factor", 10, 900)
_JUDGE_LINKS: Final = Limit("judge-link", 100, 900)
_JUDGE_NAMES: Final = Limit("judge-name", 30, 3600)
_REPLAYS: Final = Limit("webhook-replay", 120, 3600)
_APPS: Final = Limit("app", 30, 86400)
# An app needs one an hour.
_REFRESHES: Final = Limit("app-refresh", 60, 3600)
_AUTHORIZATIONS: Final = Limit("app-authorization", 60, 3600)
# The server of an app refreshes the tokens of all of its people from one network.
_APP_TOKENS: Final = Limit("app-token", 2000, 900)
# Each kind of mail has its own limit: requests for one kind do not block another.
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
    """Count an attempt to sign in, in a transaction of its own.

    Parameters
    ----------
    known : the mark of a browser in which the account's owner has signed in before.

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
    """Count an attempt at the old password of a signed-in person."""
    _count_try(session, _OLD_PASSWORD, str(person))


def count_report(session: Session, person: UUID) -> None:
    """Count a report of a comment."""
    _count_try(session, _REPORTS, str(person))


def count_hold_report(session: Session, person: UUID) -> None:
    """Count a report of a hold."""
    _count_try(session, _HOLD_REPORTS, str(person))


def count_problem(session: Session, person: UUID) -> None:
    """Count a new problem."""
    _count_try(session, _PROBLEMS, str(person))


def count_list(session: Session, person: UUID) -> None:
    """Count a new list."""
    _count_try(session, _LISTS, str(person))


def count_clip(session: Session, person: UUID) -> None:
    """Count a new clip of an attempt."""
    _count_try(session, _CLIPS, str(person))


def count_estimate(session: Session, person: UUID) -> None:
    """Count an estimate of a problem."""
    _count_try(session, _ESTIMATES, str(person))


def count_document(session: Session, person: UUID) -> None:
    """Count a generated document."""
    _count_try(session, _DOCUMENTS, str(person))


def count_code(session: Session, person: UUID) -> None:
    """Count an attempt at the second factor after the right password."""
    _count_try(session, _CODE, str(person))


def count_refresh(session: Session, grant: UUID) -> None:
    """Count new tokens of an app's grant."""
    _count_try(session, _REFRESHES, str(grant))


def count_judge_name(session: Session, link: UUID, network: str) -> None:
    """Count a new judge of a link from a network."""
    _count_try(session, _JUDGE_NAMES, f"{link} {network}")


def count_wrong_judge_link(session: Session, network: str) -> None:
    """Count an attempt to open a judge's link that does not exist."""
    _count_try(session, _JUDGE_LINKS, network)


def count_replay(session: Session, gym: UUID) -> None:
    """Count a message to a webhook that is sent again."""
    _count_try(session, _REPLAYS, str(gym))


def count_app(session: Session, person: UUID) -> None:
    """Count a registration of an app."""
    _count_try(session, _APPS, str(person))


def count_authorization(session: Session, person: UUID) -> None:
    """Count a consent to an app."""
    _count_try(session, _AUTHORIZATIONS, str(person))


def count_app_token(session: Session, network: str) -> None:
    """Count a request for an app's tokens."""
    _count_try(session, _APP_TOKENS, network)


def count_mail(session: Session, kind: Kind, email: str, network: str, known: str | None) -> None:
    """Count a requested mail.

    Parameters
    ----------
    known : as in `count_sign_in`; requests of others do not block such a browser.
    """
    if known is not None:
        _count_try(session, Limit(f"mail-{kind}-known", _MAILS_KNOWN, 3600), known)
        return
    _count_try(session, _MAILS_FROM[kind], network)
    _count_try(session, Limit(f"mail-{kind}-network", _MAILS_TO_FROM, 3600), f"{email} {network}")
    _count_try(session, Limit(f"mail-{kind}", _MAILS_TO[kind], 3600), email)


def _count_try(session: Session, limit: Limit, subject: str) -> None:
    """Count one attempt of `subject` (an account, a network), one transaction after the other.

    Raises
    ------
    TooManyError : the limit is reached; the attempt is not counted, so that waiting helps.
    """
    key = hashlib.sha256(f"{limit.name} {subject}".encode()).hexdigest()
    start = now() - timedelta(seconds=limit.seconds)
    # Rows that another transaction is deleting are skipped: waiting for it with turns taken could
    # be waiting for each other.
    old = select(Try.id).where(Try.at < now() - _KEPT).with_for_update(skip_locked=True)
    session.execute(delete(Try).where(Try.id.in_(old)))
    take_turn(session, key)
    seen = select(func.count()).select_from(Try).where(Try.key == key, Try.at > start)
    if (session.scalar(seen) or 0) >= limit.most:
        raise TooManyError("tried-too-often", limit.seconds)
    session.add(Try(key=key, at=now()))
