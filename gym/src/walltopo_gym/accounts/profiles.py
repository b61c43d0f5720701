"""What somebody lets others know of them, item by item; nothing until they say so."""

from __future__ import annotations

from enum import StrEnum
from uuid import UUID

from sqlalchemy.orm import Session

from walltopo_gym.accounts.models import Profile


class Audience(StrEnum):
    """Who sees an item, in rising order; `GYM`: who belongs to a gym that one belongs to."""

    NOBODY = "nobody"
    FOLLOWERS = "followers"
    GYM = "gym"


class Category(StrEnum):
    """What boards may be divided by, beside the year of birth."""

    UNSAID = ""
    WOMEN = "women"
    MEN = "men"
    OTHER = "other"


def profile_of(session: Session, person: UUID) -> Profile:
    """What a person has said; where they have not, the silent one, which is in no session."""
    kept = session.get(Profile, person)
    if kept is not None:
        return kept
    return Profile(
        person_id=person, on_boards=False, category=Category.UNSAID, show_ascents=Audience.NOBODY,
        show_pins=Audience.NOBODY, show_body=Audience.NOBODY, feed=True,
        on_screens=False,
    )  # fmt: skip
