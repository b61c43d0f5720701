"""Store each message once, and queue it.

Person, kind, subject and channel of a message are unique in its table, so two workers that find the
same message at the same moment store it once.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass
from typing import Any, Final
from uuid import UUID, uuid4

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.clock import now
from walltopo_gym.database.engine import Database
from walltopo_gym.gyms.models import Gym, Membership
from walltopo_gym.jobs.queue import Job, enqueue
from walltopo_gym.notifications.models import Message, NotificationPreferences, PushAddress
from walltopo_gym.words import Words, words_in

_WAITS: Final = (60, 600, 3600, 14400, 43200)
MAILS: Final = Job("mails", at_once=16, of_one_gym=8, waits=_WAITS)
PUSHES: Final = Job("pushes", waits=_WAITS)
MAIL: Final = "mail"
DIGEST: Final = "digest"  # the one kind that may be sent by mail
_TEXT: Final = 300

Row = dict[str, Any]


@dataclass(frozen=True)
class Shown:
    """The content of a push message; `path` is opened by a tap."""

    title: str
    text: str
    path: str


@dataclass(frozen=True)
class Notice:
    """A push message to some of a gym's members, in the language of each.

    Parameters
    ----------
    kind : of the message, and subject : of its content; a person gets each once.
    tag : a browser shows the latest message per tag.
    wanted_by : the preference (a column of `NotificationPreferences`) that turns it on.
    """

    kind: str
    subject: str
    tag: str
    wanted_by: str
    shown: Callable[[Words], Shown]


def recipient_preferences(
    session: Session, gym: UUID, preference: str
) -> list[NotificationPreferences]:
    """Return the preferences of the members who want messages of a kind and can get them."""
    column = getattr(NotificationPreferences, preference)
    members = (
        select(NotificationPreferences)
        .join(Membership, Membership.person_id == NotificationPreferences.person_id)
        .where(Membership.gym_id == gym, column.is_(True))
    )
    if preference != DIGEST:
        members = members.where(
            NotificationPreferences.person_id.in_(select(PushAddress.person_id))
        )
    return list(session.scalars(members))


def notify(session: Session, gym: Gym, notice: Notice, people: Collection[UUID]) -> None:
    """Store a message to those of these people who want it, and queue it."""
    wanted = [
        each
        for each in recipient_preferences(session, gym.id, notice.wanted_by)
        if each.person_id in people
    ]
    store_messages(session, unstored_messages(session, push_rows(session, gym, notice, wanted)))


def push_rows(
    session: Session, gym: Gym, notice: Notice, to: Iterable[NotificationPreferences]
) -> list[Row]:
    """Return the rows of a message, one for each browser of each person."""
    preferences = {each.person_id: each for each in to}
    browsers = session.scalars(
        select(PushAddress).where(PushAddress.person_id.in_(list(preferences)))
    )
    rows = []
    for browser in browsers:
        shown = notice.shown(words_in(preferences[browser.person_id].language))
        body = vars(shown) | {"text": shown.text[:_TEXT], "tag": notice.tag}
        person, target = browser.person_id, str(browser.id)
        rows.append(message_row(gym, person, notice.kind, notice.subject, target, body))
    return rows


def message_row(
    gym: Gym, person: UUID, kind: str, subject: str, target: str, body: dict[str, Any]
) -> Row:
    """Return the row of a message through a channel: `MAIL`, or the id of a browser."""
    return {
        "id": uuid4(),
        "created_at": now(),
        "person_id": person,
        "gym_id": gym.id,
        "kind": kind,
        "subject": subject,
        "target": target,
        "body": body,
        "sent_at": None,
        "error": "",
    }


def unstored_messages(session: Session, rows: Iterable[Row]) -> list[Row]:
    """Return the messages that are not stored yet, each once."""
    wanted = {_message_key(row): row for row in rows}
    there = select(Message.person_id, Message.kind, Message.subject, Message.target)
    subjects = {row["subject"] for row in wanted.values()}
    known = {tuple(row) for row in session.execute(there.where(Message.subject.in_(subjects)))}
    return [row for key, row in wanted.items() if key not in known]


def store_messages(session: Session, rows: Iterable[Row]) -> int:
    """Store messages and queue those that are to be sent; return how many are new."""
    database: Database = session.info["database"]
    new = 0
    for row in rows:
        # Another worker may have been first.
        once = database.insert(Message).values(**row).on_conflict_do_nothing()
        if session.scalar(once.returning(Message.id)) is None:
            continue
        new += 1
        if row["sent_at"] is None:
            job = MAILS if row["target"] == MAIL else PUSHES
            enqueue(session, job, str(row["id"]), gym=row["gym_id"])
    return new


def _message_key(row: Row) -> tuple[UUID, str, str, str]:
    return row["person_id"], row["kind"], row["subject"], row["target"]
