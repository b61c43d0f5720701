"""Mails to the owner of an account about changes of how it can be entered."""

from __future__ import annotations

from typing import Annotated, Literal
from uuid import UUID

from fastapi import BackgroundTasks, Depends, Request
from sqlalchemy.orm import Session

from walltopo_gym.accounts.mails import mail_templates
from walltopo_gym.accounts.models import Person
from walltopo_gym.api.services import ServicesOf
from walltopo_gym.languages import LANGUAGES, Language
from walltopo_gym.mail import Mail

Change = Literal[
    "passkey-added",
    "passkey-removed",
    "second-factor-on",
    "second-factor-off",
    "token-added",
    "token-removed",
    "password-changed",
    "account-deleted",
]


class _Notifier:
    """Mails an owner after the response of one request."""

    def __init__(self, request: Request, services: ServicesOf, later: BackgroundTasks) -> None:
        self._request, self._services, self._later = request, services, later

    def __call__(self, session: Session, person: UUID, change: Change, name: str = "") -> None:
        """Mail a person about a change.

        Parameters
        ----------
        name : of the passkey or token, as its maker wrote it.
        """
        to = session.get_one(Person, person).email
        self._later.add_task(self._services.mailer.send, self._mail(to, change, name))

    def _mail(self, to: str, change: Change, name: str) -> Mail:
        templates = mail_templates()[_language(self._request)]
        lines = [templates[change]["text"].replace("{name}", name)]
        if change != "account-deleted":
            lines += [
                templates["changed"]["text"],
                f"{self._services.settings.link_base}/new-password",
            ]
        return Mail(to, templates[change]["subject"], "\n\n".join(lines) + "\n")


NotifyOwner = Annotated[_Notifier, Depends(_Notifier)]


def _language(request: Request) -> Language:
    """Return the first of the browser's languages that the platform has."""
    for part in request.headers.get("accept-language", "").split(","):
        code = part.partition(";")[0].strip().partition("-")[0].lower()
        for language in LANGUAGES:
            if code == language:
                return language
    return "en"
