"""Deliver webhooks: at once, then with growing delays.

A try that a killed worker had begun is repeated; the message keeps its id, so receivers can drop
duplicates.
"""

from __future__ import annotations

import logging
import time
from dataclasses import dataclass
from uuid import UUID

from sqlalchemy.orm import Session

from walltopo.core import WalltopoError
from walltopo_gym.clock import now
from walltopo_gym.database.engine import Database
from walltopo_gym.errors import RequestError
from walltopo_gym.jobs.queue import Failure
from walltopo_gym.settings import GymSettings
from walltopo_gym.webhooks.models import Webhook, WebhookEvent
from walltopo_gym.webhooks.service import note_delivery, send

_LOG = logging.getLogger("walltopo_gym.webhooks")


@dataclass(frozen=True)
class Delivery:
    """Sends single messages.

    Parameters
    ----------
    settings : whether private addresses are allowed.
    """

    settings: GymSettings
    database: Database

    def deliver(self, event: str) -> None:
        """Send a message until it is accepted once.

        Raises
        ------
        WalltopoError : it was not accepted.
        """
        with self.database.reading() as session:
            row = session.get(WebhookEvent, UUID(event))
            webhook = None if row is None else session.get(Webhook, row.webhook_id)
        if row is None or webhook is None or row.delivered_at is not None:
            return
        private = self.settings.webhooks_to_private
        try:
            send(webhook.url, webhook.secret, row.id, int(time.time()), row.body, private=private)
        except RequestError:
            raise
        except OSError as why:
            raise WalltopoError(str(why) or type(why).__name__) from why
        except Exception as why:  # an address or a secret that nothing can be sent with
            _LOG.exception("webhook %s", webhook.id)
            raise WalltopoError(f"nothing can be sent there ({type(why).__name__})") from why
        with self.database.writing() as session:
            note_delivery(session, row.id, webhook.id)


def record_failure(session: Session, failure: Failure, event: str) -> None:
    """Store for the gym why a message was refused, and when it is sent again."""
    row = session.get(WebhookEvent, UUID(event))
    if row is not None:
        row.tries, row.error = failure.tries, failure.shown[:300]
        row.next_at = failure.again_at or now()
