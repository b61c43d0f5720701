"""A worker's signs of life, for operators.

They say when a worker was last there. Whether its jobs go on elsewhere is decided by its lock alone
(`worker_slot.py`).
"""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence
from datetime import timedelta
from importlib.metadata import version
from typing import Final

from sqlalchemy import delete, select
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session

from walltopo_gym.clock import now
from walltopo_gym.database.engine import Database
from walltopo_gym.jobs.models import Worker

_LOG = logging.getLogger("walltopo_gym.jobs")
_EVERY_S: Final = 15.0
_LATE: Final = timedelta(seconds=60)
_KEPT: Final = timedelta(days=30)
_MAX: Final = 200


class Heartbeat:
    """Writes one worker's signs of life.

    Parameters
    ----------
    name : of the worker.
    """

    def __init__(self, database: Database, name: str) -> None:
        self._database = database
        self._name = name
        self._began = now()
        self._next = time.monotonic()

    def beat(self) -> None:
        """Write a sign of life, unless the last one is younger than some seconds."""
        if time.monotonic() < self._next:
            return
        row = {"version": version("walltopo-gym"), "started_at": self._began, "seen_at": now()}
        first = self._database.insert(Worker).values(name=self._name, **row)
        again = first.on_conflict_do_update(index_elements=[Worker.name], set_=row)
        with self._database.writing() as session:
            session.execute(again)
            session.execute(delete(Worker).where(Worker.seen_at < now() - _KEPT))
        self._next = time.monotonic() + _EVERY_S

    def end(self) -> None:
        """Delete the row; it stays if the database is away."""
        try:
            with self._database.writing() as session:
                session.execute(delete(Worker).where(Worker.name == self._name))
        except SQLAlchemyError as error:
            _LOG.warning("worker %s ends while the database is away: %s", self._name, error)


def list_workers(session: Session) -> Sequence[Worker]:
    """Return the workers of the last 30 days, the latest sign of life first."""
    return session.scalars(select(Worker).order_by(Worker.seen_at.desc()).limit(_MAX)).all()


def is_alive(worker: Worker) -> bool:
    """Return whether a worker gave a sign of life within the last minute."""
    return worker.seen_at > now() - _LATE
