"""A person's ascents and opinions on a gym's current routes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.climbing.models import Ascent, Opinion
from walltopo_gym.publishing.models import Route
from walltopo_gym.walls.models import Wall


@dataclass(frozen=True)
class Logbook:
    """A person's logbook in one gym; ascents from the latest to the first."""

    ascents: Sequence[Ascent]
    opinions: Sequence[Opinion]


def logbook(session: Session, gym: UUID, person: UUID) -> Logbook:
    """Return a person's logbook."""
    current = (
        select(Route.id)
        .join(Wall, Wall.id == Route.wall_id)
        .where(Wall.gym_id == gym, Route.stripped_at.is_(None))
    )
    ascents = (
        select(Ascent)
        .where(
            Ascent.person_id == person, Ascent.taken_back_at.is_(None), Ascent.route_id.in_(current)
        )
        .order_by(Ascent.climbed_at.desc(), Ascent.id)
    )
    opinions = select(Opinion).where(Opinion.person_id == person, Opinion.route_id.in_(current))
    return Logbook(session.scalars(ascents).all(), session.scalars(opinions).all())
