"""Mails: no name, subject or address adds a header or a receiver."""

from __future__ import annotations

import base64
import socketserver
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from email import message_from_bytes, policy
from email.message import EmailMessage
from email.utils import parsedate_to_datetime
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from walltopo.core import SettingsError
from walltopo_gym.accounts.passkeys import Site
from walltopo_gym.domains import ascii_mail, ascii_url
from walltopo_gym.mail import Mail, SmtpMailer, sender_of
from walltopo_gym.operating.doctor import examine
from walltopo_gym.settings import GymSettings, load_settings

HEADERS = {
    "From",
    "To",
    "Subject",
    "Date",
    "Message-ID",
    "Content-Type",
    "Content-Transfer-Encoding",
    "MIME-Version",
}
SENDER = "walltopo@gym.example"
BREAKS = (
    "\r\nBcc: eve@example.com",
    "\nBcc: eve@example.com",
    "\r\n\r\n<b>text</b>",
    "\r\n.\r\nQUIT",
)


class Kept(SmtpMailer):
    """A mailer that keeps what it would deliver, as the bytes of SMTP's DATA."""

    def __init__(self) -> None:
        given = {"data": Path(), "smtp_host": "localhost", "mail_from": SENDER}
        super().__init__(load_settings(given, {}))
        self.sent: list[bytes] = []

    def _deliver(self, message: EmailMessage) -> None:
        self.sent.append(message.as_bytes(policy=policy.SMTP))


@pytest.mark.parametrize("field", ["to", "subject"])
@given(before=st.text(max_size=20), broken=st.sampled_from(BREAKS))
def test_a_line_break_adds_no_header(field: str, before: str, broken: str) -> None:
    mailer = Kept()
    words = {"to": "ada@gym.example", "subject": "News"} | {field: before + broken}
    try:
        mailer.hand_over(Mail(words["to"], words["subject"], "Hello"))
    except (ValueError, IndexError, OSError):  # refused by the email package
        assert mailer.sent == []
        return
    made = message_from_bytes(mailer.sent[0], policy=policy.SMTP)
    assert set(made.keys()) == HEADERS
    assert "eve@example.com" not in str(made["To"])


def test_a_text_with_a_dot_alone_is_one_mail() -> None:
    mailer = Kept()
    mailer.hand_over(Mail("ada@gym.example", "News", "one\n.\nQUIT\ntwo"))
    made = message_from_bytes(mailer.sent[0], policy=policy.SMTP)
    assert made.get_content().splitlines() == ["one", ".", "QUIT", "two"]


class _Session(socketserver.StreamRequestHandler):
    """A mail server that speaks as much of SMTP as the platform uses, and signs one account in."""

    server: _SmtpServer

    def handle(self) -> None:
        self._say("220 mail.example")
        while line := self.rfile.readline().decode().strip():
            word, _, rest = line.partition(" ")
            match word.upper():
                case "EHLO":
                    self._say("250-mail.example")
                    self._say("250 AUTH PLAIN")
                case "AUTH":
                    _, user, password = base64.b64decode(rest.split()[1]).decode().split("\0")
                    known = (user, password) == self.server.account
                    self._say("235 welcome" if known else "535 wrong account")
                case "DATA":
                    self._say("354 go on")
                    lines = []
                    while (row := self.rfile.readline()) != b".\r\n":
                        lines.append(row)
                    self.server.mails.append(b"".join(lines))
                    self._say("250 kept")
                case "QUIT":
                    self._say("221 bye")
                    return
                case _:
                    self._say("250 fine")

    def _say(self, line: str) -> None:
        self.wfile.write(f"{line}\r\n".encode())


class _SmtpServer(socketserver.ThreadingTCPServer):
    daemon_threads = True

    def __init__(self, account: tuple[str, str]) -> None:
        super().__init__(("127.0.0.1", 0), _Session)
        self.account = account
        self.mails: list[bytes] = []


@contextmanager
def mail_server(user: str, password: str) -> Iterator[_SmtpServer]:
    with _SmtpServer((user, password)) as server:
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        yield server
        server.shutdown()


def settings_for(server: _SmtpServer, folder: Path, password: str) -> GymSettings:
    given = {
        "data": folder,
        "smtp_host": "127.0.0.1",
        "smtp_port": server.server_address[1],
        "smtp_security": "none",
        "smtp_user": "walls",
        "smtp_password": password,
        "mail_from": SENDER,
    }
    return load_settings(given, {})


@pytest.mark.parametrize("password", ["secret", "a/b#c?d%e", "Grün&Fels", "p@ss:word"])
def test_any_password_signs_in_and_the_mail_is_complete(tmp_path: Path, password: str) -> None:
    with mail_server("walls", password) as server:
        mailer = SmtpMailer(settings_for(server, tmp_path, password))
        mailer.hand_over(Mail("ada@grün.example", "News", "Hello"))
        made = message_from_bytes(server.mails[0], policy=policy.SMTP)
    assert parsedate_to_datetime(made["Date"]).tzinfo is not None
    assert made["Message-ID"].endswith("@gym.example>")
    assert str(made["To"]) == "ada@xn--grn-ioa.example"


def test_the_doctor_signs_in_to_the_mail_server(tmp_path: Path) -> None:
    with mail_server("walls", "right") as server:
        for password, state in (("right", "well"), ("wrong", "bad")):
            found = {f.what: f for f in examine(settings_for(server, tmp_path, password))}
            assert found["mail"].state == state, found["mail"].message
    assert "wrong account" in found["mail"].message


def test_links_carry_the_port_that_is_served(tmp_path: Path) -> None:
    served = {"data": tmp_path, "port": 8191}
    assert load_settings(served, {}).link_base == "http://localhost:8191"
    named = load_settings(served | {"address": "https://walls.gym.example/"}, {})
    assert named.link_base == "https://walls.gym.example"


@pytest.mark.parametrize("address", ["https://gym.example/walls", "walls.gym.example", "ftp://a.b"])
def test_an_address_that_cannot_be_served_is_refused(tmp_path: Path, address: str) -> None:
    with pytest.raises(SettingsError, match="expected an address"):
        load_settings({"data": tmp_path, "address": address}, {})


def test_a_domain_stays_as_it_is_or_is_refused() -> None:
    assert ascii_mail("a@b.example") == "a@b.example"
    with pytest.raises(ValueError, match="not a domain"):
        ascii_mail("a@-ü-.example")


UMLAUT = "https://kletterhalle-köln.example"
ASCII = "https://xn--kletterhalle-kln-zwb.example"


def test_a_server_with_an_umlaut_sends_mails_and_compares_origins(tmp_path: Path) -> None:
    """Mail servers without SMTPUTF8, browsers and passkeys know the name in ASCII alone."""
    with mail_server("walls", "right") as server:
        given = settings_for(server, tmp_path, "right").model_copy(
            update={"address": UMLAUT, "mail_from": ""}
        )
        SmtpMailer(given).hand_over(Mail("ada@gym.example", "News", f"{given.link_base}/me"))
        made = message_from_bytes(server.mails[0], policy=policy.SMTP)
    assert str(made["From"]) == f"walltopo@{ASCII.removeprefix('https://')}"
    assert ASCII in made.get_content()
    assert given.link_base == ASCII
    assert Site(given.link_base).host == ASCII.removeprefix("https://")
    named = given.model_copy(update={"mail_from": "walls@köln.example"})
    assert sender_of(named) == "walls@xn--kln-sna.example"


@pytest.mark.parametrize(
    ("typed", "sent"),
    [
        (f"{UMLAUT}:8443/hö?q=ü", f"{ASCII}:8443/h%C3%B6?q=%C3%BC"),
        ("https://straße.example/a%20b", "https://xn--strae-oqa.example/a%20b"),
        ("https://gym.example/a b", "https://gym.example/a b"),
    ],
)
def test_an_address_is_sent_in_ascii(typed: str, sent: str) -> None:
    assert ascii_url(typed) == sent
