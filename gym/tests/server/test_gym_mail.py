"""Mails: no name, subject or address adds a header or a receiver."""

from __future__ import annotations

from email import message_from_bytes, policy
from email.message import EmailMessage

import pytest
from hypothesis import given
from hypothesis import strategies as st

from walltopo_gym.mail import Letter, SmtpMailer

HEADERS = {"From", "To", "Subject", "Content-Type", "Content-Transfer-Encoding", "MIME-Version"}
BREAKS = (
    "\r\nBcc: eve@example.com",
    "\nBcc: eve@example.com",
    "\r\n\r\n<b>text</b>",
    "\r\n.\r\nQUIT",
)


class Kept(SmtpMailer):
    """A mailer that keeps what it would deliver, as the bytes of SMTP's DATA."""

    def __init__(self) -> None:
        super().__init__("smtp://localhost", "walltopo@gym.example")
        self.sent: list[bytes] = []

    def _deliver(self, message: EmailMessage) -> None:
        self.sent.append(message.as_bytes(policy=policy.SMTP))


@pytest.mark.parametrize("field", ["to", "subject"])
@given(before=st.text(max_size=20), broken=st.sampled_from(BREAKS))
def test_a_line_break_adds_no_header(field: str, before: str, broken: str) -> None:
    mailer = Kept()
    words = {"to": "ada@gym.example", "subject": "News"} | {field: before + broken}
    try:
        mailer.hand_over(Letter(words["to"], words["subject"], "Hello"))
    except (ValueError, IndexError):  # refused by the email package
        assert mailer.sent == []
        return
    made = message_from_bytes(mailer.sent[0], policy=policy.SMTP)
    assert set(made.keys()) == HEADERS
    assert "eve@example.com" not in str(made["To"])


def test_a_text_with_a_dot_alone_is_one_mail() -> None:
    mailer = Kept()
    mailer.hand_over(Letter("ada@gym.example", "News", "one\n.\nQUIT\ntwo"))
    made = message_from_bytes(mailer.sent[0], policy=policy.SMTP)
    assert made.get_content().splitlines() == ["one", ".", "QUIT", "two"]
