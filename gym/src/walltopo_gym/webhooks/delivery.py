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
from sqlalchemy import select, update

from walltopo.core import InputError
from walltopo_gym.clock import now
from walltopo_gym.database.engine import Database
from walltopo_gym.settings import GymSettings
from walltopo_gym.webhooks.models import Webhook, WebhookEvent
from walltopo_gym.webhooks.sending import send

__all__ = ["QUEUE", "Delivery"]

_LOG = logging.getLogger("walltopo_gym.webhooks")
QUEUE: Final = "webhooks"
# Seconds to the next try: about a day in all, then it is given up.
_WAITS: Final = (10, 60, 300, 1800, 7200, 21600, 43200)

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
        """Begin a try of each message that is due; its next one is set before it begins."""
        due = select(WebhookEvent).where(WebhookEvent.next_at <= now()).limit(100)
        begun = []
        with self._database.writing() as session:
            for event in session.scalars(due.with_for_update(skip_locked=True)):
                if event.tries > len(_WAITS):
                    _LOG.warning("webhook %s: given up (%s)", event.webhook_id, event.error)
                    session.delete(event)
                    continue
                wait = _WAITS[min(event.tries, len(_WAITS) - 1)]
                event.tries, event.next_at = event.tries + 1, now() + timedelta(seconds=wait)
                begun.append((event.id, event.tries))
        for event_id, number in begun:
            with SetWorkflowID(f"webhook-{event_id}-{number}"):
                DBOS.enqueue_workflow(QUEUE, _deliver, str(event_id))

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
        with self._database.writing() as session:
            kept = session.get(WebhookEvent, event)
            if kept is not None and error:
                kept.error = error[:300]
            elif kept is not None:
                session.delete(kept)
                session.execute(
                    update(Webhook).where(Webhook.id == webhook.id).values(told_at=now())
                )


@DBOS.workflow(name="webhook")
def _deliver(event: str) -> None:
    DBOS.run_step({"name": "send"}, _try_once, event)


def _try_once(event: str) -> None:
    assert _delivery is not None, "the worker has not begun"
    _delivery.try_once(UUID(event))
