"""Opening a gym; its grade systems."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence
from typing import Final
from uuid import UUID
from zoneinfo import ZoneInfo, available_timezones

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.audit import log_change
from walltopo_gym.errors import ConflictError, RequestError
from walltopo_gym.gyms.models import GradeSystem, Gym, Membership
from walltopo_gym.gyms.roles import Role

FONT: Final = (
    "3", "4", "4+", "5", "5+", "6A", "6A+", "6B", "6B+", "6C", "6C+", "7A", "7A+", "7B", "7B+",
    "7C", "7C+", "8A", "8A+", "8B", "8B+", "8C", "8C+", "9A",
)  # fmt: skip

V_SCALE: Final = ("VB", *(f"V{number}" for number in range(18)))

KINDS: Final = ("font", "v", "circuits", "own")

_SCALES: Final = {"font": FONT, "v": V_SCALE}


def check_grades(
    kind: str, labels: Sequence[str], ranges: Sequence[tuple[str | None, str | None]]
) -> None:
    """Refuse invalid lists of grades.

    Parameters
    ----------
    labels : from the easiest to the hardest; ranges : lowest and highest grade of each, both of one
        common scale, or None.

    Raises
    ------
    RequestError : names the grade, and what is allowed.
    """
    if not labels:
        raise RequestError("grades-none")
    twice = sorted({label for label in labels if labels.count(label) > 1})
    if twice:
        raise RequestError("grades-twice", grade=twice[0])
    if kind in _SCALES:
        _check_order(kind, labels)
    for label, ends in zip(labels, ranges, strict=True):
        _check_range(label, *ends)


def _check_order(kind: str, labels: Sequence[str]) -> None:
    scale = _SCALES[kind]
    unknown = [label for label in labels if label not in scale]
    if unknown:
        raise RequestError("grades-unknown", grade=unknown[0], kind=kind, scale=", ".join(scale))
    if sorted(labels, key=scale.index) != list(labels):
        raise RequestError("grades-order")


def _check_range(label: str, low: str | None, high: str | None) -> None:
    if low is None and high is None:
        return
    scale = next((s for s in _SCALES.values() if low in s and high in s), None)
    if scale is None or low is None or high is None:
        raise RequestError("grades-range", label=label, low=low, high=high)
    if scale.index(low) > scale.index(high):
        raise RequestError("grades-range-order", label=label, low=low, high=high)


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
    if name not in available_timezones():
        raise RequestError("zone-unknown", "zone-such-as", name=name)
    return ZoneInfo(name)


def open_gym(session: Session, owner: UUID, name: str, slug: str = "", **facts: str) -> Gym:
    """Create a gym with its owner and Font grades.

    Parameters
    ----------
    facts : place, time_zone, visibility, joining.

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
