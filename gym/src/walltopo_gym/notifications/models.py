"""Tables of messages to people: preferences, browsers, messages."""

from __future__ import annotations

from datetime import datetime
from typing import Any, Literal
from uuid import UUID

from sqlalchemy import JSON, ForeignKey, String, UniqueConstraint, false
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_gym.database.base import Base, Keyed
from walltopo_gym.languages import Language

_PERSON = "people.id"
Channel = Literal["mail", "push"]


class NotificationPreferences(Base):
    """Message preferences; a person without a row gets no messages.

    `digest`: weekly, by mail or push as `digest_by` says; the others at once, by push. From
    `quiet_from` to `quiet_to`, hours by the gym's clock, no push is sent; equal hours: never quiet.
    """

    __tablename__ = "notification_preferences"

    person_id: Mapped[UUID] = mapped_column(
        ForeignKey(_PERSON, ondelete="CASCADE"), primary_key=True
    )
    language: Mapped[Language] = mapped_column(String(2))
    digest: Mapped[bool]
    digest_by: Mapped[Channel] = mapped_column(String(4), default="mail", server_default="mail")
    new_routes: Mapped[bool]
    soon: Mapped[bool]
    competitions: Mapped[bool]
    hold_reports: Mapped[bool]
    forerun: Mapped[bool] = mapped_column(default=False, server_default=false())
    inspections: Mapped[bool] = mapped_column(default=False, server_default=false())
    quiet_from: Mapped[int]
    quiet_to: Mapped[int]


class PushAddress(Keyed, Base):
    """A browser's push address (RFC 8030), and its encryption keys (RFC 8291)."""

    __tablename__ = "push_addresses"

    person_id: Mapped[UUID] = mapped_column(ForeignKey(_PERSON, ondelete="CASCADE"), index=True)
    endpoint: Mapped[str] = mapped_column(String(1000), unique=True)
    public_key: Mapped[str] = mapped_column(String(100))
    secret: Mapped[str] = mapped_column(String(40))
    browser: Mapped[str] = mapped_column(String(200), default="")


class Message(Keyed, Base):
    """A message to one person, sent once through one channel.

    `kind` and `subject` say what it is about, `target` is "mail" or a push address. The row stays
    after sending or after giving up for `error`, so that the message is not sent again. `body`:
    content for the channel, until it is sent: it has names and notes of others.
    """

    __tablename__ = "messages"
    __table_args__ = (UniqueConstraint("person_id", "kind", "subject", "target"),)

    person_id: Mapped[UUID] = mapped_column(ForeignKey(_PERSON, ondelete="CASCADE"))
    gym_id: Mapped[UUID] = mapped_column(ForeignKey("gyms.id", ondelete="CASCADE"), index=True)
    kind: Mapped[str] = mapped_column(String(20))
    subject: Mapped[str] = mapped_column(String(80))
    target: Mapped[str] = mapped_column(String(36))
    body: Mapped[dict[str, Any]] = mapped_column(JSON)
    sent_at: Mapped[datetime | None]
    error: Mapped[str] = mapped_column(String(300), default="")
