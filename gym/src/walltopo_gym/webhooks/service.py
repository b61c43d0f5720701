"""Queue messages about events, in the transactions in which they happen."""

from __future__ import annotations

import base64
import hashlib
import hmac
import json
import secrets
from collections.abc import Mapping
from datetime import UTC, datetime, timedelta
from typing import Any, Final, Literal
from uuid import UUID, uuid4, uuid5

from sqlalchemy import delete, exists, or_, select, update
from sqlalchemy.orm import Session

from walltopo_gym.climbing.models import Ascent
from walltopo_gym.climbing.tallies import tallies
from walltopo_gym.clock import now
from walltopo_gym.database.engine import Database, Listeners
from walltopo_gym.errors import ConflictError
from walltopo_gym.events import (
    AscentsChanged,
    CompetitionBegins,
    CompetitionMoved,
    HoldReported,
    RouteRestored,
    RoutesAdded,
    RouteStripped,
    RowsExpired,
    ScanFinished,
    WallPublished,
)
from walltopo_gym.jobs.queue import Job, enqueue
from walltopo_gym.outgoing import post
from walltopo_gym.publishing.models import Route
from walltopo_gym.webhooks.models import Webhook, WebhookEvent

Kind = Literal[
    "wall.published",
    "routes.added",
    "route.stripped",
    "route.restored",
    "hold.reported",
    "scan.finished",
    "scan.failed",
    "ascents.counted",
    "competition.begins",
    "competition.published",
    "competition.started",
    "competition.ended",
]
_MOVED: Final[Mapping[str, Kind]] = {
    "open": "competition.published",
    "running": "competition.started",
    "ended": "competition.ended",
}
# Kept this long, so that the reason can be read.
_GIVEN_UP: Final = timedelta(days=30)
# Kept this long, so that it can be sent again.
_DELIVERED: Final = timedelta(days=7)
_PREFIX: Final = "whsec_"
# About a day in all, then it is given up.
DELIVERY: Final = Job("webhooks", waits=(10, 60, 300, 1800, 7200, 21600, 43200))
# The ascents of a gym's routes are counted once in so many seconds: one message stands for all
# ticks of a busy evening. In a quiet hall its counts are those of one climber.
_COUNTED_EVERY_S: Final = 600
_SLACK_S: Final = 30  # for transactions that are open when it ends
COUNTS: Final = Job("webhook-counts", at_once=1, of_one_gym=1)


def queue_webhook_message(
    session: Session, gym: UUID, kind: Kind, *, once: str = "", **facts: object
) -> None:
    """Queue a message to the gym's webhooks.

    Parameters
    ----------
    once : name of the occasion, whose second message is dropped; empty: each is another one.
    facts : ids of the changed objects, or counts; the API has the rest.
    """
    body = {"type": kind, "timestamp": now().isoformat(), "data": facts}
    for webhook in session.scalars(select(Webhook.id).where(Webhook.gym_id == gym)).all():
        key = uuid5(webhook, f"{kind} {once}") if once else uuid4()
        if once and session.get(WebhookEvent, key) is not None:
            continue
        session.add(WebhookEvent(id=key, webhook_id=webhook, body=body))
        enqueue(session, DELIVERY, str(key), gym=gym)


def note_delivery(session: Session, event: UUID, webhook: UUID) -> None:
    """Store that a message was accepted, and delete those that were accepted some days ago."""
    at = now()
    sent = update(WebhookEvent).where(WebhookEvent.id == event)
    session.execute(sent.values(delivered_at=at, error=""))
    session.execute(update(Webhook).where(Webhook.id == webhook).values(last_delivered_at=at))
    old = WebhookEvent.webhook_id == webhook, WebhookEvent.delivered_at < at - _DELIVERED
    session.execute(delete(WebhookEvent).where(*old))


def is_waiting(event: WebhookEvent) -> bool:
    """Return whether a message was neither accepted nor given up."""
    return event.delivered_at is None and event.tries < DELIVERY.max_tries


def replay(session: Session, gym: UUID, event: WebhookEvent) -> None:
    """Send a message again, with its id.

    Raises
    ------
    ConflictError : it is waiting.
    """
    if is_waiting(event):
        raise ConflictError("delivery-waits")
    event.tries, event.error, event.next_at, event.delivered_at = 0, "", now(), None
    enqueue(session, DELIVERY, str(event.id), gym=gym)


def _scan_finished(session: Session, event: ScanFinished) -> None:
    kind: Kind = "scan.failed" if event.failed else "scan.finished"
    queue_webhook_message(session, event.gym, kind, wall=str(event.wall), scan=str(event.scan))


def _competition_begins(session: Session, event: CompetitionBegins) -> None:
    name = str(event.competition)
    once = f"{name} {event.at.isoformat()}"
    queue_webhook_message(
        session,
        event.gym,
        "competition.begins",
        once=once,
        competition=name,
        at=event.at.isoformat(),
    )


def _competition_moved(session: Session, event: CompetitionMoved) -> None:
    kind = _MOVED[event.state]
    queue_webhook_message(session, event.gym, kind, competition=str(event.competition))


def _ascents_changed(session: Session, event: AscentsChanged) -> None:
    """Queue the counts of the gym's routes for the end of the present period."""
    if not session.scalar(select(exists().where(Webhook.gym_id == event.gym))):
        return
    period, into_s = divmod(int(now().timestamp()), _COUNTED_EVERY_S)
    wait = timedelta(seconds=_COUNTED_EVERY_S - into_s + _SLACK_S)
    key = f"{COUNTS.name}-{event.gym}-{period}"
    enqueue(session, COUNTS, str(event.gym), period, gym=event.gym, key=key, delay=wait)


def count_ascents(database: Database, gym: str, period: int) -> None:
    """Queue a message with the counts of the routes whose ascents changed since a period began.

    There is one in a period, and it names nobody.
    """
    since = datetime.fromtimestamp(period * _COUNTED_EVERY_S, UTC)
    moments = Ascent.created_at, Ascent.edited_at, Ascent.taken_back_at
    changed = or_(*(moment >= since for moment in moments))
    with database.writing() as session:
        climbed = select(Ascent.route_id).where(Ascent.gym_id == UUID(gym), changed)
        rows = session.execute(select(Route.id, Route.wall_id).where(Route.id.in_(climbed)))
        walls = dict(rows.tuples().all())
        counted = tallies(session, walls)
        routes = [
            {
                "wall": str(wall),
                "route": str(route),
                "ascents": counted[route].ascents,
                "climbers": counted[route].climbers,
            }
            for route, wall in walls.items()
        ]
        if routes:
            once = f"{gym} {period}"
            queue_webhook_message(session, UUID(gym), "ascents.counted", once=once, routes=routes)


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
    """Delete messages that were delivered, or that failed for good, some time ago."""
    late = now() - _GIVEN_UP
    given_up = WebhookEvent.next_at < late, WebhookEvent.tries >= DELIVERY.max_tries
    events = delete(WebhookEvent).where(*given_up)
    question.found.append(len(session.scalars(events.returning(WebhookEvent.id)).all()))
    sent = delete(WebhookEvent).where(WebhookEvent.delivered_at < now() - _DELIVERED)
    question.found.append(len(session.scalars(sent.returning(WebhookEvent.id)).all()))


LISTENERS: Final[Listeners] = {
    WallPublished: (_wall_published,),
    RoutesAdded: (_routes_added,),
    RouteStripped: (_route_stripped,),
    RouteRestored: (_route_restored,),
    HoldReported: (_hold_reported,),
    ScanFinished: (_scan_finished,),
    AscentsChanged: (_ascents_changed,),
    CompetitionBegins: (_competition_begins,),
    CompetitionMoved: (_competition_moved,),
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
