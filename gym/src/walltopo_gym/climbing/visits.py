"""Group ascents into sessions, by their times alone (pure functions).

A gym's day begins at four in the morning by its own clock, so that an evening past midnight is one
day. Within a day, a pause of four hours or a manual start begins another session; a manual end
closes it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from datetime import date, datetime, timedelta
from enum import IntEnum
from typing import Final
from uuid import UUID
from zoneinfo import ZoneInfo

from walltopo_gym.gyms.days import gym_day

PAUSE: Final = timedelta(hours=4)


class Sort(IntEnum):
    """Kinds of events, in their order within one moment."""

    START = 0
    ASCENT = 1
    END = 2


@dataclass(frozen=True, order=True)
class Event:
    """An ascent or a manual mark."""

    at: datetime
    sort: Sort
    id: UUID


@dataclass
class Visit:
    """One session.

    Parameters
    ----------
    day : of the gym; began_at, ended_at : of its first and last event; ascents : their ids.
    closed : ended by hand.
    """

    day: date
    began_at: datetime
    ended_at: datetime
    ascents: list[UUID] = field(default_factory=list)
    closed: bool = False


def visits(events: Iterable[Event], zone: ZoneInfo) -> list[Visit]:
    """Return the sessions of one person in one gym, in order of time."""
    found: list[Visit] = []
    for event in sorted(events):
        day = gym_day(event.at, zone)
        last = found[-1] if found else None
        goes_on = (
            last is not None
            and not last.closed
            and last.day == day
            and event.at - last.ended_at < PAUSE
        )
        if event.sort == Sort.END:
            if last is not None and goes_on:
                last.ended_at, last.closed = event.at, True
            continue
        # A start after a start is the same one.
        is_start = event.sort == Sort.START and last is not None and bool(last.ascents)
        if last is None or not goes_on or is_start:
            last = Visit(day, event.at, event.at)
            found.append(last)
        last.ended_at = event.at
        if event.sort == Sort.ASCENT:
            last.ascents.append(event.id)
    return found
