"""Errors of the database, the file store and the disk, in words: the same for API and commands."""

from __future__ import annotations

import errno
import sqlite3
from typing import Final

from obstore.exceptions import BaseError as StoreError
from sqlalchemy.exc import DBAPIError

from walltopo_gym.errors import RequestError, UnavailableError

_FULL: Final = ("disk is full", "no space left", "could not extend file", "disk quota exceeded")
_READ_ONLY: Final = ("readonly database", "read-only")
_DAMAGED: Final = ("malformed", "file is not a database", "invalid page in block")
_AWAY: Final = (
    "database is locked",
    "unable to open database file",
    "disk i/o error",
    "connection",
    "server closed",
    "starting up",
    "shutting down",
    "too many clients",
    "timeout",
)


def explain_error(error: BaseException) -> RequestError | None:
    """Return what an error means and what to do; None if it is none of these kinds.

    It is an `UnavailableError` where waiting does not help.
    """
    text = str(error).lower()
    if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT):
        return UnavailableError("disk-is-full", "disk-make-room-purge")
    if not isinstance(error, (DBAPIError, sqlite3.Error, StoreError)):
        return None
    if any(words in text for words in _FULL):
        return UnavailableError("disk-is-full", "disk-make-room-purge")
    if any(words in text for words in _READ_ONLY):
        return UnavailableError("database-read-only", "database-permissions")
    if isinstance(error, StoreError):
        return RequestError("store-away", "try-again-soon")
    if any(words in text for words in _DAMAGED):
        return UnavailableError("database-damaged", "database-restore")
    if any(words in text for words in _AWAY):
        return RequestError("database-away", "try-again-soon")
    return None
