"""What one did on the routes that hang in a gym, and thinks of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.climbing.models import Ascent, Opinion
from walltopo_gym.gyms.models import Wall
from walltopo_gym.publishing.models import Route


@dataclass(frozen=True)
class Logbook:
    """One person's, of one gym; ascents from the last climbed to the first."""

    ascents: Sequence[Ascent]
    opinions: Sequence[Opinion]


def logbook(session: Session, gym: UUID, person: UUID) -> Logbook:
    """Read it."""
    hanging = (
        select(Route.id)
        .join(Wall, Wall.id == Route.wall_id)
        .where(Wall.gym_id == gym, Route.stripped_at.is_(None))
    )
    ascents = (
        select(Ascent)
        .where(
            Ascent.person_id == person, Ascent.taken_back_at.is_(None), Ascent.route_id.in_(hanging)
        )
        .order_by(Ascent.climbed_at.desc(), Ascent.id)
    )
    opinions = select(Opinion).where(Opinion.person_id == person, Opinion.route_id.in_(hanging))
    return Logbook(session.scalars(ascents).all(), session.scalars(opinions).all())
