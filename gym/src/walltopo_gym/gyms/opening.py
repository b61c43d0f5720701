"""Opening a gym, and what can be said of it."""

from __future__ import annotations

import re
import unicodedata
from uuid import UUID
from zoneinfo import ZoneInfo, available_timezones

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo.core import InputError
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.errors import ConflictError
from walltopo_gym.gyms.grades import FONT
from walltopo_gym.gyms.models import GradeSystem, Gym, Membership
from walltopo_gym.gyms.roles import Role


def slug_of(name: str) -> str:
    """A name as part of an address: "Boulderhalle Süd" is boulderhalle-sud.

    Raises
    ------
    InputError : nothing of it can be written so; another has to be given.
    """
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode().lower()
    slug = re.sub(r"[^a-z0-9]+", "-", plain).strip("-")[:60].strip("-")
    if not slug:
        raise InputError(f"{name!r} has no letter of a to z", "Give a slug for its address.")
    return slug


def check_time_zone(name: str) -> ZoneInfo:
    """A time zone by its name, such as Europe/Prague.

    Raises
    ------
    InputError : there is no such zone.
    """
    if name not in available_timezones():
        raise InputError(f"{name!r} is no time zone", "Such as Europe/Prague.")
    return ZoneInfo(name)


def open_gym(session: Session, owner: UUID, name: str, slug: str = "", **facts: str) -> Gym:
    """A new gym with its owner, and Font grades to begin with.

    Parameters
    ----------
    facts : place, time_zone, visibility, joining.

    Raises
    ------
    InputError : no such time zone; ConflictError : the slug is taken.
    """
    check_time_zone(facts.get("time_zone", "UTC"))
    slug = slug or slug_of(name)
    if session.scalar(select(Gym.id).where(Gym.slug == slug)) is not None:
        raise ConflictError(f"the address {slug!r} is taken", "Give another slug.")
    gym = Gym(slug=slug, name=name, **facts)
    session.add(gym)
    session.flush()
    session.add(Membership(gym_id=gym.id, person_id=owner, role=Role.OWNER))
    grades = [{"label": label} for label in FONT]
    session.add(GradeSystem(gym_id=gym.id, name="Font", kind="font", grades=grades))
    log_change(session, "gym.create", person=owner, gym=gym.id, subject=slug)
    return gym
