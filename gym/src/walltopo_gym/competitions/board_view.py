"""Messages of a board, for JSON and paper."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import datetime
from typing import Final
from uuid import UUID

MAX_SHOWN_PROBLEMS: Final = 10  # problems of a round whose marks are in each line


@dataclass(frozen=True, slots=True)
class HighPoint:
    """A competitor's result on a route. `high`: the hold, the hold with a plus (34+), or TOP, empty
    without a try; `seconds`: climbing time; `rank`: the rank on this route if the round ranks by
    it."""

    high: str
    seconds: int | None
    rank: str


@dataclass(frozen=True, slots=True)
class RoundLine:
    """A competitor's result in a round. `marks`: problem to tries, zone and top (0: not reached),
    in rounds of few problems. In a lead round `result` is the score, and `highs` are by route."""

    round_id: UUID
    rank: int | None
    started: bool
    points: str
    tops: int
    zones: int
    flashes: int
    tries_to_top: int
    tries_to_zone: int
    marks: dict[UUID, tuple[int, int, int]] = field(default_factory=dict)
    result: str = ""
    highs: dict[UUID, HighPoint] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Line:
    """A competitor's place. `rank` is null without a result or if disqualified (`out`); `tied`: the
    rank is shared. `points` sums all rounds, empty if rounds are not added up."""

    entry_id: UUID
    bib: int
    name: str
    team: str
    club: str
    rank: int | None
    tied: bool
    out: str | None
    points: str
    rounds: list[RoundLine]


@dataclass(frozen=True, slots=True)
class CategoryLines:
    """The lines of a category, in order of rank."""

    id: UUID
    name: str
    lines: list[Line]


@dataclass(frozen=True, slots=True)
class Team:
    """A team of a league and its place."""

    rank: int
    tied: bool
    name: str
    points: str
    members: list[str]


@dataclass(frozen=True, slots=True)
class ProblemHead:
    """A problem in a column's heading."""

    id: UUID
    label: str
    colour: str


@dataclass(frozen=True, slots=True)
class RoundHead:
    """A round in a column's heading."""

    id: UUID
    name: str
    kind: str
    state: str
    rules: str
    problems: list[ProblemHead]


@dataclass(frozen=True, slots=True)
class BoardView:
    """A board; frozen since `frozen_at`. `seq` and `at`: number and arrival of its last score
    event."""

    competition_id: UUID
    name: str
    state: str
    format: str
    frozen_at: datetime | None
    seq: int
    revision: int
    at: datetime | None
    rounds: list[RoundHead]
    categories: list[CategoryLines]
    teams: list[Team]
