"""A competition without its scores: categories, rounds, problems, competitors, rules."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.competitions import models
from walltopo_gym.competitions.scoring.rules import Scoring


class Format(StrEnum):
    """How rounds make one ranking.

    Festival and night have one round. With rounds, the later round reached ranks first, and the
    round before breaks ties. A league adds its rounds up.
    """

    FESTIVAL = "festival"
    ROUNDS = "rounds"
    LEAGUE = "league"
    NIGHT = "night"


@dataclass(frozen=True, slots=True)
class Task:
    """A problem; `categories`: its categories, empty for all; `holds`: number of a route's holds,
    if known; `max_attempts`: limit of attempts, None: no limit."""

    id: UUID
    label: str
    colour: str
    points: dict[str, int] | None
    categories: frozenset[UUID]
    holds: int | None = None
    max_attempts: int | None = None

    def is_for(self, category: UUID) -> bool:
        """Return whether a category climbs it."""
        return not self.categories or category in self.categories


@dataclass(frozen=True, slots=True)
class RoundSheet:
    """A round; `starters` is None in an open round."""

    id: UUID
    name: str
    kind: str
    state: str
    scoring: Scoring
    quota: int | None
    begun_at: datetime | None
    problems: tuple[Task, ...]
    starters: frozenset[UUID] | None

    def has(self, entry: UUID) -> bool:
        """Return whether a competitor climbs in it."""
        return self.starters is None or entry in self.starters

    def problems_of(self, category: UUID) -> tuple[Task, ...]:
        """Return the problems of a category."""
        return tuple(task for task in self.problems if task.is_for(category))


@dataclass(frozen=True, slots=True)
class Competitor:
    """An entry that has not withdrawn."""

    id: UUID
    category: UUID
    bib: int
    name: str
    team: str
    club: str
    handicap: int


@dataclass(frozen=True)
class Sheet:
    """The whole sheet, in order; `revision` grows with each change."""

    id: UUID
    name: str
    format: Format
    state: str
    revision: int
    frozen_at: datetime | None
    league_best: int | None
    team_size: int | None
    categories: tuple[tuple[UUID, str], ...]
    rounds: tuple[RoundSheet, ...]
    entries: tuple[Competitor, ...]

    def as_of(self, at: datetime) -> Sheet:
        """Return the sheet at a moment, before later rounds had begun."""
        rounds = tuple(r for r in self.rounds if r.begun_at is not None and r.begun_at <= at)
        return Sheet(**{**vars(self), "rounds": rounds or self.rounds[:1]})


def load_sheet(session: Session, competition: models.Competition) -> Sheet:
    """Return a competition's sheet from its tables."""
    problems = defaultdict[UUID, list[Task]](list)
    of = models.Round.competition_id == competition.id
    tasks = select(models.Problem, models.Round.max_attempts).join(
        models.Round, models.Round.id == models.Problem.round_id
    )
    for row, most in session.execute(tasks.where(of).order_by(models.Problem.place)):
        problems[row.round_id].append(_sheet_problem(row, len(problems[row.round_id]) + 1, most))
    starters = defaultdict[UUID, set[UUID]](set)
    started = select(models.Starter).join(models.Round, models.Round.id == models.Starter.round_id)
    for starter in session.scalars(started.where(of)):
        starters[starter.round_id].add(starter.entry_id)
    rounds = session.scalars(select(models.Round).where(of).order_by(models.Round.place))
    categories = session.scalars(
        select(models.Category)
        .where(models.Category.competition_id == competition.id)
        .order_by(models.Category.place)
    )
    entries = session.scalars(
        select(models.Entry)
        .where(models.Entry.competition_id == competition.id, models.Entry.withdrawn.is_(False))
        .order_by(models.Entry.bib)
    )
    return Sheet(
        id=competition.id,
        name=competition.name,
        format=Format(competition.format),
        state=competition.state,
        revision=competition.revision,
        frozen_at=competition.frozen_at,
        league_best=competition.league_best,
        team_size=competition.team_size,
        categories=tuple((row.id, row.name) for row in categories),
        rounds=tuple(
            _round_sheet(row, tuple(problems[row.id]), frozenset(starters[row.id]))
            for row in rounds
        ),
        entries=tuple(
            Competitor(row.id, row.category_id, row.bib, row.name, row.team, row.club, row.handicap)
            for row in entries
        ),
    )


def _sheet_problem(row: models.Problem, number: int, max_attempts: int | None) -> Task:
    whose = frozenset(UUID(category) for category in row.category_ids)
    label = row.label or str(number)
    return Task(row.id, label, row.colour, row.points, whose, row.holds, max_attempts)


def _round_sheet(
    row: models.Round, problems: tuple[Task, ...], starters: frozenset[UUID]
) -> RoundSheet:
    return RoundSheet(
        id=row.id,
        name=row.name,
        kind=row.kind,
        state=row.state,
        scoring=Scoring.of(row.scoring),
        quota=row.quota,
        begun_at=row.begun_at,
        problems=problems,
        starters=None if row.quota is None else starters,
    )
