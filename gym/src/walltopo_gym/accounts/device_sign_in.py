"""Signing in on a second device by a QR code that the first one shows.

The first browser, signed in, shows an *offer*; the second scans it and gets a *claim* and a code of
six digits. The first one shows the same code and asks whether to accept. Then the claim signs in,
once. All of it takes place within two minutes.

The opposite direction (the new device shows the code) is open to QRLjacking (OWASP): an attacker
shows their own code as something else and is signed in as the victim who scans it. Here scanning
alone gives nothing: the first browser must accept, and its question names the other browser. An
offer can be claimed once, so its owner notices a theft.
"""

from __future__ import annotations

import secrets
from datetime import timedelta
from typing import Final
from uuid import UUID

from sqlalchemy import delete, select, update
from sqlalchemy.orm import Session

from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.models import DeviceSignIn
from walltopo_gym.accounts.secrets import hash_of, new_secret
from walltopo_gym.clock import now
from walltopo_gym.errors import NotFoundError, RequestError

_GOOD_FOR: Final = timedelta(minutes=2)


def create_offer(session: Session, person: UUID, sign_in: UUID) -> tuple[DeviceSignIn, str]:
    """Return a new offer of a signed-in person and its secret. It replaces their last offer."""
    old = (DeviceSignIn.person_id == person) | (DeviceSignIn.expires_at < now())
    session.execute(delete(DeviceSignIn).where(old))
    secret, kept = new_secret()
    row = DeviceSignIn(
        person_id=person, sign_in_id=sign_in, offer_hash=kept, expires_at=now() + _GOOD_FOR
    )
    session.add(row)
    session.flush()
    return row, secret


def claim_offer(session: Session, secret: str, browser: str) -> tuple[str, str]:
    """Claim an offer and return the claim's secret and the code to compare.

    Raises
    ------
    RequestError : the offer does not exist, has expired, or is claimed already.
    """
    claimed, kept = new_secret()
    code = f"{secrets.randbelow(1_000_000):06}"
    taken = (
        update(DeviceSignIn)
        .where(
            DeviceSignIn.offer_hash == hash_of(secret),
            DeviceSignIn.claim_hash.is_(None),
            DeviceSignIn.expires_at > now(),
        )
        .values(claim_hash=kept, code=code, browser=browser[:200])
        .returning(DeviceSignIn.id)
    )
    if session.execute(taken).one_or_none() is None:
        raise RequestError("code-used-or-old", "code-new-one")
    return claimed, code


def device_sign_in_of(session: Session, device_sign_in: UUID, sign_in: UUID | None) -> DeviceSignIn:
    """Return the state of an offer to the browser that made it.

    Raises
    ------
    NotFoundError : the offer does not exist, has expired, or has been used.
    """
    row = session.get(DeviceSignIn, device_sign_in)
    if row is None or row.sign_in_id != sign_in or row.expires_at < now():
        raise NotFoundError("code-used-or-old", "make-new-one")
    return row


def accept_claim(session: Session, device_sign_in: UUID, sign_in: UUID | None, code: str) -> None:
    """Accept the browser that claimed the offer and shows this code.

    Raises
    ------
    NotFoundError : as in `device_sign_in_of`; RequestError : the codes differ.
    """
    row = device_sign_in_of(session, device_sign_in, sign_in)
    if not row.code or not secrets.compare_digest(row.code, code):
        raise RequestError("code-other", "code-do-not-let-in")
    row.allowed = True


def use_claim(session: Session, secret: str) -> UUID | None:
    """Return the person of a claim and use the claim up; None until it is accepted.

    Raises
    ------
    RequestError : the claim does not exist or has expired.
    """
    found = select(DeviceSignIn).where(
        DeviceSignIn.claim_hash == hash_of(secret), DeviceSignIn.expires_at > now()
    )
    row = session.scalar(found)
    if row is None:
        raise RequestError("took-too-long", "code-show-new")
    if not row.allowed:
        return None
    gone = (
        delete(DeviceSignIn)
        .where(DeviceSignIn.id == row.id, DeviceSignIn.allowed)
        .returning(DeviceSignIn.id)
    )
    if session.execute(gone).one_or_none() is None:
        raise RequestError("code-used", "code-new-one")
    log_change(session, "person.device_sign_in", person=row.person_id, browser=row.browser)
    return row.person_id
