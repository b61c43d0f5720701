"""Nothing slow happens while a write transaction is open.

On SQLite a write transaction holds the one write lock of all gyms; on PostgreSQL it holds the locks
of its rows. Work that computes long, uses the store of files or calls another machine begins with
`check_unlocked`.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar

_LOG = logging.getLogger("walltopo_gym.database")

# The open write transactions of a request, whose parts run in several threads, or of a thread.
_OPEN: ContextVar[list[None] | None] = ContextVar("open write transactions", default=None)


@contextmanager
def lock_scope() -> Iterator[None]:
    """Watch the write transactions of the block, in whichever threads its parts run."""
    token = _OPEN.set([])
    try:
        yield
    finally:
        with suppress(ValueError):  # a generator that another thread ends
            _OPEN.reset(token)


@contextmanager
def write_open() -> Iterator[None]:
    """Mark a write transaction as open during the block."""
    found = _OPEN.get()
    if found is None:
        with lock_scope(), write_open():
            yield
        return
    found.append(None)
    try:
        yield
    finally:
        found.pop()


def check_unlocked(work: str) -> None:
    """Report slow work that begins while a write transaction is open.

    Parameters
    ----------
    work : what begins, such as "reading a file".
    """
    if _OPEN.get():
        log_slow_work(work)


def log_slow_work(work: str) -> None:
    """Log slow work under a lock as a defect; the tests fail instead."""
    _LOG.error("%s while a write transaction is open", work, stack_info=True)
