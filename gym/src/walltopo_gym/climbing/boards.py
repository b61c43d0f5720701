"""Leaderboards: the standings of those who want to be seen there."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import Any, Final, Literal, TypeVar
from uuid import UUID

from sqlalchemy import ColumnElement, Select, func, or_, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.models import Person, Profile
from walltopo_gym.climbing.counted_models import Standing
from walltopo_gym.climbing.counting import zone_of
from walltopo_gym.climbing.follows import followed_by
from walltopo_gym.climbing.visits import gym_day
from walltopo_gym.gyms.models import GradeSystem, Gym, Membership

Age = Literal["", "u18", "40"]
Rows = TypeVar("Rows", bound="Select[*tuple[Any, ...]]")

_UNDER: Final = 18
_OVER: Final = 40


@dataclass(frozen=True)
class Asked:
    """Which board.

    Parameters
    ----------
    period : "2026-03", "2026" or "all"; circuit : a label, or empty for all routes.
    category : of the profile, or empty; age : "u18": turns at most 17 this year, "40": at least 40.
    friends_of : only those whom this person was let follow, and this person.
    """

    period: str
    circuit: str = ""
    category: str = ""
    age: Age = ""
    friends_of: UUID | None = None


@dataclass(frozen=True)
class Line:
    """Somebody's place; equal points are an equal rank, and the next one is as much later."""

    rank: int
    person_id: UUID
    name: str
    points: int
    tops: int
    flashes: int


@dataclass(frozen=True)
class Board:
    """Some lines of a board, of how many, and one's own place; `own` is None where one has no
    points, or is not of those whom the board is about."""

    lines: list[Line]
    of: int
    own: Line | None


def board(
    session: Session, gym: Gym, asked: Asked, viewer: UUID, at: datetime, size: int, skip: int
) -> Board:
    """A part of a board. One's own place is told to oneself also when others do not see it.

    Parameters
    ----------
    at : now; size, skip : how many lines, after how many.
    """
    year = gym_day(at, zone_of(gym)).year
    these = [
        Standing.gym_id == gym.id, Standing.period == asked.period,
        Standing.circuit == asked.circuit, *_about(asked, year),
    ]  # fmt: skip
    seen = [*these, Profile.on_boards.is_(True)]
    columns = Standing.person_id, Person.name, Standing.points, Standing.tops, Standing.flashes
    named = _joined(select(*columns), gym).join(Person, Person.id == Standing.person_id)
    order = Standing.points.desc(), Person.name, Standing.person_id
    rows = session.execute(named.where(*seen).order_by(*order).offset(skip).limit(size)).all()
    mine = session.execute(named.where(*these, Standing.person_id == viewer)).one_or_none()
    better = [
        func.count().filter(Standing.points > row.points)
        for row in (*rows[:1], *([] if mine is None else [mine]))
    ]
    counted = _joined(select(func.count(), *better).select_from(Standing), gym).where(*seen)
    of, *above = session.execute(counted).one()
    lines: list[Line] = []
    for place, row in enumerate(rows):
        if lines and lines[-1].points == row.points:
            rank = lines[-1].rank
        else:
            rank = 1 + (skip + place if place else above[0])
        lines.append(Line(rank, *row))
    own = None if mine is None else Line(1 + above[-1], *mine)
    return Board(lines, of, own)


def circuits(session: Session, gym: Gym) -> list[dict[str, str]]:
    """The gym's circuits, {"label", "colour"}, from the easiest; of equal names the first."""
    systems = select(GradeSystem).where(
        GradeSystem.gym_id == gym.id, GradeSystem.kind == "circuits"
    )
    found: dict[str, str] = {}
    for system in session.scalars(systems.order_by(GradeSystem.created_at, GradeSystem.id)):
        for grade in system.grades:
            found.setdefault(grade["label"], grade.get("colour") or "")
    return [{"label": label, "colour": colour} for label, colour in found.items()]


def month_of(gym: Gym, at: datetime) -> str:
    """The period of a moment's month, by the gym's days."""
    return f"{gym_day(at, zone_of(gym)):%Y-%m}"


def _joined(rows: Rows, gym: Gym) -> Rows:
    """With profiles, of members only: who has left the gym is on its boards no more."""
    return rows.outerjoin(Profile, Profile.person_id == Standing.person_id).join(
        Membership,
        (Membership.person_id == Standing.person_id) & (Membership.gym_id == gym.id),
    )


def _about(asked: Asked, year: int) -> list[ColumnElement[bool]]:
    """Conditions of those whom a board is about."""
    found: list[ColumnElement[bool]] = []
    if asked.category:
        found.append(Profile.category == asked.category)
    if asked.age == "u18":
        found.append(Profile.birth_year > year - _UNDER)
    elif asked.age == "40":
        found.append(Profile.birth_year <= year - _OVER)
    if asked.friends_of is not None:
        mine = Standing.person_id == asked.friends_of
        found.append(or_(mine, Standing.person_id.in_(followed_by(asked.friends_of))))
    return found
