"""Leaderboards of the people who agreed to be listed."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import Any, Final, Literal, TypeVar
from uuid import UUID

from sqlalchemy import ColumnElement, Select, func, or_, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.models import Person, Profile
from walltopo_gym.climbing.follows import followed_by
from walltopo_gym.climbing.models import Standing
from walltopo_gym.gyms.days import gym_day, zone_of
from walltopo_gym.gyms.models import GradeSystem, Gym, Membership
from walltopo_gym.walls.disciplines import Discipline

Age = Literal["", "u18", "40"]
Rows = TypeVar("Rows", bound="Select[*tuple[Any, ...]]")

_UNDER: Final = 18
_OVER: Final = 40


@dataclass(frozen=True)
class BoardQuery:
    """The filters of a board.

    Parameters
    ----------
    period : "2026-03", "2026" or "all"; circuit : a label, or empty for all routes.
    discipline : one that `counted_as` returns.
    category : of the profile, or empty; age : "u18": turns at most 17 this year, "40": at least 40.
    friends_of : restricts the board to this person and the people they follow.
    """

    period: str
    circuit: str = ""
    category: str = ""
    age: Age = ""
    friends_of: UUID | None = None
    discipline: Discipline = Discipline.BOULDER


@dataclass(frozen=True)
class BoardLine:
    """A person's place. Equal points share a rank, and the next rank skips as many."""

    rank: int
    person_id: UUID
    name: str
    points: int
    tops: int
    flashes: int


@dataclass(frozen=True)
class BoardPart:
    """Some lines of a board, their total number, and the viewer's own place. `own` is None without
    points, or if the filters exclude the viewer."""

    lines: list[BoardLine]
    of: int
    own: BoardLine | None


def board(
    session: Session, gym: Gym, query: BoardQuery, viewer: UUID, at: datetime, size: int, skip: int
) -> BoardPart:
    """Return a part of a board. It includes the viewer's own place even if others do not see it.

    Parameters
    ----------
    at : now; size, skip : page size and offset.
    """
    year = gym_day(at, zone_of(gym)).year
    these = [
        Standing.gym_id == gym.id,
        Standing.period == query.period,
        Standing.discipline == query.discipline,
        Standing.circuit == query.circuit,
        *_filter_conditions(query, year),
    ]
    seen = [*these, Profile.on_boards.is_(True)]
    columns = Standing.person_id, Person.name, Standing.points, Standing.tops, Standing.flashes
    named = _join_profiles(select(*columns), gym).join(Person, Person.id == Standing.person_id)
    order = Standing.points.desc(), Person.name, Standing.person_id
    rows = session.execute(named.where(*seen).order_by(*order).offset(skip).limit(size)).all()
    mine = session.execute(named.where(*these, Standing.person_id == viewer)).one_or_none()
    better = [
        func.count().filter(Standing.points > row.points)
        for row in (*rows[:1], *([] if mine is None else [mine]))
    ]
    counted = _join_profiles(select(func.count(), *better).select_from(Standing), gym).where(*seen)
    of, *above = session.execute(counted).one()
    lines: list[BoardLine] = []
    for index, row in enumerate(rows):
        if lines and lines[-1].points == row.points:
            rank = lines[-1].rank
        else:
            rank = 1 + (skip + index if index else above[0])
        lines.append(BoardLine(rank, *row))
    own = None if mine is None else BoardLine(1 + above[-1], *mine)
    return BoardPart(lines, of, own)


def circuits(session: Session, gym: Gym) -> list[dict[str, str]]:
    """Return the gym's circuits, {"label", "colour"}, from the easiest; duplicate names once."""
    systems = select(GradeSystem).where(
        GradeSystem.gym_id == gym.id, GradeSystem.kind == "circuits"
    )
    found: dict[str, str] = {}
    for system in session.scalars(systems.order_by(GradeSystem.created_at, GradeSystem.id)):
        for grade in system.grades:
            found.setdefault(grade["label"], grade.get("colour") or "")
    return [{"label": label, "colour": colour} for label, colour in found.items()]


def month_of(gym: Gym, at: datetime) -> str:
    """Return the month of a moment as YYYY-MM, by the gym's time zone and start of the day."""
    return f"{gym_day(at, zone_of(gym)):%Y-%m}"


def _join_profiles(rows: Rows, gym: Gym) -> Rows:
    """Join profiles of current members; former members are on no board."""
    return rows.outerjoin(Profile, Profile.person_id == Standing.person_id).join(
        Membership,
        (Membership.person_id == Standing.person_id) & (Membership.gym_id == gym.id),
    )


def _filter_conditions(query: BoardQuery, year: int) -> list[ColumnElement[bool]]:
    """Return the conditions of a board's filters."""
    found: list[ColumnElement[bool]] = []
    if query.category:
        found.append(Profile.category == query.category)
    if query.age == "u18":
        found.append(Profile.birth_year > year - _UNDER)
    elif query.age == "40":
        found.append(Profile.birth_year <= year - _OVER)
    if query.friends_of is not None:
        mine = Standing.person_id == query.friends_of
        found.append(or_(mine, Standing.person_id.in_(followed_by(query.friends_of))))
    return found
