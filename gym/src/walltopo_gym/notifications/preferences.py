"""Message preferences and quiet hours."""

from __future__ import annotations

from datetime import datetime, time, timedelta
from typing import Final
from uuid import UUID
from zoneinfo import ZoneInfo

from sqlalchemy.orm import Session

from walltopo_gym.notifications.models import NotificationPreferences

_HOURS: Final = 24


def preferences_of(session: Session, person: UUID) -> NotificationPreferences:
    """Return a person's message preferences; default ones outside of the session if there are
    none."""
    kept = session.get(NotificationPreferences, person)
    if kept is not None:
        return kept
    return NotificationPreferences(
        person_id=person,
        language="en",
        digest=False,
        digest_by="mail",
        new_routes=False,
        soon=False,
        competitions=False,
        hold_reports=False,
        forerun=False,
        inspections=False,
        quiet_from=22,
        quiet_to=8,
    )


def awake_at(preferences: NotificationPreferences, at: datetime, zone: ZoneInfo) -> datetime:
    """Return the first moment from `at` on that is not in the person's quiet hours."""
    length = (preferences.quiet_to - preferences.quiet_from) % _HOURS
    local = at.astimezone(zone)
    for back in (1, 0):  # a night that began yesterday, or today
        day = local.date() - timedelta(days=back)
        begins = datetime.combine(day, time(preferences.quiet_from), zone)
        end_day = day + timedelta(days=preferences.quiet_from + length >= _HOURS)
        ends = datetime.combine(end_day, time(preferences.quiet_to), zone)
        if length and begins <= local < ends:
            return ends.astimezone(at.tzinfo)
    return at
