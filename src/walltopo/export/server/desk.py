"""What the server asks of whoever keeps the scan that is edited."""

from __future__ import annotations

from typing import Protocol

import msgspec

from walltopo.core import InputError
from walltopo.scans.edits import EditLog, Place

__all__ = ["Crop", "EditDesk", "EditsChangedError", "State"]


class EditsChangedError(InputError):
    """The files are not those any more that the edits were made on."""


class State(msgspec.Struct, frozen=True):
    """How far what follows from the log is made.

    Parameters
    ----------
    stale : the scan's files do not show the log that is saved.
    running : they are being made.
    done_version : of the log that they show; empty where nobody knows.
    problem : why they could not be made; empty otherwise.
    """

    stale: bool
    running: bool
    done_version: str
    problem: str


class Crop(msgspec.Struct, frozen=True):
    """A place of the wall in a photo.

    Parameters
    ----------
    photo : its name.
    picture : as a `data:` address.
    x, y : the place, as shares of the picture's width and height.
    """

    photo: str
    picture: str
    x: float
    y: float


class EditDesk(Protocol):
    """Reads, tries and saves a log of edits; see `walltopo.desk`. Called from several threads."""

    def read(self) -> tuple[EditLog, str]:
        """The log and its version."""

    def tried(self, log: EditLog) -> msgspec.Struct:
        """What a log makes of the scan (`walltopo.edit.result.Result`); writes nothing."""

    def saved(self, log: EditLog, version: str) -> tuple[msgspec.Struct, str]:
        """Save a log made on a version; its result, and its own version.

        Raises EditsChangedError where the files have another version by now.
        """

    def state(self) -> State:
        """Whether the scan's files show what is saved."""

    def crops(self, at: Place) -> list[Crop]:
        """A place in the photos that show it best."""

    def close(self) -> None:
        """Wait until what was begun is written."""
