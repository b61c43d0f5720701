"""The set-up of an empty server by a backup: for those who read the server's log.

A server without any account shows a code in its log when it starts. Nobody else on the network can
restore into it. The code is void once there is an account.
"""

from __future__ import annotations

import hmac
from contextlib import suppress
from threading import Lock
from typing import Final

from sqlalchemy import exists, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.models import Person
from walltopo_gym.accounts.secrets import hash_of
from walltopo_gym.errors import RequestError
from walltopo_gym.settings import GymSettings

UPLOADED: Final = ".uploaded.tar"  # in the data folder; no backup at a target has such a name


class Setup:
    """The code of an empty server; `uploading` is held during an upload."""

    def __init__(self) -> None:
        self.uploading = Lock()
        self._hash = ""

    def open(self, code: str) -> None:
        """Let this code set up the server, instead of any earlier code."""
        self._hash = hash_of(code)

    def check(self, session: Session, code: str) -> None:
        """Check the code of a request.

        Raises
        ------
        RequestError : it is wrong, or the server has an account.
        """
        is_right = bool(self._hash) and hmac.compare_digest(hash_of(code), self._hash)
        if not is_right or not is_empty(session):
            raise RequestError("setup-code-wrong", "setup-code-where")


def is_empty(session: Session) -> bool:
    """Return whether a server has no account at all."""
    return not session.scalar(select(exists().where(Person.id.is_not(None))))


def drop_upload(settings: GymSettings) -> None:
    """Delete an uploaded backup."""
    with suppress(FileNotFoundError):
        (settings.data / UPLOADED).unlink()
