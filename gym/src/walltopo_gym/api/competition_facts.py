"""Bodies and answers about competitions."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, Literal
from uuid import UUID

from pydantic import BaseModel, Field

from walltopo_gym.api.fields import Body, Moment, Name, Text
from walltopo_gym.competitions.making import CategoryWish, ProblemWish, RoundWish
from walltopo_gym.competitions.scoring.rules import Rules
from walltopo_gym.competitions.sheet import Format

State = Literal["draft", "open", "running", "ended"]
RoundState = Literal["waiting", "running", "ended"]
Gender = Literal["", "women", "men", "other"]
Year = Annotated[int, Field(ge=1900, le=2100)]
# Words of several lines: no control characters but tabs and line breaks.
LongText = r"^[^\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]*$"
Worth = Annotated[int, Field(ge=0, le=100_000)]
Few = Annotated[int, Field(ge=1, le=500)]


class ProblemPoints(Body):
    """What one problem is worth."""

    flash: Worth
    top: Worth
    zone: Worth


class ScoringBody(Body):
    """Rules, and their numbers where they are not the usual ones; `best`: how many problems
    count."""

    rules: Rules
    flash: Worth | None = None
    top: Worth | None = None
    zone: Worth | None = None
    best: Few | None = None


class CategoryBody(Body):
    """A category; without an id a new one."""

    id: UUID | None = None
    name: Name
    gender: Gender = ""
    born_from: Year | None = None
    born_to: Year | None = None


class ProblemBody(Body):
    """A problem; of one with a route the route says name, colour, grade and wall."""

    id: UUID | None = None
    label: Text = Field("", max_length=20)
    route_id: UUID | None = None
    name: Text = Field("", max_length=80)
    colour: Text = Field("", max_length=40)
    grade: Text = Field("", max_length=80)
    wall: Text = Field("", max_length=80)
    points: ProblemPoints | None = None
    category_ids: list[UUID] = Field([], max_length=50)

    def wish(self) -> ProblemWish:
        """As the room below has it."""
        words = {"name": self.name, "colour": self.colour, "grade": self.grade, "wall": self.wall}
        points = None if self.points is None else self.points.model_dump()
        return ProblemWish(self.id, self.label, self.route_id, words, points, self.category_ids)


class RoundBody(Body):
    """A round; each of `route_ids` becomes a problem after those in `problems`."""

    id: UUID | None = None
    name: Name
    kind: Literal["open", "qualification", "semi", "final", "week"] = "open"
    scoring: ScoringBody
    quota: Annotated[int, Field(ge=1, le=2_000)] | None = None
    opens_at: Moment | None = None
    closes_at: Moment | None = None
    route_ids: list[UUID] = Field([], max_length=500)
    problems: list[ProblemBody] = Field([], max_length=500)

    def wish(self) -> RoundWish:
        """As the room below has it."""
        problems = [problem.wish() for problem in self.problems]
        problems += [ProblemWish(None, route_id=route) for route in self.route_ids]
        return RoundWish(
            self.id, self.name, self.kind, self.scoring.model_dump(mode="json", exclude_none=True),
            self.quota, self.opens_at, self.closes_at, problems,
        )  # fmt: skip


class SheetBody(Body):
    """Categories and rounds, all of them."""

    categories: list[CategoryBody] = Field(min_length=1, max_length=50)
    rounds: list[RoundBody] = Field(min_length=1, max_length=60)

    def wishes(self) -> tuple[list[CategoryWish], list[RoundWish]]:
        """As the room below has them."""
        categories = [CategoryWish(**category.model_dump()) for category in self.categories]
        return categories, [one.wish() for one in self.rounds]


class CompetitionWords(Body):
    """What is said of a competition; of a change, what is left out stays."""

    name: Name | None = None
    about: str | None = Field(None, max_length=2_000, pattern=LongText)
    fee: str | None = Field(None, max_length=200, pattern=LongText)
    waiver: str | None = Field(None, max_length=8_000, pattern=LongText)
    starts_at: Moment | None = None
    ends_at: Moment | None = None
    self_entry: bool | None = None
    self_scoring: bool | None = None
    late_minutes: Annotated[int, Field(ge=0, le=1_440)] | None = None
    league_best: Few | None = None
    team_size: Few | None = None

    def facts(self) -> dict[str, Any]:
        """What was given, by column; times and league numbers can be taken back."""
        nullable = ("starts_at", "ends_at", "league_best", "team_size")
        columns = CompetitionWords.model_fields
        given = self.model_dump(exclude_unset=True, include=set(columns))
        return {name: v for name, v in given.items() if v is not None or name in nullable}


class NewCompetition(CompetitionWords, SheetBody):
    """All of a competition in one go."""

    name: Name
    format: Format


class ProblemFacts(BaseModel):
    """A problem as it is in its competition, whatever became of its route."""

    id: UUID
    label: str
    route_id: UUID | None
    name: str
    colour: str
    grade: str
    wall: str
    points: ProblemPoints | None
    category_ids: list[UUID]


class RoundFacts(BaseModel):
    """A round and its problems."""

    id: UUID
    name: str
    kind: str
    state: RoundState
    scoring: ScoringBody
    quota: int | None
    opens_at: datetime | None
    closes_at: datetime | None
    begun_at: datetime | None
    problems: list[ProblemFacts]


class CategoryFacts(BaseModel):
    """A category; `entries`: who takes part in it."""

    id: UUID
    name: str
    gender: Gender
    born_from: int | None
    born_to: int | None
    entries: int


class CompetitionFacts(BaseModel):
    """A competition in a list."""

    id: UUID
    name: str
    format: Format
    state: State
    about: str
    fee: str
    starts_at: datetime | None
    ends_at: datetime | None
    self_entry: bool
    self_scoring: bool
    entries: int


class CompetitionSheet(CompetitionFacts):
    """All of a competition but its scores. `entered`: one takes part oneself."""

    waiver: str
    late_minutes: int
    league_best: int | None
    team_size: int | None
    frozen_at: datetime | None
    revision: int
    time_zone: str
    entered: bool
    categories: list[CategoryFacts]
    rounds: list[RoundFacts]
