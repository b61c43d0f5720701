"""How often something may be tried: counted in the database, so over all servers."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from datetime import timedelta
from typing import Final

from sqlalchemy import delete, func, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.models import Try
from walltopo_gym.clock import now
from walltopo_gym.errors import TooManyError

__all__ = ["MAILS_PER_ADDRESS", "MAILS_PER_CLIENT", "SIGN_INS_PER_ACCOUNT", "SIGN_INS_PER_CLIENT",
           "Limit", "count_try"]  # fmt: skip

_KEPT: Final = timedelta(days=1)


@dataclass(frozen=True)
class Limit:
    """At most `most` tries within `seconds`."""

    name: str
    most: int
    seconds: int


SIGN_INS_PER_ACCOUNT: Final = Limit("sign-in-account", 10, 900)
# A whole gym may sit behind one address.
SIGN_INS_PER_CLIENT: Final = Limit("sign-in-client", 100, 900)
MAILS_PER_ADDRESS: Final = Limit("mail-address", 3, 3600)
MAILS_PER_CLIENT: Final = Limit("mail-client", 30, 3600)


def count_try(session: Session, limit: Limit, subject: str) -> None:
    """Count one try of `subject` (an account, a client's address); in a transaction of its own.

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
