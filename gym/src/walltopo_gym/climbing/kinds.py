"""Results of an ascent, and those that each discipline has."""

from __future__ import annotations

from enum import StrEnum
from typing import Final

from walltopo_gym.walls.disciplines import Discipline


class Kind(StrEnum):
    """Results of an ascent; a top on lead after earlier tries is a redpoint."""

    ONSIGHT = "onsight"
    FLASH = "flash"
    TOP = "top"
    REPEAT = "repeat"
    HANG = "hang"
    HIGH_POINT = "high-point"
    ZONE = "zone"
    TRY = "try"
    PROJECT = "project"


FIRST_TRIES: Final = (Kind.ONSIGHT, Kind.FLASH)
TOPS: Final = (*FIRST_TRIES, Kind.TOP, Kind.REPEAT)

_OF_BOULDERS: Final = (Kind.FLASH, Kind.TOP, Kind.ZONE, Kind.TRY, Kind.PROJECT)
# To the top with rests on the rope is "hang"; a fall below it is "high-point", by the clip.
_ON_ROPES: Final = (*TOPS, Kind.HANG, Kind.HIGH_POINT, Kind.TRY, Kind.PROJECT)


def kinds_of(discipline: Discipline) -> tuple[Kind, ...]:
    """Return the results that ascents of a discipline can have, the best first."""
    return _OF_BOULDERS if discipline == Discipline.BOULDER else _ON_ROPES
