"""Mails: by SMTP if it is configured, else shown in the console."""

from __future__ import annotations

import logging
import smtplib
from collections.abc import Mapping
from dataclasses import dataclass, field
from email.message import EmailMessage
from typing import Protocol
from urllib.parse import unquote, urlsplit

from walltopo.core import SettingsError
from walltopo_gym.settings import GymSettings

_LOG = logging.getLogger("walltopo_gym.mail")
_PATIENCE_S = 30


@dataclass(frozen=True)
class Letter:
    """A plain-text mail; `headers` are added to the common ones."""

    to: str
    subject: str
    text: str
    headers: Mapping[str, str] = field(default_factory=dict)


class Mailer(Protocol):
    """Sends mails."""

    def send(self, letter: Letter) -> None:
        """Send a mail; a failure is logged, because no caller waits for it."""

    def hand_over(self, letter: Letter) -> None:
        """Send a mail with the same Message-ID in each try.

        Raises
        ------
        OSError : the server refused it.
        """


class ConsoleMailer:
    """Shows mails to the operator, who can pass them on."""

    def send(self, letter: Letter) -> None:
        _LOG.warning(
            "mail (set `smtp` to have it sent)\n  to: %s\n  %s\n\n%s",
            letter.to, letter.subject, letter.text,
        )  # fmt: skip

    hand_over = send


class SmtpMailer:
    """Sends by SMTP: smtp:// with STARTTLS if the server offers it, smtps:// with TLS at once.

    Parameters
    ----------
    url : smtp[s]://user:password@host:port.
    sender : address that the mails come from.
    """

    def __init__(self, url: str, sender: str) -> None:
        parts = urlsplit(url)
        if parts.scheme not in ("smtp", "smtps") or not parts.hostname:
            raise SettingsError("smtp: expected smtp://user:password@host:port or smtps://...")
        self._secure = parts.scheme == "smtps"
        self._host, self._port = parts.hostname, parts.port or (465 if self._secure else 587)
        self._user, self._password = unquote(parts.username or ""), unquote(parts.password or "")
        self._sender = sender

    def send(self, letter: Letter) -> None:
        try:
            self.hand_over(letter)
        except OSError as error:
            _LOG.error("mail to %s was not sent: %s", letter.to, error)

    def hand_over(self, letter: Letter) -> None:
        message = EmailMessage()
        message["From"], message["To"] = self._sender, letter.to
        message["Subject"] = letter.subject
        for name, value in letter.headers.items():
            message[name] = value
        message.set_content(letter.text)
        self._deliver(message)  # SMTP's own errors are OSErrors, too

    def _deliver(self, message: EmailMessage) -> None:
        kind = smtplib.SMTP_SSL if self._secure else smtplib.SMTP
        with kind(self._host, self._port, timeout=_PATIENCE_S) as server:
            if not self._secure and server.ehlo()[0] == 250 and server.has_extn("starttls"):
                server.starttls()
            if self._user:
                server.login(self._user, self._password)
            server.send_message(message)


def make_mailer(settings: GymSettings) -> Mailer:
    """Return the mailer of the settings."""
    if not settings.smtp:
        return ConsoleMailer()
    return SmtpMailer(settings.smtp, sender_of(settings))


def sender_of(settings: GymSettings) -> str:
    """Return this server's sender address."""
    host = urlsplit(settings.address).hostname or "localhost"
    return settings.mail_from or f"walltopo@{host}"
