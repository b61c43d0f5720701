"""Making a competition, and changing its sheet: categories, rounds, problems from routes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any, Final
from uuid import UUID, uuid4

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from walltopo.core import InputError
from walltopo_gym.competitions.models import (
    Category,
    Competition,
    Entry,
    Problem,
    Round,
    ScoreEvent,
)
from walltopo_gym.competitions.scoring.rules import Scoring
from walltopo_gym.competitions.sheet import Format
from walltopo_gym.errors import ConflictError, NotFoundError
from walltopo_gym.gyms.models import Wall
from walltopo_gym.publishing.models import Route

_ONE_ROUND: Final = (Format.FESTIVAL, Format.NIGHT)


@dataclass(frozen=True)
class CategoryWish:
    """A category as it shall be; without an id a new one."""

    id: UUID | None
    name: str
    gender: str = ""
    born_from: int | None = None
    born_to: int | None = None


@dataclass(frozen=True)
class ProblemWish:
    """A problem as it shall be; what a route says of itself is not asked for."""

    id: UUID | None
    label: str = ""
    route_id: UUID | None = None
    words: dict[str, str] = field(default_factory=dict)
    points: dict[str, int] | None = None
    category_ids: Sequence[UUID] = ()


@dataclass(frozen=True)
class RoundWish:
    """A round as it shall be; without an id a new one."""

    id: UUID | None
    name: str
    kind: str
    scoring: dict[str, Any]
    quota: int | None
    opens_at: datetime | None
    closes_at: datetime | None
    problems: Sequence[ProblemWish]


def locked(session: Session, gym: UUID, competition: UUID) -> Competition:
    """A competition of this gym, which nobody else changes or scores in meanwhile.

    Raises
    ------
    NotFoundError : there is none, or it is another gym's.
    """
    row = session.get(Competition, competition, with_for_update=True, populate_existing=True)
    if row is None or row.gym_id != gym:
        raise NotFoundError("no such competition")
    return row


def change_sheet(
    session: Session,
    row: Competition,
    categories: Sequence[CategoryWish],
    rounds: Sequence[RoundWish],
) -> None:
    """Let a competition have these categories and rounds, and no others.

    Raises
    ------
    InputError : they do not go with the format, or name what is not there.
    ConflictError : one that shall go has entries or scores.
    """
    _check_form(Format(row.format), categories, rounds)
    session.flush()
    known = _kept(session, Category, Category.competition_id == row.id, categories)
    for place, wish in enumerate(categories):
        category = known.get(wish.id) if wish.id else None
        if category is None:
            category = Category(id=wish.id or uuid4(), competition_id=row.id)
            session.add(category)
        category.place, category.name, category.gender = place, wish.name, wish.gender
        category.born_from, category.born_to = wish.born_from, wish.born_to
    session.flush()
    ids = set(session.scalars(select(Category.id).where(Category.competition_id == row.id)))
    _change_rounds(session, row, rounds, ids)
    row.revision += 1
    session.flush()


def _check_form(
    form: Format, categories: Sequence[CategoryWish], rounds: Sequence[RoundWish]
) -> None:
    if not categories or not rounds:
        raise InputError("a competition needs a category and a round")
    if form in _ONE_ROUND and len(rounds) > 1:
        raise InputError("this format has one round", "Make it a competition of rounds.")
    if form != Format.ROUNDS and any(wish.quota is not None for wish in rounds):
        raise InputError("only a competition of rounds has quotas")
    if rounds[0].quota is not None:
        raise InputError("all come to the first round: it has no quota")
    if form == Format.LEAGUE and not all(Scoring.of(w.scoring).has_points for w in rounds):
        raise InputError("the rounds of a league need rules with points")
    names = [wish.name for wish in categories]
    if len(set(names)) < len(names):
        raise InputError("two categories have the same name")


def _change_rounds(
    session: Session, row: Competition, rounds: Sequence[RoundWish], categories: set[UUID]
) -> None:
    known = _kept(session, Round, Round.competition_id == row.id, rounds)
    for place, wish in enumerate(rounds):
        one = known.get(wish.id) if wish.id else None
        if one is None:
            one = Round(id=wish.id or uuid4(), competition_id=row.id, state="waiting")
            session.add(one)
        one.place, one.name, one.kind = place, wish.name, wish.kind
        one.scoring, one.quota = wish.scoring, wish.quota
        one.opens_at, one.closes_at = wish.opens_at, wish.closes_at
        session.flush()
        _change_problems(session, row, one, wish.problems, categories)


def _change_problems(
    session: Session, row: Competition, one: Round, wishes: Sequence[ProblemWish],
    categories: set[UUID],
) -> None:  # fmt: skip
    known = _kept(session, Problem, Problem.round_id == one.id, wishes)
    for place, wish in enumerate(wishes):
        if not categories.issuperset(wish.category_ids):
            raise InputError("a problem is of a category that there is not")
        problem = known.get(wish.id) if wish.id else None
        if problem is None or wish.route_id is None or wish.route_id != problem.route_id:
            words = _words(session, row.gym_id, wish)
        else:
            words = {}
        if problem is None:
            problem = Problem(id=wish.id or uuid4(), round_id=one.id)
            session.add(problem)
        for name, value in words.items():
            setattr(problem, name, value)
        problem.place, problem.label, problem.route_id = place, wish.label, wish.route_id
        problem.points = wish.points
        problem.category_ids = [str(category) for category in wish.category_ids]


def _words(session: Session, gym: UUID, wish: ProblemWish) -> dict[str, str]:
    """What is said of a problem; of a route as it is today, so that it outlives the route."""
    if wish.route_id is None:
        return wish.words
    found = select(Route, Wall.name).join(Wall, Wall.id == Route.wall_id)
    there = session.execute(found.where(Route.id == wish.route_id, Wall.gym_id == gym)).first()
    if there is None:
        raise NotFoundError("no such route")
    route, wall = there
    return {"name": route.name, "colour": route.colour, "grade": route.grade, "wall": wall}


def _kept(session: Session, kind: Any, here: Any, wishes: Iterable[Any]) -> dict[UUID, Any]:
    """The rows that stay, by id; others go, unless somebody is in them."""
    rows = {row.id: row for row in session.scalars(select(kind).where(here))}
    given = [wish.id for wish in wishes if wish.id is not None]
    if len(set(given)) < len(given):
        raise InputError("the same thing stands there twice")
    taken = set(given) - rows.keys()
    if taken and session.scalar(select(kind.id).where(kind.id.in_(taken))) is not None:
        raise ConflictError("this id is taken", "Make another one.")
    for gone in rows.keys() - set(given):
        _check_unused(session, kind, gone)
        session.delete(rows[gone])
    return rows


def _check_unused(session: Session, kind: Any, gone: UUID) -> None:
    if kind is Category:
        used = select(func.count()).where(Entry.category_id == gone)
    else:
        scored = select(func.count()).select_from(ScoreEvent)
        scored = scored.join(Problem, Problem.id == ScoreEvent.problem_id)
        used = scored.where((Problem.round_id if kind is Round else Problem.id) == gone)
    if session.scalar(used):
        raise ConflictError(
            "what somebody has entered or scored in cannot be taken away",
            "Move the entries, or leave it as it is.",
        )
