"""Errors of the platform; the API turns each into a status."""

from __future__ import annotations

import re
from typing import ClassVar

from walltopo.core import WalltopoError
from walltopo_gym.messages import english

# The folders of a path from the root: no share ("m/s"), no address ("https://host/").
_FOLDERS = re.compile(r"(?<![\w.:/])/(?:[^\s/:'\"]+/)+")


def without_folders(text: str) -> str:
    """Return a text whose paths are reduced to file names, so that the server's folders stay
    private."""
    return _FOLDERS.sub("", text)


class RequestError(WalltopoError):
    """The request is invalid.

    Parameters
    ----------
    key : of the sentence in the language files that says what happened.
    hint : key of the sentence that says what to do; empty: there is none.
    values : placeholders of both sentences; `count` selects their plural forms.
    """

    status: ClassVar[int] = 422
    exit_code = 3

    def __init__(self, key: str, hint: str = "", /, **values: object) -> None:
        super().__init__(english(key, values), english(hint, values) if hint else "")
        self.key, self.hint_key, self.values = key, hint, values


class ContentError(RequestError):
    """A file's content is not what its sender announced."""


class NotFoundError(RequestError):
    """The object does not exist, or the person may not know of it."""

    status = 404


class ForbiddenError(RequestError):
    """The object exists, but the person or token may not do this with it."""

    status = 403


class SignInNeededError(RequestError):
    """The request needs a signed-in person."""

    status = 401


class ConflictError(RequestError):
    """The object's state does not allow this: another request came first, or it is in use."""

    status = 409


class TooLargeError(RequestError):
    """The content is larger than the server accepts."""

    status = 413


class UnavailableError(RequestError):
    """The server lacks something: disk space, another server's response."""

    status = 507
    exit_code = 5


class TooManyError(RequestError):
    """There were too many attempts.

    Parameters
    ----------
    seconds : when to try again.
    """

    status = 429

    def __init__(self, key: str, seconds: int) -> None:
        super().__init__(key, "try-again-in", count=max(1, seconds // 60))
        self.seconds = seconds
