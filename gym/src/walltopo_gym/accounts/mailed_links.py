"""Links by mail: whoever has one reads the mail of its address."""

from __future__ import annotations

from datetime import timedelta
from typing import Final, Literal

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from walltopo.core import InputError
from walltopo_gym.accounts.models import MailedLink
from walltopo_gym.accounts.secrets import hash_of, new_secret
from walltopo_gym.clock import now

Kind = Literal["sign-up", "reset"]
_GOOD_FOR: Final = {"sign-up": timedelta(days=1), "reset": timedelta(hours=1)}


def new_link(session: Session, kind: Kind, email: str) -> str:
    """The secret of a new link."""
    secret, kept = new_secret()
    expires = now() + _GOOD_FOR[kind]
    session.execute(delete(MailedLink).where(MailedLink.expires_at < now()))
    session.add(MailedLink(kind=kind, email=email, token_hash=kept, expires_at=expires))
    return secret


def use_link(session: Session, kind: Kind, secret: str) -> str:
    """The address that the link was mailed to; it and its like are good no more.

    Raises
    ------
    InputError : there is no such link, it was used, or it is too old.
    """
    link = session.scalar(
        select(MailedLink).where(
            MailedLink.token_hash == hash_of(secret),
            MailedLink.kind == kind,
            MailedLink.expires_at > now(),
        )
    )
    if link is None:
        raise InputError("this link was used or is too old", "Ask for a new one.")
    session.execute(
        delete(MailedLink).where(MailedLink.kind == kind, MailedLink.email == link.email)
    )
    return link.email
