"""Endpoints of webhooks for publications and stripped routes."""

from __future__ import annotations

from datetime import datetime
from typing import Final
from uuid import UUID

from fastapi import APIRouter
from pydantic import BaseModel, Field
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.audit import log_change
from walltopo_gym.api.fields import Body
from walltopo_gym.api.services import Db, ServicesOf
from walltopo_gym.database.engine import take_turn
from walltopo_gym.errors import ConflictError, NotFoundError
from walltopo_gym.gyms.access import OwnerMay
from walltopo_gym.outgoing import check_url
from walltopo_gym.webhooks.models import Webhook, WebhookEvent
from walltopo_gym.webhooks.service import DELIVERY, new_signing_secret

router = APIRouter(tags=["webhooks"])

_MOST = 10
_SHOWN = 20


class NewWebhook(Body):
    url: str = Field(max_length=500, pattern=r"^[\x21-\x7e]+$")


class Delivery(BaseModel):
    """An undelivered message; `next_at`: time of the next try."""

    id: UUID
    type: str
    created_at: datetime
    tries: int
    next_at: datetime
    error: str


class WebhookOut(BaseModel):
    """A webhook; `waiting`: number of undelivered messages, `error`: why the last one failed;
    `last_delivered_at`: time of the last delivery; `deliveries`: the first that wait."""

    id: UUID
    url: str
    created_at: datetime
    waiting: int
    error: str
    last_delivered_at: datetime | None
    deliveries: list[Delivery]


class MadeWebhook(BaseModel):
    """A new webhook; the secret that signs its messages is shown once."""

    id: UUID
    secret: str


@router.get("/gyms/{gym}/webhooks")
def list_webhooks(session: Db, access: OwnerMay) -> list[WebhookOut]:
    """Return the gym's webhooks and their state."""
    mine = select(Webhook).where(Webhook.gym_id == access.gym.id).order_by(Webhook.created_at)
    return [_webhook_out(session, row) for row in session.scalars(mine)]


@router.post("/gyms/{gym}/webhooks", status_code=201)
def make_webhook(
    body: NewWebhook, session: Db, services: ServicesOf, access: OwnerMay
) -> MadeWebhook:
    """Add a webhook, signed by Standard Webhooks."""
    check_url(body.url, private=services.settings.webhooks_to_private)
    take_turn(session, f"webhooks {access.gym.id}")
    count = select(func.count()).select_from(Webhook).where(Webhook.gym_id == access.gym.id)
    if (session.scalar(count) or 0) >= _MOST:
        raise ConflictError("webhooks-most", most=_MOST)
    row = Webhook(gym_id=access.gym.id, url=body.url, secret=new_signing_secret())
    session.add(row)
    session.flush()
    log_change(
        session, "webhook.create", person=access.actor.known, gym=access.gym.id, subject=body.url
    )
    return MadeWebhook(id=row.id, secret=row.secret)


@router.delete("/gyms/{gym}/webhooks/{webhook}", status_code=204)
def drop_webhook(webhook: UUID, session: Db, access: OwnerMay) -> None:
    """Delete a webhook."""
    row = session.get(Webhook, webhook)
    if row is None or row.gym_id != access.gym.id:
        raise NotFoundError("not-there-webhook")
    session.delete(row)
    log_change(
        session, "webhook.delete", person=access.actor.known, gym=access.gym.id, subject=row.url
    )


def _webhook_out(session: Session, row: Webhook) -> WebhookOut:
    waiting = select(WebhookEvent).where(WebhookEvent.webhook_id == row.id)
    events = session.scalars(waiting.order_by(WebhookEvent.created_at.desc())).all()
    error = next((event.error for event in events if event.error), "")
    return WebhookOut(
        id=row.id,
        url=row.url,
        created_at=row.created_at,
        error=error,
        waiting=sum(event.tries < DELIVERY.max_tries for event in events),
        last_delivered_at=row.last_delivered_at,
        deliveries=[
            Delivery(
                id=event.id,
                type=str(event.body.get("type", "")),
                tries=event.tries,
                created_at=event.created_at,
                next_at=event.next_at,
                error=event.error,
            )
            for event in events[:_SHOWN]
        ],
    )


ROUTERS: Final[tuple[APIRouter, ...]] = (router,)
