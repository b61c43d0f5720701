"""Store planned resets, and find their routes and the state that the wall's publication gives them.

A wall has one open plan. Its routes are those of the wall that were set on the plan's day or later:
added by hand, or published by a scan. Routes of a scan in review do not count yet: their numbers
change with each edit, and only the publication makes routes of them. To have them forerun before,
the review adds them by hand, and the publication places them.

The publication of a scan that was begun on the plan's day or later makes the plan "published";
amendments do not. On a wall without scans the setters choose that state themselves.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import date, datetime, time
from enum import StrEnum
from typing import Final
from uuid import UUID
from zoneinfo import ZoneInfo

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from walltopo_gym.clock import now
from walltopo_gym.errors import ConflictError, NotFoundError, RequestError
from walltopo_gym.events import RoutesToForerun, publish_event
from walltopo_gym.gyms.members import role_of
from walltopo_gym.gyms.models import Gym
from walltopo_gym.gyms.roles import Role
from walltopo_gym.publishing.models import Route
from walltopo_gym.publishing.service import grade_of
from walltopo_gym.reset_plans.models import ResetPerson, ResetPlan
from walltopo_gym.scans.models import Scan
from walltopo_gym.scans.service import State
from walltopo_gym.walls.models import Wall

_PUBLISHED_SHOWN: Final = 50


class ResetState(StrEnum):
    """States of a plan, in the order of a reset."""

    PLANNED = "planned"
    SET = "set"
    FORERUN = "forerun"
    PUBLISHED = "published"


class Part(StrEnum):
    """The task of a person in a plan."""

    SETTER = "setter"
    FORERUNNER = "forerunner"


# The least role of a person whom a plan names.
_LEAST: Final = {Part.SETTER: Role.SETTER, Part.FORERUNNER: Role.MEMBER}


@dataclass(frozen=True)
class Wish:
    """The number of routes of a grade that a reset should set."""

    system: UUID
    grade: str
    routes: int


@dataclass(frozen=True)
class PlanDraft:
    """A plan as the setters write it."""

    day: date
    note: str
    wishes: Sequence[Wish]
    people: Mapping[Part, frozenset[UUID]]


@dataclass(frozen=True)
class Planned:
    """A plan with its wall.

    Parameters
    ----------
    published_at : when the wall was published, None while the plan is open.
    until : the last day on which a route of this plan was set; None: it is open.
    """

    plan: ResetPlan
    wall: Wall
    published_at: datetime | None
    until: date | None

    @property
    def state(self) -> ResetState:
        """Return the state, of which a publication decides the last one."""
        return (
            ResetState.PUBLISHED if self.published_at is not None else ResetState(self.plan.state)
        )


def store_plan(
    session: Session, gym: Gym, wall: Wall, plan: UUID, words: PlanDraft
) -> tuple[ResetPlan, bool]:
    """Store a plan, or change it; return it and whether it is new.

    Raises
    ------
    ConflictError : the id belongs to a plan of another wall, or the wall has another open plan.
    RequestError : a grade is not the gym's or comes twice, or a person lacks the role.
    """
    # The lock lets the second of two setters see the plan of the first.
    session.refresh(wall, with_for_update=True)
    row = session.get(ResetPlan, plan)
    if row is not None and row.wall_id != wall.id:
        raise ConflictError("id-taken", "id-another")
    wishes = [
        {
            "system": str(wish.system),
            "routes": wish.routes,
            "grade": grade_of(session, gym.id, wish.system, wish.grade),
        }
        for wish in words.wishes
    ]
    if len({(wish["system"], wish["grade"]) for wish in wishes}) < len(wishes):
        raise RequestError("reset-wish-twice")
    is_new = row is None
    if row is None:
        if any(one.published_at is None for one in plans_of(session, gym, wall=wall.id)):
            raise ConflictError("reset-open", "reset-open-first")
        row = ResetPlan(id=plan, wall_id=wall.id, state=ResetState.PLANNED)
        session.add(row)
    row.day, row.note = words.day, words.note
    row.wishes = wishes
    session.flush()
    _name_people(session, gym.id, row, words.people)
    session.flush()
    if plan_of(session, gym, row.id).state == ResetState.SET:
        _tell_forerunners(session, gym.id, row)
    return row, is_new


def _name_people(
    session: Session, gym: UUID, plan: ResetPlan, people: Mapping[Part, frozenset[UUID]]
) -> None:
    """Replace the people whom a plan names. Those whom it names already may have lost their role.

    Raises
    ------
    RequestError : a person lacks the role.
    """
    before = {(row.person_id, row.part) for row in people_of(session, [plan.id])}
    for part, named in people.items():
        for person in named:
            is_known = (person, part) in before
            if not is_known and not role_of(session, gym, person).covers(_LEAST[part]):
                raise RequestError("reset-person")
    session.execute(delete(ResetPerson).where(ResetPerson.plan_id == plan.id))
    session.add_all(
        ResetPerson(plan_id=plan.id, person_id=person, part=part)
        for part, named in people.items()
        for person in named
    )
    session.flush()


def people_of(session: Session, plans: Iterable[UUID]) -> Sequence[ResetPerson]:
    """Return the people whom plans name."""
    return session.scalars(select(ResetPerson).where(ResetPerson.plan_id.in_(list(plans)))).all()


def choose_state(session: Session, gym: UUID, planned: Planned, state: ResetState) -> None:
    """Set the state of a plan.

    Raises
    ------
    ConflictError : a scan of the wall was published, which decides the state.
    """
    plan = planned.plan
    if planned.published_at is not None and plan.published_at is None:
        raise ConflictError("reset-published")
    if state != ResetState.PUBLISHED:
        plan.published_at = None
    elif plan.published_at is None:
        plan.published_at = now()
    plan.state = state
    if state == ResetState.SET:
        _tell_forerunners(session, gym, plan)


def _tell_forerunners(session: Session, gym: UUID, plan: ResetPlan) -> None:
    """Tell that the routes of a plan are set."""
    named = people_of(session, [plan.id])
    forerunners = frozenset(row.person_id for row in named if row.part == Part.FORERUNNER)
    publish_event(session, RoutesToForerun(gym, plan.wall_id, plan.id, plan.day, forerunners))


def plans_of(session: Session, gym: Gym, *, wall: UUID | None = None) -> list[Planned]:
    """Return a gym's plans: open ones by day, then the latest published ones.

    Parameters
    ----------
    wall : of this wall alone.
    """
    query = select(ResetPlan, Wall).join(Wall, Wall.id == ResetPlan.wall_id)
    query = query.where(Wall.gym_id == gym.id)
    if wall is not None:
        query = query.where(Wall.id == wall)
    rows = session.execute(query.order_by(ResetPlan.day, ResetPlan.id)).all()
    published = _publications_by_wall(session, {row.wall_id for row, _ in rows})
    zone = ZoneInfo(gym.time_zone)
    known = [_planned(row, of, published.get(of.id, []), zone) for row, of in rows]
    done = [one for one in known if one.published_at is not None]
    return [one for one in known if one.published_at is None] + done[::-1][:_PUBLISHED_SHOWN]


def plan_of(session: Session, gym: Gym, plan: UUID) -> Planned:
    """Return a plan of this gym.

    Raises
    ------
    NotFoundError : this gym has no such plan.
    """
    row = session.get(ResetPlan, plan)
    wall = None if row is None else session.get_one(Wall, row.wall_id)
    if row is None or wall is None or wall.gym_id != gym.id:
        raise NotFoundError("not-there-reset")
    published = _publications_by_wall(session, {wall.id}).get(wall.id, [])
    return _planned(row, wall, published, ZoneInfo(gym.time_zone))


def _publications_by_wall(
    session: Session, walls: Iterable[UUID]
) -> dict[UUID, list[tuple[datetime, datetime]]]:
    """Return by wall when each published scan was begun and published, the earliest first."""
    found: dict[UUID, list[tuple[datetime, datetime]]] = {}
    rows = session.execute(
        select(Scan.wall_id, Scan.created_at, Scan.published_at)
        .where(Scan.wall_id.in_(list(walls)), Scan.amends_id.is_(None))
        .where(Scan.state.in_((State.PUBLISHED, State.SUPERSEDED)))
        .order_by(Scan.published_at)
    )
    for wall, begun, at in rows:
        if at is not None:
            found.setdefault(wall, []).append((begun, at))
    return found


def _planned(
    plan: ResetPlan, wall: Wall, published: Iterable[tuple[datetime, datetime]], zone: ZoneInfo
) -> Planned:
    first = datetime.combine(plan.day, time.min, zone)
    at = plan.published_at or next(
        (at for begun, at in published if begun >= first and at > plan.created_at), None
    )
    return Planned(plan, wall, at, None if at is None else at.astimezone(zone).date())


def routes_of(session: Session, plans: Sequence[Planned]) -> dict[UUID, list[Route]]:
    """Return the routes of each plan, in the order in which they were added.

    Those of an open plan are current; a published plan keeps those that were stripped since.
    """
    walls = {one.wall.id for one in plans}
    first = min((one.plan.day for one in plans), default=date.max)
    rows = session.scalars(
        select(Route)
        .where(Route.wall_id.in_(walls), Route.set_on >= first)
        .order_by(Route.created_at, Route.name, Route.id)
    ).all()
    return {one.plan.id: [row for row in rows if _belongs_to_plan(one, row)] for one in plans}


def _belongs_to_plan(planned: Planned, route: Route) -> bool:
    if route.wall_id != planned.wall.id or route.set_on < planned.plan.day:
        return False
    return route.stripped_at is None if planned.until is None else route.set_on <= planned.until


def route_in(session: Session, planned: Planned, route: UUID) -> Route:
    """Return a route of a plan.

    Raises
    ------
    NotFoundError : the plan has no such route.
    """
    row = session.get(Route, route)
    if row is None or not _belongs_to_plan(planned, row):
        raise NotFoundError("not-there-route")
    return row
