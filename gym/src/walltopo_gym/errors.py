"""Why the platform does not do what was asked; the API turns each into a status."""

from __future__ import annotations

from walltopo.core import WalltopoError


class NotFoundError(WalltopoError):
    """It is not there, or not for this person to know of."""


class ForbiddenError(WalltopoError):
    """It is there, and this person or token may not do that with it."""


class SignInNeededError(WalltopoError):
    """Nobody is signed in, and somebody must be."""


class ConflictError(WalltopoError):
    """It is in a state in which that cannot be done: somebody else came first, or it is in use."""


class TooManyError(WalltopoError):
    """Tried too often.

    Parameters
    ----------
    seconds : after how many it may be tried again.
    """

    def __init__(self, message: str, seconds: int) -> None:
        super().__init__(message, f"Try again in {max(1, seconds // 60)} min.")
        self.seconds = seconds
