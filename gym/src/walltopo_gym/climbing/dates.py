"""Refuse ascents at a time at which nobody can have climbed the route.

An ascent may arrive days after it, from a phone without reception; only its own date counts. A
clock may be set to another time zone: a day of difference is allowed.
"""

from __future__ import annotations

from datetime import datetime, time, timedelta
from typing import Final
from zoneinfo import ZoneInfo

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from walltopo_gym.clock import now
from walltopo_gym.errors import RequestError
from walltopo_gym.gyms.models import Gym
from walltopo_gym.publishing.models import Placement, Route
from walltopo_gym.scans.models import Scan

_SLACK: Final = timedelta(days=1)


def begin_of(session: Session, gym: Gym, route: Route) -> datetime:
    """Return the earliest moment from which the gym knows a route.

    It is the first of the day on which it was set, its entry, and the scans that show it: a setter
    may have set it anew, and climbers tick it after its publication.
    """
    scans = (
        select(func.min(Scan.created_at))
        .join(Placement, Placement.scan_id == Scan.id)
        .where(Placement.route_id == route.id)
    )
    set_on = datetime.combine(route.set_on, time(), ZoneInfo(gym.time_zone))
    scanned: datetime | None = session.scalar(scans)
    return min(set_on, route.created_at, scanned or route.created_at)


def check_climbed(climbed_at: datetime, begin: datetime, zone: ZoneInfo) -> None:
    """Refuse an ascent of the future, or from before its route or problem.

    Raises
    ------
    RequestError : names both days, as in the gym's time zone.
    """
    day = climbed_at.astimezone(zone).date()
    if climbed_at > now() + _SLACK:
        raise RequestError("ascent-in-future", "ascent-check-clock", day=day)
    if climbed_at < begin - _SLACK:
        since = begin.astimezone(zone).date()
        raise RequestError("ascent-too-early", "ascent-check-day", day=day, since=since)
