"""What one lets others know of oneself, and what one sees of others."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from typing import Annotated
from uuid import UUID

from fastapi import APIRouter
from pydantic import BaseModel, Field
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.models import Profile
from walltopo_gym.accounts.profiles import Audience, Category, profile_of
from walltopo_gym.api.fields import Body
from walltopo_gym.api.rules import SignedInMay
from walltopo_gym.api.services import Db
from walltopo_gym.climbing.ascents import Kind
from walltopo_gym.climbing.models import Ascent
from walltopo_gym.climbing.people import MOST_PINS, see
from walltopo_gym.clock import now
from walltopo_gym.errors import ConflictError, NotFoundError
from walltopo_gym.gyms.models import Gym, Wall
from walltopo_gym.publishing.models import Route

router = APIRouter(tags=["profiles"])

Length = Annotated[int | None, Field(ge=50, le=280)]


class ProfileWords(Body):
    """What one lets others know; all of it, each time. `on_boards`: whether one is ranked at all;
    `on_screens`: whether everybody may see that, in the hall and on the gym's website.

    Body data is shown to whom `show_body` names, and used for nothing else.
    """

    on_boards: bool = False
    on_screens: bool = False
    category: Category = Category.UNSAID
    birth_year: int | None = Field(None, ge=1900, le=2100)
    show_ascents: Audience = Audience.NOBODY
    show_pins: Audience = Audience.NOBODY
    show_body: Audience = Audience.NOBODY
    height_cm: Length = None
    reach_cm: Length = None


class GymName(BaseModel):
    """A gym that both belong to."""

    slug: str
    name: str


class BodyFacts(BaseModel):
    """How tall somebody is and how far they reach, fingertip to fingertip, in centimetres."""

    height_cm: int | None
    reach_cm: int | None


class SeenAscent(BaseModel):
    """An ascent without its private note, and the address of the wall that it was climbed on."""

    id: UUID
    route_id: UUID | None
    gym_name: str
    route_name: str
    grade: str
    kind: Kind
    tries: int
    climbed_at: datetime
    gym_slug: str | None = None
    wall_id: UUID | None = None


class PersonFacts(BaseModel):
    """Somebody as the asker may see them; what is not shown is null, not empty."""

    id: UUID
    name: str
    since: datetime
    gyms: list[GymName]
    ascents: list[SeenAscent] | None
    pins: list[SeenAscent] | None
    body: BodyFacts | None


@router.get("/me/profile")
def read_profile(session: Db, actor: SignedInMay) -> ProfileWords:
    """What one lets others know."""
    return ProfileWords.model_validate(profile_of(session, actor.known), from_attributes=True)


@router.put("/me/profile")
def put_profile(body: ProfileWords, session: Db, actor: SignedInMay) -> ProfileWords:
    """Say what others may know."""
    session.merge(Profile(person_id=actor.known, changed_at=now(), **body.model_dump()))
    log_change(session, "person.profile", person=actor.known)
    return body


@router.get("/people/{person}")
def read_person(person: UUID, session: Db, actor: SignedInMay) -> PersonFacts:
    """Somebody who belongs to a gym that one belongs to; to others they are not there."""
    seen = see(session, actor.known, person)
    shown = seen.body
    body = None if shown is None else BodyFacts.model_validate(shown, from_attributes=True)
    return PersonFacts(
        id=seen.person.id, name=seen.person.name, since=seen.person.created_at,
        gyms=[GymName.model_validate(gym, from_attributes=True) for gym in seen.gyms],
        ascents=_told(session, seen.ascents), pins=_told(session, seen.pins), body=body,
    )  # fmt: skip


@router.put("/me/pins/{ascent}", status_code=204)
def pin_ascent(ascent: UUID, session: Db, actor: SignedInMay) -> None:
    """Let an ascent of one's own stand on one's profile; again, too."""
    row = _own(session, actor.known, ascent)
    count = select(func.count()).where(
        Ascent.person_id == actor.known, Ascent.pinned_at.is_not(None)
    )
    if row.pinned_at is None and (session.scalar(count) or 0) >= MOST_PINS:
        raise ConflictError(f"at most {MOST_PINS} ascents are pinned", "Take another one off.")
    row.pinned_at = row.pinned_at or now()


@router.delete("/me/pins/{ascent}", status_code=204)
def unpin_ascent(ascent: UUID, session: Db, actor: SignedInMay) -> None:
    """Take an ascent off one's profile; again, too."""
    _own(session, actor.known, ascent).pinned_at = None


def _own(session: Session, person: UUID, ascent: UUID) -> Ascent:
    row = session.get(Ascent, ascent)
    if row is None or row.person_id != person or row.taken_back_at is not None:
        raise NotFoundError("no such ascent")
    return row


def _told(session: Session, rows: Sequence[Ascent] | None) -> list[SeenAscent] | None:
    if rows is None:
        return None
    walls = (
        select(Route.id, Wall.id, Gym.slug)
        .join(Wall, Wall.id == Route.wall_id)
        .join(Gym, Gym.id == Wall.gym_id)
        .where(Route.id.in_({row.route_id for row in rows}))
    )
    places = {route: (wall, slug) for route, wall, slug in session.execute(walls)}
    told = []
    for row in rows:
        facts = SeenAscent.model_validate(row, from_attributes=True)
        if facts.route_id in places:
            facts.wall_id, facts.gym_slug = places[facts.route_id]
        told.append(facts)
    return told
