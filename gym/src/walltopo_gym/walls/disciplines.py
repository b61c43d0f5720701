"""Disciplines of climbing: without a rope, and with each kind of belay."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from typing import Final


class Discipline(StrEnum):
    """How a route is climbed."""

    BOULDER = "boulder"
    LEAD = "lead"
    TOP_ROPE = "top-rope"
    AUTO_BELAY = "auto-belay"


ROPED: Final = (Discipline.LEAD, Discipline.TOP_ROPE, Discipline.AUTO_BELAY)

# Boards and progress that count each discipline; an auto-belay is a rope from above.
_COUNTED_AS: Final = {Discipline.AUTO_BELAY: Discipline.TOP_ROPE}


def disciplines_on(belays: Sequence[str] | None) -> list[Discipline]:
    """Return the disciplines of a route, the usual one first.

    Parameters
    ----------
    belays : of its line; None without one.
    """
    return [Discipline(belay) for belay in belays or ()] or [Discipline.BOULDER]


def counted_as(discipline: str) -> Discipline:
    """Return the discipline whose boards and progress count a climb of a discipline."""
    known = Discipline(discipline)
    return _COUNTED_AS.get(known, known)


def counted_disciplines(belays: Sequence[str]) -> list[Discipline]:
    """Return the disciplines with boards of their own in a gym, boulders first.

    Parameters
    ----------
    belays : of all lines of the gym, in any order.
    """
    found = {counted_as(belay) for belay in belays}
    return [one for one in Discipline if one == Discipline.BOULDER or one in found]
