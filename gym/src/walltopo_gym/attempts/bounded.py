"""Each item of a background job fails by itself: it is tried again after a wait, and set aside with
its reason after the last try.

A try is counted before it begins, so that an item that kills its worker is set aside, too. A worker
that is killed loses its items after `lease`.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import timedelta
from typing import Any, Final
from uuid import UUID

from sqlalchemy import ColumnElement, and_, delete, func, or_, select, update
from sqlalchemy.orm import Session

from walltopo.core import WalltopoError
from walltopo_gym.attempts.models import JobAttempt
from walltopo_gym.clock import now
from walltopo_gym.database.engine import Database

_LOG = logging.getLogger("walltopo_gym.attempts")
# Seconds to the next try: about five hours in all, so that a store that is away may come back.
_WAITS: Final = (10, 60, 600, 3600, 14400)
MAX_TRIES: Final = len(_WAITS) + 1
_KILLED: Final = "the worker ended during the last try"
_DEFECT: Final = "a fault of the program; the operator's log says more"

SetAside = Callable[[Session, UUID, str], None]


def reason_of(error: BaseException) -> str:
    """Return what an operator reads of an error, in one line."""
    text = str(error).partition("\n")[0]
    if isinstance(error, WalltopoError):
        return text
    return f"{type(error).__name__}: {text}" if text else type(error).__name__


@dataclass(frozen=True)
class Attempts:
    """Counts the tries of one kind of background job.

    Parameters
    ----------
    set_aside : writes the reason into the item's own row after the last try, for the gym.
    lease : after so long another worker takes over what a killed one had.
    """

    database: Database
    kind: str
    set_aside: SetAside | None = None
    lease: timedelta = timedelta(hours=1)

    def row_of(self, item: Any, version: Any = "") -> ColumnElement[bool]:
        """Return the condition that joins an item with its attempts.

        Parameters
        ----------
        item, version : columns of the item's own table, or values.
        """
        return and_(
            JobAttempt.kind == self.kind, JobAttempt.item == item, JobAttempt.version == version
        )

    def is_due(self) -> ColumnElement[bool]:
        """Return the condition of an outer join by `row_of` under which an item may be tried."""
        return or_(JobAttempt.item.is_(None), JobAttempt.next_at <= now())

    def held(self, session: Session) -> int:
        """Return how many items are being tried, or wait in a queue for that."""
        rows = select(func.count()).where(
            JobAttempt.kind == self.kind, JobAttempt.holder != "", JobAttempt.next_at > now()
        )
        return session.scalar(rows) or 0

    def begin(self, session: Session, item: UUID, holder: str, version: str = "") -> int:
        """Count a try and return its number; 0 where the item must not be tried now."""
        key = (self.kind, item)
        row = session.get(JobAttempt, key, with_for_update=True)
        if row is None or row.version != version:
            row = session.merge(
                JobAttempt(kind=self.kind, item=item, version=version, tries=0, error="")
            )
        elif row.next_at is None or row.next_at > now():
            return 0
        if row.tries >= MAX_TRIES:
            self._give_up(session, row, row.error or _KILLED, _DEFECT)
            return 0
        row.tries, row.holder = row.tries + 1, holder
        row.begun_at, row.next_at = now(), now() + self.lease
        session.flush()
        return row.tries

    def end(self, session: Session, item: UUID, version: str | None = None) -> None:
        """Forget the tries of an item that is done; of one version of it, where that is given."""
        done = delete(JobAttempt).where(JobAttempt.kind == self.kind, JobAttempt.item == item)
        session.execute(done if version is None else done.where(JobAttempt.version == version))

    def fail(self, item: UUID, error: BaseException) -> None:
        """Keep why a try failed; the next one is after a wait, or the item is set aside."""
        is_known = isinstance(error, WalltopoError)
        trace = None if is_known else error
        _LOG.warning("%s %s: %s", self.kind, item, reason_of(error), exc_info=trace)
        shown = reason_of(error) if is_known else _DEFECT
        with self.database.writing() as session:
            row = session.get(JobAttempt, (self.kind, item), with_for_update=True)
            if row is None:
                return  # its item was deleted, or another worker has done it
            if row.tries >= MAX_TRIES:
                self._give_up(session, row, reason_of(error), shown)
                return
            wait = _WAITS[max(0, row.tries - 1)]
            row.holder, row.next_at = "", now() + timedelta(seconds=wait)
            row.error = reason_of(error)[:300]

    @contextmanager
    def trying(self, item: UUID) -> Iterator[None]:
        """Let a block fail for this item alone: what follows the block goes on."""
        try:
            yield
        except Exception as error:
            self.fail(item, error)

    def let_go(self, holder: str, *, counted: bool) -> None:
        """Let others try at once what a holder has begun and not ended.

        Parameters
        ----------
        counted : whether that was a try; False where the machine was at fault.
        """
        held = update(JobAttempt).where(JobAttempt.kind == self.kind, JobAttempt.holder == holder)
        tries = JobAttempt.tries - (0 if counted else 1)
        with self.database.writing() as session:
            session.execute(held.values(tries=tries, holder="", next_at=now()))

    def _give_up(self, session: Session, row: JobAttempt, error: str, shown: str) -> None:
        _LOG.error("%s %s: set aside after %s tries (%s)", self.kind, row.item, row.tries, error)
        row.holder, row.next_at, row.error = "", None, error[:300]
        if self.set_aside is not None:
            self.set_aside(session, row.item, shown)
