"""Messages are tried until they are taken, each try a workflow of DBOS, as webhooks are.

A worker that is killed between the answer of a mail server or push service and the note of it sends
once more: a mail then has the same Message-ID, a browser shows one notification of a tag.
"""

from __future__ import annotations

import logging
import time
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Final
from urllib.parse import urlsplit
from uuid import UUID

from dbos import DBOS, SetWorkflowID
from sqlalchemy import ColumnElement, delete, func, select
from sqlalchemy.orm import Session

from walltopo.core import InputError
from walltopo_gym.accounts.models import Person
from walltopo_gym.attempts.bounded import reason_of
from walltopo_gym.attempts.turns import fair_share
from walltopo_gym.climbing.counting import zone_of
from walltopo_gym.clock import now
from walltopo_gym.database.engine import Database
from walltopo_gym.errors import NotFoundError
from walltopo_gym.gyms.models import Gym
from walltopo_gym.hall.models import Message, PushAddress
from walltopo_gym.hall.occasions import DIGEST, note_all
from walltopo_gym.hall.push import push
from walltopo_gym.hall.secrets import push_key, unsubscribe_token
from walltopo_gym.hall.wishes import awake_at, wishes_of
from walltopo_gym.hall.words import words_in
from walltopo_gym.mail import Letter, Mailer, sender_of
from walltopo_gym.settings import GymSettings

_LOG = logging.getLogger("walltopo_gym.hall")
QUEUE: Final = "messages"
_LOOK_S: Final = 60
# Seconds to the next try; after the last one it is given up.
_WAITS: Final = (60, 600, 3600, 14400, 43200)
LAST_TRY: Final = len(_WAITS) + 1
# A try that was handed to the queue and never came to an end is made again after that.
_LEASE: Final = timedelta(minutes=15)
_EACH: Final = 2  # messages to browsers of one gym at a time: slow hosts hold up no other gym

_telling: Telling | None = None


@dataclass
class Telling:
    """Notes what is to be told, hands it to DBOS, and sees to each try."""

    settings: GymSettings
    database: Database
    mailer: Mailer
    looked: float = 0.0

    def begin_due(self) -> None:
        """Begin a try of what is due; once a minute, note what is new to tell."""
        global _telling
        _telling = self
        if not self.looked or time.monotonic() >= self.looked + _LOOK_S:
            self.looked = time.monotonic()
            try:
                note_all(self.database)
            except Exception:  # what was noted before is sent all the same
                _LOG.exception("new messages cannot be noted")
        for message, number in self.claim():
            with SetWorkflowID(f"message-{message}-{number}"):
                DBOS.enqueue_workflow(QUEUE, _tell, str(message))

    def claim(self) -> list[tuple[UUID, int]]:
        """Begin a try of what is due, and return its number; its next try is set before it begins.

        After the last try a message stays with its reason and is tried no more.
        """
        begun = []
        with self.database.writing() as session:
            # Asked again with the lock: another worker may have begun some meanwhile.
            mine = select(Message).where(Message.id.in_(_due(session)), *_is_due())
            for row in session.scalars(mine.with_for_update(skip_locked=True)).all():
                if row.tries >= LAST_TRY:
                    _give_up(row, row.error or "the worker ended during the last try")
                    continue
                try:
                    awake = self._awake_at(session, row)
                except Exception as error:
                    _LOG.exception("message %s", row.id)
                    row.tries += 1
                    _note_failure(row, error)
                    continue
                if awake > now():
                    row.next_at = awake
                    continue
                row.tries, row.begun_at = row.tries + 1, now()
                row.next_at = now() + _LEASE
                begun.append((row.id, row.tries))
        return begun

    def _awake_at(self, session: Session, row: Message) -> datetime:
        """Return when a message may be sent; a mail at any hour."""
        if row.kind == DIGEST:
            return now()
        gym = session.get_one(Gym, row.gym_id)
        return awake_at(wishes_of(session, row.person_id), now(), zone_of(gym))

    def try_once(self, message: UUID) -> None:
        """Send a message, unless it was."""
        with self.database.reading() as session:
            row = session.get(Message, message)
        if row is None or row.sent_at is not None:
            return
        failure: Exception | None = None
        try:
            if row.kind == DIGEST:
                self._mail(row)
            else:
                self._push(row)
        except NotFoundError:
            with self.database.writing() as session:
                session.execute(delete(PushAddress).where(PushAddress.id == UUID(row.target)))
        except Exception as error:
            failure = error
            if not isinstance(error, OSError | InputError):
                _LOG.exception("message %s", message)
        with self.database.writing() as session:
            kept = session.get(Message, message)
            if kept is not None:
                kept.begun_at = None
            if kept is not None and failure is not None:
                _note_failure(kept, failure)
            elif kept is not None:
                kept.error, kept.sent_at = "", now()

    def _mail(self, row: Message) -> None:
        with self.database.reading() as session:
            person = session.get_one(Person, row.person_id)
            wishes = wishes_of(session, row.person_id)
            gym = session.get_one(Gym, row.gym_id)
        if not wishes.digest:
            return  # they have changed their mind since
        base = self.settings.link_base
        token = unsubscribe_token(self.database, person.id)
        words = words_in(wishes.language)
        end = [f"{base}/g/{gym.slug}", "", words.say("digest_end"), f"{base}/unsubscribe#{token}"]
        host = urlsplit(base).hostname or "localhost"
        headers = {
            # RFC 8058: the mail program's own button ends it.
            "List-Unsubscribe": f"<{base}/api/v1/unsubscribe/{token}>",
            "List-Unsubscribe-Post": "List-Unsubscribe=One-Click",
            "Message-ID": f"<{row.id}@{host}>",
        }
        text = "\n".join([*row.body["lines"], *end]) + "\n"
        self.mailer.hand_over(Letter(person.email, row.body["subject"], text, headers))

    def _push(self, row: Message) -> None:
        with self.database.reading() as session:
            address = session.get(PushAddress, UUID(row.target))
        if address is None:
            return
        push(address, row.body, push_key(self.database), sender_of(self.settings),
             private=self.settings.webhooks_to_private)  # fmt: skip


def _is_due() -> tuple[ColumnElement[bool], ...]:
    return Message.sent_at.is_(None), Message.next_at <= now()


def _due(session: Session) -> list[UUID]:
    """Return what may be tried now: all mails, and of one gym only few messages to browsers."""
    due = _is_due()
    turn = func.row_number().over(
        partition_by=Message.gym_id, order_by=(Message.next_at, Message.id)
    )
    pushes = (
        select(Message.id, Message.gym_id)
        .where(*due, Message.kind != DIGEST)
        .order_by(turn, Message.next_at)
        .limit(500)
    )
    busy = select(Message.gym_id).where(
        Message.kind != DIGEST, Message.begun_at.is_not(None), Message.sent_at.is_(None),
        Message.next_at > now(),
    )  # fmt: skip
    mails = select(Message.id).where(*due, Message.kind == DIGEST).limit(200)
    chosen = fair_share(session.execute(pushes).all(), session.scalars(busy), _EACH)
    return [*session.scalars(mails), *chosen]


def _note_failure(row: Message, error: Exception) -> None:
    """Keep why a try failed; the next one is after a wait, or there is none."""
    if row.tries >= LAST_TRY:
        _give_up(row, reason_of(error))
        return
    wait = _WAITS[max(0, row.tries - 1)]
    row.error, row.next_at = reason_of(error)[:300], now() + timedelta(seconds=wait)


def _give_up(row: Message, why: str) -> None:
    _LOG.warning("message %s: given up (%s)", row.id, why)
    row.error, row.sent_at = why[:300], now()


@DBOS.workflow(name="message", max_recovery_attempts=len(_WAITS))
def _tell(message: str) -> None:
    DBOS.run_step({"name": "tell"}, _try_once, message)


def _try_once(message: str) -> None:
    assert _telling is not None, "the worker has not begun"
    _telling.try_once(UUID(message))
