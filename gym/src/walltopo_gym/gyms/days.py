"""Days of a gym: they begin at four in the morning by its own clock, so that an evening past
midnight is one day."""

from __future__ import annotations

from datetime import UTC, date, datetime, time, timedelta
from typing import Final
from zoneinfo import ZoneInfo

from walltopo_gym.clock import now
from walltopo_gym.gyms.models import Gym

_DAWN: Final = time(4)


def zone_of(gym: Gym) -> ZoneInfo:
    """Return the gym's time zone."""
    return ZoneInfo(gym.time_zone)


def today(gym: Gym) -> date:
    """Return the gym's day."""
    return gym_day(now(), zone_of(gym))


def gym_day(at: datetime, zone: ZoneInfo) -> date:
    """Return the gym's day of a moment."""
    local = at.astimezone(zone)
    return local.date() - timedelta(days=1) if local.time() < _DAWN else local.date()


def day_begins(day: date, zone: ZoneInfo) -> datetime:
    """Return the first moment of a gym's day."""
    return datetime.combine(day, _DAWN, zone).astimezone(UTC)
