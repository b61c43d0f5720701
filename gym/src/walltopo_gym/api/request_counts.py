"""The counts of requests, shared by servers with one database.

Each server counts in memory and, every two seconds, adds the counts of busy networks to the
database's and reads those of the others. So two servers admit what one admits, and what arrives at
another one within two seconds.
"""

from __future__ import annotations

import asyncio
import hashlib
import logging
from collections import Counter
from collections.abc import Mapping
from contextlib import asynccontextmanager
from datetime import timedelta
from threading import Lock
from typing import TYPE_CHECKING, Final

from anyio import to_thread
from limits.storage import MemoryStorage
from sqlalchemy import delete, select
from sqlalchemy.exc import SQLAlchemyError

from walltopo_gym.clock import now
from walltopo_gym.database.engine import Database
from walltopo_gym.storage.models import RequestCount

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

_LOG = logging.getLogger("walltopo_gym.server")
_EVERY_S: Final = 2.0
# The present window of a minute, the one before, and clocks that differ.
_KEPT: Final = timedelta(minutes=3)
# Networks with less than this share of the limit are not worth a row.
_BUSY_SHARE: Final = 0.1


class SharedCounts(MemoryStorage):
    """Counts of requests by window, to which those of other servers are added.

    Parameters
    ----------
    database : what servers share; SQLite's is one server's, and nothing is exchanged.
    most : limit of requests within a window.
    """

    def __init__(self, database: Database, most: int) -> None:
        super().__init__()
        self._database, self._busy = database, max(1, round(most * _BUSY_SHARE))
        self._lock = Lock()
        self._new: Counter[str] = Counter()
        self._own: Counter[str] = Counter()
        self._others: Counter[str] = Counter()
        self._lives: dict[str, float] = {}

    def incr(self, key: str, expiry: float, amount: int = 1) -> int:
        """Count requests of this server; return the number at all servers, as far as known."""
        if not self._database.is_sqlite:
            with self._lock:
                self._new[key] += amount
                self._lives[key] = expiry
        return super().incr(key, expiry, amount)

    def exchange(self) -> None:
        """Add the new counts of busy networks to the database, and those of others to these.

        Counts of which it is not known whether they arrived are not sent again.

        Raises
        ------
        SQLAlchemyError : the database is away.
        """
        with self._lock:
            new, lives = dict(self._new), dict(self._lives)
        # Outside of the lock, for which requests wait.
        counts = {key: self.get(key) for key in lives}
        watched = {_hash(key): key for key, count in counts.items() if count >= self._busy}
        sent = {key: new[key] for key in watched.values() if new.get(key)}
        try:
            totals = self._add({_hash(key): n for key, n in sent.items()}, list(watched))
        finally:
            with self._lock:
                self._new.subtract(sent)
                self._own.update(sent)
                self._forget([key for key, count in counts.items() if count == 0])
        with self._lock:
            for hashed, total in totals.items():
                key = watched[hashed]
                more = total - self._own[key] - self._others[key]
                if more > 0:
                    self._others[key] += more
                    super().incr(key, lives[key], more)

    def _add(self, new: Mapping[str, int], watched: list[str]) -> dict[str, int]:
        """Add counts by hash; return the totals of the watched hashes."""
        if not watched:
            return {}
        with self._database.writing() as session:
            for key, n in sorted(new.items()):
                row = self._database.insert(RequestCount).values(key=key, count=n, at=now())
                session.execute(
                    row.on_conflict_do_update(
                        index_elements=[RequestCount.key],
                        set_={"count": RequestCount.count + n},
                    )
                )
            session.execute(delete(RequestCount).where(RequestCount.at < now() - _KEPT))
            found = select(RequestCount.key, RequestCount.count)
            return dict(session.execute(found.where(RequestCount.key.in_(watched))).all())

    def _forget(self, ended: list[str]) -> None:
        for key in ended:
            for counts in (self._new, self._own, self._others, self._lives):
                counts.pop(key, None)

    @asynccontextmanager
    async def exchanging(self) -> AsyncIterator[None]:
        """Exchange counts during the block."""
        if self._database.is_sqlite:
            yield
            return
        task = asyncio.create_task(self._exchange_for_ever())
        try:
            yield
        finally:
            task.cancel()

    async def _exchange_for_ever(self) -> None:
        while True:
            await asyncio.sleep(_EVERY_S)
            try:
                await to_thread.run_sync(self.exchange)
            except SQLAlchemyError as error:
                _LOG.warning("the counts of requests were not exchanged: %s", error)


def _hash(key: str) -> str:
    return hashlib.sha256(key.encode()).hexdigest()
