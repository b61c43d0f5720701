"""Tables of webhooks and their messages."""

from __future__ import annotations

from datetime import datetime
from typing import Any
from uuid import UUID

from sqlalchemy import JSON, ForeignKey, String
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_gym.clock import now
from walltopo_gym.database.base import Base, Keyed


class Webhook(Keyed, Base):
    """An address of a gym's own program; `secret` signs the messages, so it is stored in plain
    text.

    `last_delivered_at`: time of the last delivery.
    """

    __tablename__ = "webhooks"

    gym_id: Mapped[UUID] = mapped_column(ForeignKey("gyms.id", ondelete="CASCADE"), index=True)
    url: Mapped[str] = mapped_column(String(500))
    secret: Mapped[str] = mapped_column(String(100))
    last_delivered_at: Mapped[datetime | None]


class WebhookEvent(Keyed, Base):
    """A message to one address, written with the change itself. It stays for some days after its
    delivery, so that it can be sent again.

    `tries`: number of failures; `next_at`: time of the next try; `error`: result of the last try;
    `delivered_at`: None until it is accepted.
    """

    __tablename__ = "webhook_events"

    webhook_id: Mapped[UUID] = mapped_column(
        ForeignKey("webhooks.id", ondelete="CASCADE"), index=True
    )
    body: Mapped[dict[str, Any]] = mapped_column(JSON)
    tries: Mapped[int] = mapped_column(default=0)
    next_at: Mapped[datetime] = mapped_column(default=now)
    error: Mapped[str] = mapped_column(String(300), default="")
    delivered_at: Mapped[datetime | None]
