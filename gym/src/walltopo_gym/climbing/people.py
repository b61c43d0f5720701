"""A climber as others may see them: what is shown to whom is the climber's own word."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.models import Person, Profile
from walltopo_gym.accounts.profiles import Audience, profile_of
from walltopo_gym.climbing.follows import gyms_in_common, is_let
from walltopo_gym.climbing.models import Ascent, Opinion
from walltopo_gym.errors import NotFoundError
from walltopo_gym.gyms.models import Gym, Membership, Wall
from walltopo_gym.publishing.models import Route

MOST_PINS = 12
_LATEST = 20


@dataclass(frozen=True)
class Seen:
    """What one person sees of another; what is not shown to them is None.

    Parameters
    ----------
    gyms : that both belong to; ascents : the latest, the last climbed first.
    """

    person: Person
    gyms: Sequence[Gym]
    ascents: Sequence[Ascent] | None
    pins: Sequence[Ascent] | None
    body: Profile | None


def see(session: Session, viewer: UUID, person: UUID) -> Seen:
    """Somebody as another sees them.

    Raises
    ------
    NotFoundError : they have no gym in common, so that no list of people can be tried out.
    """
    row = session.get(Person, person)
    gyms = gyms_in_common(session, viewer, person)
    if row is None or (viewer != person and not gyms):
        raise NotFoundError("no such person")
    profile = profile_of(session, person)

    def shown(audience: str) -> bool:
        return may_see(session, viewer, person, audience)

    climbed = select(Ascent).where(Ascent.person_id == person, Ascent.taken_back_at.is_(None))
    if viewer != person:  # of a gym that the viewer does not belong to nothing is told
        climbed = climbed.where(Ascent.gym_id.in_([gym.id for gym in gyms]))
    latest = climbed.order_by(Ascent.climbed_at.desc(), Ascent.id)
    pinned = latest.where(Ascent.pinned_at.is_not(None))
    return Seen(
        person=row,
        gyms=gyms,
        ascents=session.scalars(latest.limit(_LATEST)).all() if shown(profile.show_ascents)
        else None,
        pins=session.scalars(pinned).all() if shown(profile.show_pins) else None,
        body=profile if shown(profile.show_body) else None,
    )  # fmt: skip


def may_see(session: Session, viewer: UUID, person: UUID, audience: str) -> bool:
    """Whether an item of a person that is shown to `audience` is shown to this viewer."""
    if viewer == person:
        return True
    if audience == Audience.NOBODY or not gyms_in_common(session, viewer, person):
        return False
    return audience == Audience.GYM or is_let(session, viewer, person)


def took_part(session: Session, gym: UUID, person: UUID) -> bool:
    """Whether somebody belongs to a gym, climbed there, or said what they think of its routes."""
    here = select(Route.id).join(Wall, Wall.id == Route.wall_id).where(Wall.gym_id == gym)
    traces = (
        select(Membership.gym_id).where(Membership.gym_id == gym, Membership.person_id == person),
        select(Ascent.id).where(Ascent.gym_id == gym, Ascent.person_id == person),
        select(Opinion.route_id).where(Opinion.person_id == person, Opinion.route_id.in_(here)),
    )
    return any(session.scalar(trace.limit(1)) is not None for trace in traces)
