"""What is to be told is tried until it is taken: at once, then after longer and longer waits.

The table says what is to be told and when next; each single try is a workflow of DBOS, so that a
slow address holds up no worker, and a try that a killed worker had begun is made again (the message
keeps its id: who gets it twice can tell).
"""

from __future__ import annotations

import logging
import time
from datetime import timedelta
from typing import Final
from uuid import UUID

from dbos import DBOS, SetWorkflowID
from sqlalchemy import func, select, update

from walltopo.core import InputError
from walltopo_gym.attempts.turns import fair_share
from walltopo_gym.clock import now
from walltopo_gym.database.engine import Database
from walltopo_gym.settings import GymSettings
from walltopo_gym.webhooks.models import Webhook, WebhookEvent
from walltopo_gym.webhooks.sending import send

_LOG = logging.getLogger("walltopo_gym.webhooks")
QUEUE: Final = "webhooks"
# Seconds to the next try: about a day in all, then it is given up.
_WAITS: Final = (10, 60, 300, 1800, 7200, 21600, 43200)
LAST_TRY: Final = len(_WAITS) + 1
# A try that was handed to the queue and never came to an end is made again after that.
_LEASE: Final = timedelta(minutes=15)
_EACH: Final = 2  # of one gym at a time: slow hosts hold up no other gym

_delivery: Delivery | None = None


class Delivery:
    """Hands due messages to DBOS, and sees to each try.

    Parameters
    ----------
    settings : whether private addresses will do.
    """

    def __init__(self, settings: GymSettings, database: Database) -> None:
        global _delivery
        self._settings, self._database = settings, database
        _delivery = self

    def begin_due(self) -> None:
        """Hand a try of each message that is due to DBOS."""
        for event, number in self.claim():
            with SetWorkflowID(f"webhook-{event}-{number}"):
                DBOS.enqueue_workflow(QUEUE, _deliver, str(event))

    def claim(self) -> list[tuple[UUID, int]]:
        """Begin a try of each message that is due; its next one is set before it begins.

        After the last try the message stays with its reason and is tried no more.
        """
        busy = (
            select(Webhook.gym_id)
            .join(WebhookEvent, WebhookEvent.webhook_id == Webhook.id)
            .where(WebhookEvent.begun_at.is_not(None), WebhookEvent.next_at > now())
        )
        turn = func.row_number().over(
            partition_by=Webhook.gym_id, order_by=(WebhookEvent.next_at, WebhookEvent.id)
        )
        is_due = WebhookEvent.next_at <= now(), WebhookEvent.tries < LAST_TRY
        due = (
            select(WebhookEvent.id, Webhook.gym_id)
            .join(Webhook, Webhook.id == WebhookEvent.webhook_id)
            .where(*is_due)
            .order_by(turn, WebhookEvent.next_at)
        )
        with self._database.writing() as session:
            chosen = fair_share(session.execute(due.limit(500)).all(), session.scalars(busy), _EACH)
            # Asked again with the lock: another worker may have begun some meanwhile.
            mine = select(WebhookEvent).where(WebhookEvent.id.in_(chosen), *is_due)
            rows = session.scalars(mine.with_for_update(skip_locked=True)).all()
            for event in rows:
                event.tries, event.begun_at = event.tries + 1, now()
                event.next_at = now() + _LEASE
            return [(event.id, event.tries) for event in rows]

    def try_once(self, event: UUID) -> None:
        """Send a message; it is gone when it was taken."""
        with self._database.reading() as session:
            row = session.get(WebhookEvent, event)
            webhook = None if row is None else session.get(Webhook, row.webhook_id)
        if row is None or webhook is None:
            return
        private = self._settings.webhooks_to_private
        error = ""
        try:
            send(webhook.url, webhook.secret, event, int(time.time()), row.body, private=private)
        except (OSError, InputError) as why:
            error = str(why) or type(why).__name__
        except Exception as why:  # an address or a secret that nothing can be sent with
            _LOG.exception("webhook %s", webhook.id)
            error = f"nothing can be sent there ({type(why).__name__})"
        with self._database.writing() as session:
            kept = session.get(WebhookEvent, event)
            if kept is not None and error:
                kept.begun_at = None
                kept.error = error[:300]
                is_last = kept.tries >= LAST_TRY
                wait = 0 if is_last else _WAITS[max(0, kept.tries - 1)]
                kept.next_at = now() + timedelta(seconds=wait)
                if is_last:
                    _LOG.warning("webhook %s: given up (%s)", webhook.id, error)
            elif kept is not None:
                session.delete(kept)
                session.execute(
                    update(Webhook).where(Webhook.id == webhook.id).values(told_at=now())
                )


@DBOS.workflow(name="webhook", max_recovery_attempts=len(_WAITS))
def _deliver(event: str) -> None:
    DBOS.run_step({"name": "send"}, _try_once, event)


def _try_once(event: str) -> None:
    assert _delivery is not None, "the worker has not begun"
    _delivery.try_once(UUID(event))
