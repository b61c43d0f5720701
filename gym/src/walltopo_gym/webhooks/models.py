"""Tables of webhooks, and of what is to be told."""

from __future__ import annotations

from datetime import datetime
from typing import Any
from uuid import UUID

from sqlalchemy import JSON, ForeignKey, String
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_gym.clock import now
from walltopo_gym.database.base import Base, Keyed


class Webhook(Keyed, Base):
    """An address of a gym's own program; `secret` signs what is sent there, so it is kept whole.

    `told_at`: when a message was taken last.
    """

    __tablename__ = "webhooks"

    gym_id: Mapped[UUID] = mapped_column(ForeignKey("gyms.id", ondelete="CASCADE"), index=True)
    url: Mapped[str] = mapped_column(String(500))
    secret: Mapped[str] = mapped_column(String(100))
    told_at: Mapped[datetime | None]


class WebhookEvent(Keyed, Base):
    """Something to be told to one address: written with the change itself, gone when it was told.

    `tries` so far; `begun_at`: when a try began that has not ended; `next_at`: when it is tried
    again; `error`: what came of the last try.
    """

    __tablename__ = "webhook_events"

    webhook_id: Mapped[UUID] = mapped_column(
        ForeignKey("webhooks.id", ondelete="CASCADE"), index=True
    )
    body: Mapped[dict[str, Any]] = mapped_column(JSON)
    tries: Mapped[int] = mapped_column(default=0)
    next_at: Mapped[datetime] = mapped_column(default=now, index=True)
    begun_at: Mapped[datetime | None]
    error: Mapped[str] = mapped_column(String(300), default="")
