"""A second factor beside the password: six digits that a program on a phone makes (TOTP, RFC 6238).

By pyotp. Each code is valid once. Codes of the half minutes before and after are accepted, because
clocks differ. Ten single-use recovery codes replace a lost phone. Passkeys need no second factor:
their device verifies its owner.
"""

from __future__ import annotations

import secrets
from typing import Final
from uuid import UUID

import pyotp
from sqlalchemy import delete, func, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.models import Person, RecoveryCode, SecondFactor
from walltopo_gym.accounts.secrets import hash_of
from walltopo_gym.clock import now
from walltopo_gym.errors import ConflictError, RequestError, SignInNeededError

_ISSUER: Final = "walltopo"
_CODES: Final = 10
_STEP_S: Final = 30
_DRIFT: Final = 1  # steps of half a minute to each side


def is_on(session: Session, person: UUID) -> bool:
    """Return whether the person signs in with a second factor."""
    row = _locked_row(session, person)
    return row is not None and row.confirmed_at is not None


def codes_left(session: Session, person: UUID) -> int:
    """Return the number of unused recovery codes."""
    mine = select(func.count()).where(RecoveryCode.person_id == person)
    return session.scalar(mine) or 0


def begin(session: Session, person: Person) -> tuple[str, str]:
    """Return a new secret and its address for a QR code. It takes effect once confirmed.

    Raises
    ------
    ConflictError : a second factor is on already.
    """
    row = _locked_row(session, person.id)
    if row is not None and row.confirmed_at is not None:
        raise ConflictError("second-factor-there", "second-factor-turn-off")
    if row is None:
        row = SecondFactor(person_id=person.id, secret="", last_step=0)
        session.add(row)
    row.secret = pyotp.random_base32()
    session.flush()
    uri = pyotp.TOTP(row.secret).provisioning_uri(name=person.email, issuer_name=_ISSUER)
    return row.secret, uri


def confirm(session: Session, person: UUID, code: str) -> list[str]:
    """Turn the second factor on and return the recovery codes, which are shown once.

    Raises
    ------
    ConflictError : none was begun, or it is on; RequestError : the code is wrong.
    """
    row = _locked_row(session, person)
    if row is None or row.confirmed_at is not None:
        raise ConflictError("second-factor-none")
    if not _is_right(row, code):
        raise RequestError("second-factor-wrong", "second-factor-clock")
    row.confirmed_at = now()
    log_change(session, "second-factor.on", person=person)
    codes = ["-".join(secrets.token_hex(2) for _ in range(4)) for _ in range(_CODES)]
    session.execute(delete(RecoveryCode).where(RecoveryCode.person_id == person))
    session.add_all(RecoveryCode(person_id=person, code_hash=hash_of(c)) for c in codes)
    return codes


def check(session: Session, person: UUID, code: str | None) -> None:
    """Return whether the second factor admits a person whose password was right.

    Raises
    ------
    SignInNeededError : a code is needed, or the given one is wrong.
    """
    row = _locked_row(session, person)
    if row is None or row.confirmed_at is None:
        return
    if code is None:
        raise SignInNeededError("second-factor-needed", "second-factor-type")
    if _is_right(row, code):
        return
    spelled = code.strip().lower()
    used = delete(RecoveryCode).where(
        RecoveryCode.person_id == person, RecoveryCode.code_hash == hash_of(spelled)
    )
    if session.execute(used.returning(RecoveryCode.id)).one_or_none() is None:
        raise SignInNeededError("second-factor-wrong", "second-factor-clock")
    log_change(session, "second-factor.recovery", person=person)


def turn_off(session: Session, person: UUID, *, by: UUID | None) -> None:
    """Turn the second factor off and void its recovery codes.

    Parameters
    ----------
    by : the person, or the operator who does it; None: by command.
    """
    for kind in (SecondFactor, RecoveryCode):
        session.execute(delete(kind).where(kind.person_id == person))
    log_change(session, "second-factor.off", person=by, subject=str(person))


def _locked_row(session: Session, person: UUID) -> SecondFactor | None:
    """Return the row, locked until the transaction ends, so that a code cannot be used twice."""
    mine = select(SecondFactor).where(SecondFactor.person_id == person)
    return session.scalar(mine.with_for_update())


def _is_right(row: SecondFactor, code: str) -> bool:
    """Return whether the code is of this half minute or a neighbouring one, and newer than the
    last."""
    totp = pyotp.TOTP(row.secret)
    typed = "".join(code.split())
    step = int(now().timestamp()) // _STEP_S
    for each in range(step - _DRIFT, step + _DRIFT + 1):
        # All steps are compared, so that the duration reveals nothing.
        if each > row.last_step and secrets.compare_digest(
            totp.generate_otp(each).encode(), typed.encode("utf-8", "surrogatepass")
        ):
            row.last_step = each
            return True
    return False
