"""Tables of the screen in the hall, and of what people want to be told."""

from __future__ import annotations

from datetime import datetime
from typing import Any, Final
from uuid import UUID

from sqlalchemy import JSON, ForeignKey, Index, String, Text, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_gym.database.base import Base, Keyed
from walltopo_gym.languages import Language

_PERSON = "people.id"


class HallSettings(Base):
    """What a gym's screen shows; who has no row has `screen.DEFAULT`.

    `parts` in their order; each is shown for `seconds`; routes are new for `days`; `board`: others
    may see those who agreed to it. `key_hash`: of the secret that opens a private gym's screen.
    """

    __tablename__ = "hall_settings"

    gym_id: Mapped[UUID] = mapped_column(
        ForeignKey("gyms.id", ondelete="CASCADE"), primary_key=True
    )
    parts: Mapped[list[str]] = mapped_column(JSON)
    seconds: Mapped[int]
    days: Mapped[int]
    board: Mapped[bool]
    key_hash: Mapped[str | None] = mapped_column(String(64), unique=True)
    key_made_at: Mapped[datetime | None]


class Wishes(Base):
    """What somebody wants to be told of; who has no row is told nothing.

    `digest`: once a week by mail; the others at once, in browsers. From `quiet_from` to
    `quiet_to`, hours by the gym's clock, no browser is told anything; equal hours: never quiet.
    """

    __tablename__ = "wishes"

    person_id: Mapped[UUID] = mapped_column(
        ForeignKey(_PERSON, ondelete="CASCADE"), primary_key=True
    )
    language: Mapped[Language] = mapped_column(String(2))
    digest: Mapped[bool]
    fresh: Mapped[bool]
    soon: Mapped[bool]
    competitions: Mapped[bool]
    quiet_from: Mapped[int]
    quiet_to: Mapped[int]


class PushAddress(Keyed, Base):
    """Where one browser of somebody takes messages (RFC 8030), and the keys to encrypt them for it
    alone (RFC 8291)."""

    __tablename__ = "push_addresses"

    person_id: Mapped[UUID] = mapped_column(ForeignKey(_PERSON, ondelete="CASCADE"), index=True)
    endpoint: Mapped[str] = mapped_column(String(1000), unique=True)
    public_key: Mapped[str] = mapped_column(String(100))
    secret: Mapped[str] = mapped_column(String(40))
    browser: Mapped[str] = mapped_column(String(200), default="")


class Message(Keyed, Base):
    """Something that somebody is told once, on one way.

    `kind` and `subject` say what it is about, `target` the way: "mail", or a push address. The row
    stays when it was sent, so that it is not sent again. `body`: what the way needs.
    `begun_at`: when a try began that has not ended.
    """

    __tablename__ = "messages"
    __table_args__ = (
        UniqueConstraint("person_id", "kind", "subject", "target"),
        Index("ix_messages_due", "sent_at", "next_at"),
    )

    person_id: Mapped[UUID] = mapped_column(ForeignKey(_PERSON, ondelete="CASCADE"))
    gym_id: Mapped[UUID] = mapped_column(ForeignKey("gyms.id", ondelete="CASCADE"), index=True)
    kind: Mapped[str] = mapped_column(String(20))
    subject: Mapped[str] = mapped_column(String(80))
    target: Mapped[str] = mapped_column(String(36))
    body: Mapped[dict[str, Any]] = mapped_column(JSON)
    next_at: Mapped[datetime]
    begun_at: Mapped[datetime | None]
    tries: Mapped[int] = mapped_column(default=0)
    sent_at: Mapped[datetime | None]
    error: Mapped[str] = mapped_column(String(300), default="")


class ServerSecret(Base):
    """A secret of the server itself: made once, the same for all of its processes."""

    __tablename__ = "server_secrets"

    name: Mapped[str] = mapped_column(String(40), primary_key=True)
    content: Mapped[str] = mapped_column(Text)


# The tables that name a person, for whoever asks for all of theirs.
KINDS: Final[dict[str, Any]] = {
    "wishes": Wishes, "push_addresses": PushAddress, "messages": Message,
}  # fmt: skip
