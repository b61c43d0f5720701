"""Sending of messages, with the same retries as webhooks.

A worker that is killed after a server accepted a message and before the note of it sends again: the
mail has the same Message-ID, and a browser shows one notification per tag.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import timedelta
from typing import Final
from urllib.parse import urlsplit
from uuid import UUID

from sqlalchemy import delete, func, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.models import Person
from walltopo_gym.clock import now
from walltopo_gym.database.engine import Database
from walltopo_gym.errors import NotFoundError
from walltopo_gym.events import MailQueue, MailQueueOf
from walltopo_gym.gyms.days import zone_of
from walltopo_gym.gyms.models import Gym
from walltopo_gym.jobs.queue import Failure, NotYetError
from walltopo_gym.mail import Mail, Mailer, sender_of
from walltopo_gym.notifications.messages import MAIL, MAILS
from walltopo_gym.notifications.models import Message, PushAddress
from walltopo_gym.notifications.preferences import awake_at, preferences_of
from walltopo_gym.notifications.push import push
from walltopo_gym.notifications.secrets import push_key, unsubscribe_token
from walltopo_gym.settings import GymSettings
from walltopo_gym.words import words_in


@dataclass(frozen=True)
class MessageSender:
    """Sends single messages."""

    settings: GymSettings
    database: Database
    mailer: Mailer

    def mail(self, message: str) -> None:
        """Send a message by mail, unless it was sent.

        Raises
        ------
        OSError : the mail server refused it.
        """
        row = self._unsent(message)
        if row is not None:
            self._mail(row)
            self._note_sent(row)

    def push(self, message: str) -> None:
        """Send a push message, unless it was sent.

        Raises
        ------
        NotYetError : it is the reader's quiet time; OSError : the push service refused it.
        """
        row = self._unsent(message)
        if row is None:
            return
        self._check_awake(row)
        try:
            self._push(row)
        except NotFoundError:
            with self.database.writing() as session:
                session.execute(delete(PushAddress).where(PushAddress.id == UUID(row.target)))
        self._note_sent(row)

    def _unsent(self, message: str) -> Message | None:
        with self.database.reading() as session:
            row = session.get(Message, UUID(message))
        return row if row is not None and row.sent_at is None else None

    def _check_awake(self, row: Message) -> None:
        with self.database.reading() as session:
            zone = zone_of(session.get_one(Gym, row.gym_id))
            awake = awake_at(preferences_of(session, row.person_id), now(), zone)
        if awake > now():
            raise NotYetError(awake)

    def _note_sent(self, row: Message) -> None:
        with self.database.writing() as session:
            kept = session.get(Message, row.id)
            if kept is not None:
                kept.error, kept.sent_at, kept.body = "", now(), {}

    def _mail(self, row: Message) -> None:
        with self.database.reading() as session:
            person = session.get_one(Person, row.person_id)
            preferences = preferences_of(session, row.person_id)
            gym = session.get_one(Gym, row.gym_id)
        if not preferences.digest or preferences.digest_by != MAIL:
            return  # they have changed their mind since
        base = self.settings.link_base
        token = unsubscribe_token(self.database, person.id)
        words = words_in(preferences.language)
        end = [f"{base}/g/{gym.slug}", "", words.say("digest_end"), f"{base}/unsubscribe#{token}"]
        host = urlsplit(base).hostname or "localhost"
        headers = {
            # RFC 8058: the mail program's own button ends it.
            "List-Unsubscribe": f"<{base}/api/v1/unsubscribe/{token}>",
            "List-Unsubscribe-Post": "List-Unsubscribe=One-Click",
            "Message-ID": f"<{row.id}@{host}>",
        }
        text = "\n".join([*row.body["lines"], *end]) + "\n"
        self.mailer.hand_over(Mail(person.email, row.body["subject"], text, headers))

    def _push(self, row: Message) -> None:
        with self.database.reading() as session:
            address = session.get(PushAddress, UUID(row.target))
        if address is None:
            return
        push(
            address,
            row.body,
            push_key(self.database),
            sender_of(self.settings),
            private=self.settings.webhooks_to_private,
        )


def record_failure(session: Session, failure: Failure, message: str) -> None:
    """Store the reason of a failure; after the last attempt it stays."""
    row = session.get(Message, UUID(message))
    if row is not None:
        row.error = failure.error[:300]
        row.sent_at = now() if failure.again_at is None else None
        if row.sent_at is not None:
            row.body = {}


_SHOWN: Final = timedelta(days=30)


def answer_mail_queue(session: Session, question: MailQueueOf) -> None:
    """Answer how many mails wait and failed, with the last error."""
    recent = Message.target == MAIL, Message.created_at > now() - _SHOWN
    with_error = select(Message.error, Message.created_at).where(*recent, Message.error != "")
    last = session.execute(with_error.order_by(Message.created_at.desc()).limit(1)).first()
    counts = select(
        func.count().filter(Message.sent_at.is_(None)),
        func.count().filter(Message.sent_at.is_not(None), Message.error != ""),
    ).where(*recent)
    waiting, failed = session.execute(counts).one()
    error, at = last or ("", None)
    question.found.append(MailQueue(MAILS.name, waiting, failed, error, at))
