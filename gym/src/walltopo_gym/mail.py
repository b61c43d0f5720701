"""Mails: by SMTP if it is configured, else shown in the console."""

from __future__ import annotations

import logging
import smtplib
from base64 import b64encode
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from email.message import EmailMessage
from email.utils import format_datetime, make_msgid
from typing import Protocol
from urllib.parse import urlsplit

from walltopo_gym.clock import now
from walltopo_gym.database.lock import check_unlocked
from walltopo_gym.domains import ascii_domain, ascii_mail
from walltopo_gym.log_lines import OWN_LINES
from walltopo_gym.settings import GymSettings

_LOG = logging.getLogger("walltopo_gym.mail")
_PATIENCE_S = 30
_SIGNED_IN = 235


@dataclass(frozen=True)
class Mail:
    """A plain-text mail; `headers` are added to the common ones."""

    to: str
    subject: str
    text: str
    headers: Mapping[str, str] = field(default_factory=dict)


class Mailer(Protocol):
    """Sends mails."""

    def send(self, mail: Mail) -> None:
        """Send a mail; a failure is logged, because no caller waits for it."""

    def hand_over(self, mail: Mail) -> None:
        """Send a mail with the same Message-ID in each try.

        Raises
        ------
        OSError : the server refused it.
        """


class ConsoleMailer:
    """Shows mails to the operator, who can pass them on."""

    def send(self, mail: Mail) -> None:
        _LOG.warning(
            "mail (set `smtp_host` to have it sent)\n  to: %s\n  %s\n\n%s",
            mail.to,
            mail.subject,
            mail.text,
            extra=OWN_LINES,
        )

    hand_over = send


class SmtpMailer:
    """Sends by the SMTP server of the settings.

    Parameters
    ----------
    settings : `smtp_host` and the other settings of the server.
    """

    def __init__(self, settings: GymSettings) -> None:
        self._settings = settings
        self._secure = settings.smtp_security == "tls"
        self._port = settings.smtp_port or (465 if self._secure else 587)
        self._sender = sender_of(settings)

    def send(self, mail: Mail) -> None:
        try:
            self.hand_over(mail)
        except OSError as error:
            _LOG.error(
                "a mail to %s was not sent: %s", _ascii_domain(mail.to), without_address(error)
            )

    def hand_over(self, mail: Mail) -> None:
        message = EmailMessage()
        message["From"], message["To"] = self._sender, _in_ascii(mail.to)
        message["Subject"] = mail.subject
        # Large providers refuse mails without these two.
        message["Date"] = format_datetime(now())
        for name, value in mail.headers.items():
            message[name] = value
        if "Message-ID" not in message:
            message["Message-ID"] = make_msgid(domain=self._sender.rpartition("@")[2])
        message.set_content(mail.text)
        try:
            self._deliver(message)  # SMTP's own errors are OSErrors, too
        except smtplib.SMTPRecipientsRefused as error:
            raise OSError(without_address(error)) from None

    def check(self) -> None:
        """Connect and sign in, without sending a mail.

        Raises
        ------
        OSError : the server is not reached, or refuses the account.
        """
        with self._signed_in():
            pass

    def _deliver(self, message: EmailMessage) -> None:
        with self._signed_in() as server:
            server.send_message(message)

    @contextmanager
    def _signed_in(self) -> Iterator[smtplib.SMTP]:
        check_unlocked("the mail server is called")
        kind = smtplib.SMTP_SSL if self._secure else smtplib.SMTP
        host = ascii_domain(self._settings.smtp_host)
        with kind(host, self._port, timeout=_PATIENCE_S) as server:
            if self._settings.smtp_security == "starttls":
                server.starttls()
            if self._settings.smtp_user:
                _sign_in(server, self._settings.smtp_user, self._settings.smtp_password)
            yield server


def without_address(error: OSError) -> str:
    """Return an error of sending without the recipient's address, which outlives an account."""
    if isinstance(error, smtplib.SMTPRecipientsRefused):
        reasons = (f"{code} {text!r}" for code, text in error.recipients.values())
        return f"the mail server refused the recipient: {', '.join(reasons)}"
    return str(error)


def _ascii_domain(address: str) -> str:
    return address.rpartition("@")[2]


def _sign_in(server: smtplib.SMTP, user: str, password: str) -> None:
    """Sign in to a mail server; raise SMTPException (an OSError) if it refuses."""
    if user.isascii() and password.isascii():
        server.login(user, password)
        return
    # smtplib encodes ASCII alone; SASL's PLAIN is UTF-8 (RFC 4616).
    server.ehlo_or_helo_if_needed()
    words = b64encode(f"\0{user}\0{password}".encode()).decode("ascii")
    code, answer = server.docmd("AUTH", f"PLAIN {words}")
    if code != _SIGNED_IN:
        raise smtplib.SMTPAuthenticationError(code, answer)


def make_mailer(settings: GymSettings) -> Mailer:
    """Return the mailer of the settings."""
    return SmtpMailer(settings) if settings.smtp_host else ConsoleMailer()


def sender_of(settings: GymSettings) -> str:
    """Return this server's sender address."""
    host = urlsplit(settings.link_base).hostname or "localhost"
    return _in_ascii(settings.mail_from) or f"walltopo@{host}"


def _in_ascii(address: str) -> str:
    try:
        return ascii_mail(address)
    except ValueError as error:
        raise OSError(str(error)) from error
