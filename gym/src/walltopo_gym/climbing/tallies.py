"""What climbers did on the routes of a wall and think of them, counted; nobody is named."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from uuid import UUID

from sqlalchemy import Select, func, select
from sqlalchemy.orm import Session

from walltopo_gym.climbing.models import Ascent, Opinion
from walltopo_gym.publishing.models import Placement, Route

__all__ = ["Tally", "tallies"]


@dataclass
class Tally:
    """Of one route.

    Parameters
    ----------
    ascents : kind to number; climbers : who topped or flashed it, each once.
    stars : mean, None where nobody gave any; grades : label to votes; wishes : wish to number.
    """

    ascents: dict[str, int] = field(default_factory=dict)
    climbers: int = 0
    stars: float | None = None
    grades: dict[str, int] = field(default_factory=dict)
    wishes: dict[str, int] = field(default_factory=dict)


def tallies(session: Session, scan: UUID | None) -> dict[UUID, Tally]:
    """Of all routes that hang in a version of a wall, by route."""
    placed = select(Placement.route_id).join(Route, Route.id == Placement.route_id)
    hanging = placed.where(Placement.scan_id == scan, Route.stripped_at.is_(None))
    told = {route: Tally() for route in session.scalars(hanging)}
    _count_ascents(session, hanging, told)
    _count_opinions(session, hanging, told)
    return told


def _count_ascents(session: Session, hanging: Select[UUID], told: Mapping[UUID, Tally]) -> None:
    route = Ascent.route_id
    counted = select(route, Ascent.kind, func.count()).where(
        route.in_(hanging), Ascent.taken_back_at.is_(None)
    )
    for key, kind, number in session.execute(counted.group_by(route, Ascent.kind)):
        if key is not None:
            told[key].ascents[kind] = number
    topped = select(route, func.count(Ascent.person_id.distinct())).where(
        route.in_(hanging), Ascent.taken_back_at.is_(None), Ascent.kind.in_(("flash", "top"))
    )
    for key, number in session.execute(topped.group_by(route)):
        if key is not None:
            told[key].climbers = number


def _count_opinions(session: Session, hanging: Select[UUID], told: Mapping[UUID, Tally]) -> None:
    route = Opinion.route_id
    stars = select(route, func.avg(Opinion.stars)).where(route.in_(hanging))
    for key, mean in session.execute(stars.group_by(route)):
        told[key].stars = None if mean is None else round(float(mean), 2)
    for column, name in ((Opinion.grade, "grades"), (Opinion.wish, "wishes")):
        votes = select(route, column, func.count()).where(route.in_(hanging), column != "")
        for key, vote, number in session.execute(votes.group_by(route, column)):
            getattr(told[key], name)[vote] = number
