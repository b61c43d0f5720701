"""A second factor beside the password: six digits that a program on a phone makes (TOTP, RFC 6238).

By pyotp. Each code is good once, also within its half minute; a code of the half minute before or
after is taken, for clocks differ. Whoever has lost the phone uses one of ten recovery codes, each
good once. A passkey needs none: its device knows its owner already.
"""

from __future__ import annotations

import secrets
from typing import Final
from uuid import UUID

import pyotp
from sqlalchemy import delete, func, select
from sqlalchemy.orm import Session

from walltopo.core import InputError
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.models import Person, RecoveryCode, SecondFactor
from walltopo_gym.accounts.secrets import hash_of
from walltopo_gym.clock import now
from walltopo_gym.errors import ConflictError, SignInNeededError

_ISSUER: Final = "walltopo"
_CODES: Final = 10
_STEP_S: Final = 30
_DRIFT: Final = 1  # steps of half a minute to each side


def is_on(session: Session, person: UUID) -> bool:
    """Whether the person signs in with a second factor."""
    row = _row(session, person)
    return row is not None and row.confirmed_at is not None


def codes_left(session: Session, person: UUID) -> int:
    """How many recovery codes were not used yet."""
    mine = select(func.count()).where(RecoveryCode.person_id == person)
    return session.scalar(mine) or 0


def begin(session: Session, person: Person) -> tuple[str, str]:
    """A new secret for a phone, and the same as an address for a QR code; not yet asked for.

    Raises
    ------
    ConflictError : there is a second factor already.
    """
    row = _row(session, person.id)
    if row is not None and row.confirmed_at is not None:
        raise ConflictError("there is a second factor already", "Turn it off first.")
    if row is None:
        row = SecondFactor(person_id=person.id, secret="", last_step=0)
        session.add(row)
    row.secret = pyotp.random_base32()
    session.flush()
    uri = pyotp.TOTP(row.secret).provisioning_uri(name=person.email, issuer_name=_ISSUER)
    return row.secret, uri


def confirm(session: Session, person: UUID, code: str) -> list[str]:
    """Ask for it from now on; the recovery codes, which are shown this once.

    Raises
    ------
    ConflictError : none was begun, or it is on; InputError : the code is not of its secret.
    """
    row = _row(session, person)
    if row is None or row.confirmed_at is not None:
        raise ConflictError("no second factor was begun")
    if not _is_right(row, code):
        raise InputError("these digits are not right", "Is the phone's clock right?")
    row.confirmed_at = now()
    log_change(session, "second-factor.on", person=person)
    codes = ["-".join(secrets.token_hex(2) for _ in range(4)) for _ in range(_CODES)]
    session.execute(delete(RecoveryCode).where(RecoveryCode.person_id == person))
    session.add_all(RecoveryCode(person_id=person, code_hash=hash_of(c)) for c in codes)
    return codes


def check(session: Session, person: UUID, code: str | None) -> None:
    """Whether somebody whose password was right may come in.

    Raises
    ------
    SignInNeededError : a second factor is needed, or the code is none that is good.
    """
    row = _row(session, person)
    if row is None or row.confirmed_at is None:
        return
    if code is None:
        raise SignInNeededError("the second factor is needed", "Type the digits of your phone.")
    if _is_right(row, code):
        return
    spelled = code.strip().lower()
    used = delete(RecoveryCode).where(
        RecoveryCode.person_id == person, RecoveryCode.code_hash == hash_of(spelled)
    )
    if session.execute(used.returning(RecoveryCode.id)).one_or_none() is None:
        raise SignInNeededError("these digits are not right", "Is the phone's clock right?")
    log_change(session, "second-factor.recovery", person=person)


def end(session: Session, person: UUID) -> None:
    """Ask for it no more; its recovery codes are good no more."""
    for kind in (SecondFactor, RecoveryCode):
        session.execute(delete(kind).where(kind.person_id == person))
    log_change(session, "second-factor.off", person=person)


def _row(session: Session, person: UUID) -> SecondFactor | None:
    """Held until the transaction ends, so that two cannot use one code."""
    mine = select(SecondFactor).where(SecondFactor.person_id == person)
    return session.scalar(mine.with_for_update())


def _is_right(row: SecondFactor, code: str) -> bool:
    """Whether the code is of this half minute or one beside it, and later than the last one."""
    totp = pyotp.TOTP(row.secret)
    typed = "".join(code.split())
    step = int(now().timestamp()) // _STEP_S
    for each in range(step - _DRIFT, step + _DRIFT + 1):
        # Of all steps: how long it takes tells nothing.
        if each > row.last_step and secrets.compare_digest(
            totp.generate_otp(each).encode(), typed.encode("utf-8", "surrogatepass")
        ):
            row.last_step = each
            return True
    return False
