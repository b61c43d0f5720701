"""Signing in on a second device by a QR code that the first one shows.

The first browser, signed in, shows an *offer*; the second scans it and gets a *claim* and a code of
six digits for it; the first one shows the same code and is asked whether to let it in; then the
claim signs in, once. All of it within two minutes.

The other way round (the device that wants in shows the code) is what QRLjacking is made of (OWASP):
somebody's own code, shown to others as something else, signs them in as whoever scans it. Here
scanning gives nothing: without a yes in the first browser an offer that was photographed or sent on
is worth nothing, and who is asked sees which browser it is. An offer is claimed once, so that its
owner notices who was faster.
"""

from __future__ import annotations

import secrets
from datetime import timedelta
from typing import Final
from uuid import UUID

from sqlalchemy import delete, select, update
from sqlalchemy.orm import Session

from walltopo.core import InputError
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.models import Handover
from walltopo_gym.accounts.secrets import hash_of, new_secret
from walltopo_gym.clock import now
from walltopo_gym.errors import NotFoundError

_GOOD_FOR: Final = timedelta(minutes=2)


def offer(session: Session, person: UUID, sign_in: UUID) -> tuple[Handover, str]:
    """A new offer of somebody who is signed in, and its secret; their last one ends by it."""
    old = (Handover.person_id == person) | (Handover.expires_at < now())
    session.execute(delete(Handover).where(old))
    secret, kept = new_secret()
    row = Handover(
        person_id=person, sign_in_id=sign_in, offer_hash=kept, expires_at=now() + _GOOD_FOR
    )
    session.add(row)
    session.flush()
    return row, secret


def claim(session: Session, secret: str, browser: str) -> tuple[str, str]:
    """Take an offer up: the secret of the claim, and the code to compare.

    Raises
    ------
    InputError : there is no such offer, it is too old, or somebody took it up already.
    """
    claimed, kept = new_secret()
    code = f"{secrets.randbelow(1_000_000):06}"
    taken = (
        update(Handover)
        .where(
            Handover.offer_hash == hash_of(secret),
            Handover.claim_hash.is_(None),
            Handover.expires_at > now(),
        )
        .values(claim_hash=kept, code=code, browser=browser[:200])
        .returning(Handover.id)
    )
    if session.execute(taken).one_or_none() is None:
        raise InputError("this code was used or is too old", "Let the other device show a new one.")
    return claimed, code


def handover_of(session: Session, handover: UUID, sign_in: UUID | None) -> Handover:
    """How far one's own offer is, in the browser that made it.

    Raises
    ------
    NotFoundError : there is none, it is too old, or it has been used.
    """
    row = session.get(Handover, handover)
    if row is None or row.sign_in_id != sign_in or row.expires_at < now():
        raise NotFoundError("this code was used or is too old", "Make a new one.")
    return row


def allow(session: Session, handover: UUID, sign_in: UUID | None, code: str) -> None:
    """Let the browser in that took the offer up and shows this code.

    Raises
    ------
    NotFoundError : as in `handover_of`; InputError : that browser shows another code.
    """
    row = handover_of(session, handover, sign_in)
    if not row.code or not secrets.compare_digest(row.code, code):
        raise InputError("the other device shows another code", "Do not let it in.")
    row.allowed = True


def finish(session: Session, secret: str) -> UUID | None:
    """Who signs in by this claim, which is good no more; None while they have not been let in.

    Raises
    ------
    InputError : there is no such claim, or it is too old.
    """
    found = select(Handover).where(
        Handover.claim_hash == hash_of(secret), Handover.expires_at > now()
    )
    row = session.scalar(found)
    if row is None:
        raise InputError("this took too long", "Let the other device show a new code.")
    if not row.allowed:
        return None
    gone = delete(Handover).where(Handover.id == row.id, Handover.allowed).returning(Handover.id)
    if session.execute(gone).one_or_none() is None:
        raise InputError("this code was used", "Let the other device show a new one.")
    log_change(session, "person.handover", person=row.person_id, browser=row.browser)
    return row.person_id
