"""Why a clip cannot be read: a word for programs, and a sentence for people."""

from __future__ import annotations

from typing import Literal

from walltopo.core import InputError

ClipFault = Literal["no-video", "too-long", "too-short", "other-wall", "unsteady", "no-climber"]


class ClipError(InputError):
    """The clip cannot be read.

    Parameters
    ----------
    fault : the reason; the message says it in words.
    """

    def __init__(self, fault: ClipFault, message: str, hint: str = "") -> None:
        super().__init__(message, hint)
        self.fault = fault

    def prefixed(self, where: object) -> ClipError:
        """Return this error with `where` before its message."""
        return ClipError(self.fault, f"{where}: {self.message}", self.hint)
