"""Trigger of planned publications. A zone's plan waits for all of its walls, so changes of zones
trigger it, too."""

from __future__ import annotations

from datetime import datetime
from typing import Final
from uuid import UUID

from sqlalchemy.orm import Session

from walltopo_gym.clock import now
from walltopo_gym.jobs.queue import Job, enqueue

PUBLICATIONS: Final = Job("publications", of_one_gym=1)


def queue_publications(session: Session, gym: UUID, at: datetime | None = None) -> None:
    """Queue a check of a gym's planned publications.

    Parameters
    ----------
    at : time of the check; None: as soon as this is committed.
    """
    moment = now()
    enqueue(session, PUBLICATIONS, str(gym), gym=gym, delay=(at or moment) - moment)
