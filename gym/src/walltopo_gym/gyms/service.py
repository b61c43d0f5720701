"""Opening a gym; its grade systems."""

from __future__ import annotations

import re
import unicodedata
from functools import cache
from uuid import UUID
from zoneinfo import ZoneInfo, available_timezones

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_climb.grades.font import FONT
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.errors import ConflictError, RequestError
from walltopo_gym.gyms.models import GradeSystem, Gym, Membership
from walltopo_gym.gyms.roles import Role


def slug_of(name: str) -> str:
    """Return a name as part of an address: "Boulderhalle Süd" is boulderhalle-sud.

    Raises
    ------
    RequestError : no character of the name can be used.
    """
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode().lower()
    slug = re.sub(r"[^a-z0-9]+", "-", plain).strip("-")[:60].strip("-")
    if not slug:
        raise RequestError("slug-none", "slug-give", name=name)
    return slug


def check_time_zone(name: str) -> ZoneInfo:
    """Check the name of a time zone, such as Europe/Prague.

    Raises
    ------
    RequestError : there is no such zone.
    """
    if name not in _time_zones():
        raise RequestError("zone-unknown", "zone-such-as", name=name)
    return ZoneInfo(name)


@cache
def _time_zones() -> frozenset[str]:
    """Return the names of all time zones; finding them walks through hundreds of files."""
    return frozenset(available_timezones())


def open_gym(session: Session, owner: UUID, name: str, slug: str = "", **facts: str) -> Gym:
    """Create a gym with its owner and Font grades.

    Parameters
    ----------
    facts : place, time_zone, visibility, joining, units, paper.

    Raises
    ------
    RequestError : no such time zone; ConflictError : the slug is taken.
    """
    check_time_zone(facts.get("time_zone", "UTC"))
    slug = slug or slug_of(name)
    if session.scalar(select(Gym.id).where(Gym.slug == slug)) is not None:
        raise ConflictError("address-taken", "slug-other", address=slug)
    gym = Gym(slug=slug, name=name, **facts)
    session.add(gym)
    session.flush()
    session.add(Membership(gym_id=gym.id, person_id=owner, role=Role.OWNER))
    grades = [{"label": label} for label in FONT]
    session.add(GradeSystem(gym_id=gym.id, name="Font", kind="font", grades=grades))
    log_change(session, "gym.create", person=owner, gym=gym.id, subject=slug)
    return gym
