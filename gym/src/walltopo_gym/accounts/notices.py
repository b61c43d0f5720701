"""Mails to the owner of an account about changes of how it can be entered, and about what an
operator does with it."""

from __future__ import annotations

from typing import Annotated, Final, Literal
from uuid import UUID

from fastapi import BackgroundTasks, Depends, Request
from sqlalchemy.orm import Session

from walltopo_gym.accounts.mails import mail_templates
from walltopo_gym.accounts.models import Person
from walltopo_gym.api.services import ServicesOf
from walltopo_gym.languages import LANGUAGES, Language
from walltopo_gym.mail import Mail
from walltopo_gym.settings import GymSettings

Change = Literal[
    "passkey-added",
    "passkey-removed",
    "second-factor-on",
    "second-factor-off",
    "token-added",
    "token-removed",
    "app-connected",
    "password-changed",
    "account-deleted",
    "account-locked",
    "account-unlocked",
    "signed-out",
    "second-factor-reset",
    "data-exported",
]
# After these a new password is no remedy.
_WITHOUT_REMEDY: Final[frozenset[Change]] = frozenset(
    {"account-deleted", "account-locked", "account-unlocked", "data-exported"}
)


class _Notifier:
    """Mails an owner after the response of one request."""

    def __init__(self, request: Request, services: ServicesOf, later: BackgroundTasks) -> None:
        self._request, self._services, self._later = request, services, later

    def __call__(self, session: Session, person: UUID, change: Change, name: str = "") -> None:
        """Mail a person about a change.

        Parameters
        ----------
        name : of the passkey, token or app, as its maker wrote it.
        """
        to = session.get_one(Person, person).email
        mail = notice(self._services.settings, to, change, _browser_language(self._request), name)
        self._later.add_task(self._services.mailer.send, mail)


NotifyOwner = Annotated[_Notifier, Depends(_Notifier)]


def notice(
    settings: GymSettings, to: str, change: Change, language: Language, name: str = ""
) -> Mail:
    """Return the mail about a change.

    Parameters
    ----------
    to : the owner's address; name : of the passkey, token or app, as its maker wrote it.
    """
    templates = mail_templates()[language]
    lines = [templates[change]["text"].replace("{name}", name)]
    if change not in _WITHOUT_REMEDY:
        lines += [templates["changed"]["text"], f"{settings.link_base}/new-password"]
    return Mail(to, templates[change]["subject"], "\n\n".join(lines) + "\n")


def _browser_language(request: Request) -> Language:
    """Return the first of the browser's languages that the platform has."""
    for part in request.headers.get("accept-language", "").split(","):
        code = part.partition(";")[0].strip().partition("-")[0].lower()
        for language in LANGUAGES:
            if code == language:
                return language
    return "en"
