"""Queue messages about events, in the transactions in which they happen."""

from __future__ import annotations

import base64
import hashlib
import hmac
import json
import secrets
from datetime import timedelta
from typing import Any, Final, Literal
from uuid import UUID, uuid4

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from walltopo_gym.clock import now
from walltopo_gym.database.engine import Listeners
from walltopo_gym.events import (
    HoldReported,
    RouteRestored,
    RoutesAdded,
    RouteStripped,
    RowsExpired,
    WallPublished,
)
from walltopo_gym.jobs.queue import Job, enqueue
from walltopo_gym.outgoing import post
from walltopo_gym.webhooks.models import Webhook, WebhookEvent

Kind = Literal[
    "wall.published", "routes.added", "route.stripped", "route.restored", "hold.reported"
]
# About a day in all, then it is given up.
# Kept this long, so that the reason can be read.
_GIVEN_UP: Final = timedelta(days=30)
_PREFIX: Final = "whsec_"
DELIVERY: Final = Job("webhooks", waits=(10, 60, 300, 1800, 7200, 21600, 43200))


def queue_webhook_message(session: Session, gym: UUID, kind: Kind, **facts: str) -> None:
    """Queue a message to the gym's webhooks.

    Parameters
    ----------
    facts : ids of the changed objects; the API has the rest.
    """
    body = {"type": kind, "timestamp": now().isoformat(), "data": facts}
    for webhook in session.scalars(select(Webhook.id).where(Webhook.gym_id == gym)).all():
        event = WebhookEvent(id=uuid4(), webhook_id=webhook, body=body)
        session.add(event)
        enqueue(session, DELIVERY, str(event.id), gym=gym)


def _wall_published(session: Session, event: WallPublished) -> None:
    queue_webhook_message(
        session, event.gym, "wall.published", wall=str(event.wall), scan=str(event.scan)
    )


def _routes_added(session: Session, event: RoutesAdded) -> None:
    queue_webhook_message(session, event.gym, "routes.added", wall=str(event.wall))


def _route_stripped(session: Session, event: RouteStripped) -> None:
    queue_webhook_message(
        session, event.gym, "route.stripped", wall=str(event.wall), route=str(event.route)
    )


def _route_restored(session: Session, event: RouteRestored) -> None:
    queue_webhook_message(
        session, event.gym, "route.restored", wall=str(event.wall), route=str(event.route)
    )


def _hold_reported(session: Session, event: HoldReported) -> None:
    queue_webhook_message(
        session, event.gym, "hold.reported", wall=str(event.wall), report=str(event.report)
    )


def drop_given_up(session: Session, question: RowsExpired) -> None:
    """Delete deliveries that failed for good some time ago."""
    late = now() - _GIVEN_UP
    given_up = WebhookEvent.next_at < late, WebhookEvent.tries >= DELIVERY.max_tries
    events = delete(WebhookEvent).where(*given_up)
    question.found.append(len(session.scalars(events.returning(WebhookEvent.id)).all()))


LISTENERS: Final[Listeners] = {
    WallPublished: (_wall_published,),
    RoutesAdded: (_routes_added,),
    RouteStripped: (_route_stripped,),
    RouteRestored: (_route_restored,),
    HoldReported: (_hold_reported,),
}


def new_signing_secret() -> str:
    """Return a new secret in the standard's format."""
    return _PREFIX + base64.b64encode(secrets.token_bytes(32)).decode()


def signature(secret: str, message: UUID, at: int, body: bytes) -> str:
    """Return the header `webhook-signature`."""
    key = base64.b64decode(secret.removeprefix(_PREFIX))
    signed = b".".join([str(message).encode(), str(at).encode(), body])
    return "v1," + base64.b64encode(hmac.digest(key, signed, hashlib.sha256)).decode()


def send(
    url: str, secret: str, message: UUID, at: int, body: dict[str, Any], *, private: bool
) -> None:
    """Send one message; a 2xx status accepts it.

    Raises
    ------
    RequestError : the address is invalid or lies in a private network; OSError : it was refused.
    """
    content = json.dumps(body).encode()
    headers = {
        "content-type": "application/json",
        "webhook-id": str(message),
        "webhook-timestamp": str(at),
        "webhook-signature": signature(secret, message, at, content),
    }
    status = post(url, content, headers, private=private)
    if not 200 <= status < 300:
        raise OSError(f"answered {status}")
