"""What the server asks of whoever keeps the scan that is edited."""

from __future__ import annotations

from typing import Protocol

import msgspec

from walltopo.core import BusyError, EnvironmentLacksError, InputError
from walltopo.scans.edits import EditLog, Place
from walltopo.setting.ease import Way
from walltopo.setting.rows import Proposals, Tweaks
from walltopo.setting.wish import Wish

__all__ = ["Crop", "EditDesk", "EditsChangedError", "State", "problem_key"]


class EditsChangedError(InputError):
    """The files are not those any more that the edits were made on."""


class State(msgspec.Struct, frozen=True):
    """How far what follows from the log is made.

    Parameters
    ----------
    stale : the scan's files do not show the log that is saved.
    running : they are being made.
    done_version : of the log that they show; empty where nobody knows.
    problem : why they could not be made, in English; empty otherwise.
    key : of what a page says of it in its own language, see `problem_key`; empty where it has none.
    """

    stale: bool
    running: bool
    done_version: str
    problem: str
    key: str = ""


def problem_key(error: Exception) -> str:
    """What kind of problem it is that a setter meets, for a page to say it in its own language."""
    if isinstance(error, EditsChangedError):
        return "changed"
    if isinstance(error, BusyError):
        return "busy"
    return "lacks" if isinstance(error, EnvironmentLacksError) else ""


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

    def proposed(self, log: EditLog, wish: Wish) -> Proposals:
        """Problems for the wall as a log makes it; takes seconds, writes nothing."""

    def eased(self, log: EditLog, route: int, way: Way) -> Tweaks:
        """What makes a route one grade easier or harder; writes nothing."""

    def state(self) -> State:
        """Whether the scan's files show what is saved."""

    def crops(self, at: Place) -> list[Crop]:
        """A place in the photos that show it best."""

    def close(self) -> None:
        """Wait until what was begun is written."""
