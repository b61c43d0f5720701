"""What has changed, noted for every address of the gym in the transaction of the change."""

from __future__ import annotations

from typing import Literal
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.clock import now
from walltopo_gym.webhooks.models import Webhook, WebhookEvent

Kind = Literal["wall.published", "route.stripped"]


def note(session: Session, gym: UUID, kind: Kind, **facts: str) -> None:
    """Let the gym's addresses be told.

    Parameters
    ----------
    facts : ids of what has changed; more is asked of the API.
    """
    body = {"type": kind, "timestamp": now().isoformat(), "data": facts}
    for webhook in session.scalars(select(Webhook.id).where(Webhook.gym_id == gym)):
        session.add(WebhookEvent(webhook_id=webhook, body=body))
