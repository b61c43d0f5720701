"""Endpoints of webhooks and of their messages."""

from __future__ import annotations

from datetime import datetime
from typing import Final
from uuid import UUID

from fastapi import APIRouter
from pydantic import BaseModel, Field
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.limits import count_replay
from walltopo_gym.api.fields import Body
from walltopo_gym.api.services import Db, ServicesOf
from walltopo_gym.database.engine import take_turn
from walltopo_gym.errors import ConflictError, NotFoundError
from walltopo_gym.gyms.access import OwnerMay
from walltopo_gym.outgoing import check_url
from walltopo_gym.webhooks.models import Webhook, WebhookEvent
from walltopo_gym.webhooks.service import DELIVERY, is_waiting, new_signing_secret, replay

router = APIRouter(tags=["webhooks"])

_MOST = 10
_SHOWN = 20


class NewWebhook(Body):
    url: str = Field(max_length=500, pattern=r"^[\x21-\x7e]+$")


class Delivery(BaseModel):
    """A message; `waiting`: it was neither accepted nor given up; `next_at`: time of the next try;
    `delivered_at`: null until it is accepted."""

    id: UUID
    type: str
    created_at: datetime
    tries: int
    next_at: datetime
    error: str
    delivered_at: datetime | None
    waiting: bool


class WebhookOut(BaseModel):
    """A webhook; `waiting`: number of undelivered messages, `error`: why the last one failed;
    `last_delivered_at`: time of the last delivery; `deliveries`: the latest messages of the last
    days, delivered or not."""

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
    access.log_change(session, "webhook.create", subject=body.url)
    return MadeWebhook(id=row.id, secret=row.secret)


@router.delete("/gyms/{gym}/webhooks/{webhook}", status_code=204)
def drop_webhook(webhook: UUID, session: Db, access: OwnerMay) -> None:
    """Delete a webhook."""
    row = session.get(Webhook, webhook)
    if row is None or row.gym_id != access.gym.id:
        raise NotFoundError("not-there-webhook")
    session.delete(row)
    access.log_change(session, "webhook.delete", subject=row.url)


@router.post("/gyms/{gym}/webhooks/{webhook}/deliveries/{delivery}/replay", status_code=204)
def replay_delivery(webhook: UUID, delivery: UUID, services: ServicesOf, access: OwnerMay) -> None:
    """Send a message again, with the id that it had."""
    with services.database.writing() as session:
        count_replay(session, access.gym.id)
    with services.database.writing() as session:
        row = session.get(Webhook, webhook)
        # Locked: of two requests at once one sends it.
        event = session.get(WebhookEvent, delivery, with_for_update=True)
        if row is None or row.gym_id != access.gym.id:
            raise NotFoundError("not-there-webhook")
        if event is None or event.webhook_id != row.id:
            raise NotFoundError("not-there-delivery")
        replay(session, access.gym.id, event)
        person, gym = access.actor.known, access.gym.id
        log_change(session, "webhook.replay", person=person, gym=gym, subject=row.url)


def _webhook_out(session: Session, row: Webhook) -> WebhookOut:
    mine = select(WebhookEvent).where(WebhookEvent.webhook_id == row.id)
    latest = mine.order_by(WebhookEvent.created_at.desc()).limit(_SHOWN)
    undelivered = WebhookEvent.webhook_id == row.id, WebhookEvent.delivered_at.is_(None)
    waits = WebhookEvent.tries < DELIVERY.max_tries
    waiting = select(func.count()).select_from(WebhookEvent).where(*undelivered, waits)
    failed = select(WebhookEvent.error).where(*undelivered, WebhookEvent.error != "")
    return WebhookOut(
        id=row.id,
        url=row.url,
        created_at=row.created_at,
        error=session.scalar(failed.order_by(WebhookEvent.created_at.desc()).limit(1)) or "",
        waiting=session.scalar(waiting) or 0,
        last_delivered_at=row.last_delivered_at,
        deliveries=[
            Delivery(
                id=event.id,
                type=str(event.body.get("type", "")),
                tries=event.tries,
                created_at=event.created_at,
                next_at=event.next_at,
                error=event.error,
                delivered_at=event.delivered_at,
                waiting=is_waiting(event),
            )
            for event in session.scalars(latest)
        ],
    )


ROUTERS: Final[tuple[APIRouter, ...]] = (router,)
