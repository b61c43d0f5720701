"""What somebody wants to be told of, and the hours in which they want none of it."""

from __future__ import annotations

from datetime import datetime, time, timedelta
from typing import Final
from uuid import UUID
from zoneinfo import ZoneInfo

from sqlalchemy.orm import Session

from walltopo_gym.hall.models import Wishes

_HOURS: Final = 24


def wishes_of(session: Session, person: UUID) -> Wishes:
    """What a person has said; where they have not, nothing, which is in no session."""
    kept = session.get(Wishes, person)
    if kept is not None:
        return kept
    return Wishes(person_id=person, language="en", digest=False, fresh=False, soon=False,
                  competitions=False, quiet_from=22, quiet_to=8)  # fmt: skip


def awake_at(wishes: Wishes, at: datetime, zone: ZoneInfo) -> datetime:
    """The first moment from `at` on in which they may be disturbed."""
    length = (wishes.quiet_to - wishes.quiet_from) % _HOURS
    local = at.astimezone(zone)
    for back in (1, 0):  # a night that began yesterday, or today
        day = local.date() - timedelta(days=back)
        begins = datetime.combine(day, time(wishes.quiet_from), zone)
        end_day = day + timedelta(days=wishes.quiet_from + length >= _HOURS)
        ends = datetime.combine(end_day, time(wishes.quiet_to), zone)
        if length and begins <= local < ends:
            return ends.astimezone(at.tzinfo)
    return at
