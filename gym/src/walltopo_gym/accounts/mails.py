"""Mailed links and the mails around them. The holder of a link reads the mail of its address."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import timedelta
from functools import cache
from importlib.resources import files
from typing import Final, Literal

import msgspec
from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.models import MailedLink
from walltopo_gym.accounts.people import find_person
from walltopo_gym.accounts.secrets import hash_of, new_secret
from walltopo_gym.api.services import Services
from walltopo_gym.clock import now
from walltopo_gym.errors import RequestError
from walltopo_gym.languages import Language
from walltopo_gym.mail import Mail

Kind = Literal["sign-up", "reset"]

_GOOD_FOR: Final = {"sign-up": timedelta(days=1), "reset": timedelta(hours=1)}


def new_link(session: Session, kind: Kind, email: str) -> str:
    """Return the secret of a new link."""
    secret, kept = new_secret()
    expires = now() + _GOOD_FOR[kind]
    session.execute(delete(MailedLink).where(MailedLink.expires_at < now()))
    session.add(MailedLink(kind=kind, email=email, token_hash=kept, expires_at=expires))
    return secret


def email_of_link(session: Session, kind: Kind, secret: str) -> str:
    """Return the mail address of a link.

    Raises
    ------
    RequestError : the link does not exist, was used, or has expired.
    """
    email = session.scalar(
        select(MailedLink.email).where(
            MailedLink.token_hash == hash_of(secret),
            MailedLink.kind == kind,
            MailedLink.expires_at > now(),
        )
    )
    if email is None:
        raise RequestError("link-used-or-old", "ask-for-new")
    return email


def use_link(session: Session, kind: Kind, secret: str) -> str:
    """Return the mail address of a link, and void all links of this kind to that address.

    Raises
    ------
    RequestError : as `email_of_link`.
    """
    email = email_of_link(session, kind, secret)
    session.execute(delete(MailedLink).where(MailedLink.kind == kind, MailedLink.email == email))
    return email


def requested_mail(session: Session, kind: Kind, to: str, base: str, language: Language) -> Mail:
    """Return the mail that answers a request for a link: with the link, or with the reason.

    Parameters
    ----------
    base : the server's address, without a trailing slash.
    """
    words = mail_templates()[language]
    match kind, find_person(session, to) is not None:
        case "sign-up", False:
            name, path = "sign-up", f"sign-up#{new_link(session, kind, to)}"
        case "sign-up", True:
            name, path = "sign-up-known", "sign-in"
        case "reset", True:
            name, path = "reset", f"new-password#{new_link(session, kind, to)}"
        case _:
            name, path = "reset-unknown", "sign-up"
    text = f"{words[name]['text']}\n\n{base}/{path}\n\n{words['unasked']['text']}\n"
    return Mail(to, words[name]["subject"], text)


@cache
def mail_templates() -> Mapping[Language, Mapping[str, Mapping[str, str]]]:
    """Return subject and text of each mail by language and name."""
    content = files("walltopo_gym.accounts").joinpath("mail_templates.json").read_bytes()
    return msgspec.json.decode(content, type=dict[Language, dict[str, dict[str, str]]])


def mail_link(services: Services, kind: Kind, email: str, language: Language) -> None:
    """Send the link after the response, so that response times do not reveal accounts."""
    with services.database.writing() as session:
        mail = requested_mail(session, kind, email, services.settings.link_base, language)
    services.mailer.send(mail)
