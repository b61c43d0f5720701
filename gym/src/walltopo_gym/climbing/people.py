"""A climber's public profile. Each climber decides who sees what."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.models import Person, Profile
from walltopo_gym.accounts.people import Audience, profile_of
from walltopo_gym.climbing.follows import gyms_in_common, is_let
from walltopo_gym.climbing.models import Ascent, Opinion
from walltopo_gym.errors import NotFoundError
from walltopo_gym.events import TookPart
from walltopo_gym.gyms.models import Gym, Membership
from walltopo_gym.publishing.models import Route
from walltopo_gym.walls.models import Wall

MAX_PINS = 12
_LATEST = 20


@dataclass(frozen=True)
class VisibleProfile:
    """A person as another sees them; hidden fields are None.

    Parameters
    ----------
    gyms : gyms of both; ascents : the latest, the last climbed first.
    """

    person: Person
    gyms: Sequence[Gym]
    ascents: Sequence[Ascent] | None
    pins: Sequence[Ascent] | None
    body: Profile | None


def view_person(session: Session, viewer: UUID, person: UUID) -> VisibleProfile:
    """Return a person as another sees them.

    Raises
    ------
    NotFoundError : they have no gym in common, so that people cannot be enumerated.
    """
    row = session.get(Person, person)
    gyms = gyms_in_common(session, viewer, person)
    if row is None or (viewer != person and not gyms):
        raise NotFoundError("not-there-person")
    profile = profile_of(session, person)

    def shown(audience: str) -> bool:
        return may_see(session, viewer, person, audience)

    climbed = select(Ascent).where(Ascent.person_id == person, Ascent.taken_back_at.is_(None))
    if viewer != person:  # gyms that the viewer does not belong to are left out
        climbed = climbed.where(Ascent.gym_id.in_([gym.id for gym in gyms]))
    latest = climbed.order_by(Ascent.climbed_at.desc(), Ascent.id)
    pinned = latest.where(Ascent.pinned_at.is_not(None))
    return VisibleProfile(
        person=row,
        gyms=gyms,
        ascents=session.scalars(latest.limit(_LATEST)).all()
        if shown(profile.show_ascents)
        else None,
        pins=session.scalars(pinned).all() if shown(profile.show_pins) else None,
        body=profile if shown(profile.show_body) else None,
    )


def may_see(session: Session, viewer: UUID, person: UUID, audience: str) -> bool:
    """Return whether this viewer belongs to the `audience` of a person's item."""
    if viewer == person:
        return True
    if audience == Audience.NOBODY or not gyms_in_common(session, viewer, person):
        return False
    return audience == Audience.GYM or is_let(session, viewer, person)


def took_part(session: Session, question: TookPart) -> None:
    """Answer whether a person belongs to a gym, climbed there, or rated its routes."""
    gym, person = question.gym, question.person
    here = select(Route.id).join(Wall, Wall.id == Route.wall_id).where(Wall.gym_id == gym)
    traces = (
        select(Membership.gym_id).where(Membership.gym_id == gym, Membership.person_id == person),
        select(Ascent.id).where(Ascent.gym_id == gym, Ascent.person_id == person),
        select(Opinion.route_id).where(Opinion.person_id == person, Opinion.route_id.in_(here)),
    )
    question.found.append(any(session.scalar(trace.limit(1)) is not None for trace in traces))
