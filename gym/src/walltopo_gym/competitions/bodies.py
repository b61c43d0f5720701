"""Request and response bodies of competitions."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, Literal
from uuid import UUID

from pydantic import BaseModel, Field

from walltopo_gym.api.fields import Body, LongText, Moment, Name, Text
from walltopo_gym.competitions.ledger import Kind
from walltopo_gym.competitions.scoring.rules import Rules
from walltopo_gym.competitions.scoring.score import Mark
from walltopo_gym.competitions.sheet import Format

State = Literal["draft", "open", "running", "ended"]
RoundState = Literal["waiting", "running", "ended"]
Gender = Literal["", "women", "men", "other"]
Year = Annotated[int, Field(ge=1900, le=2100)]
Worth = Annotated[int, Field(ge=0, le=100_000)]
Few = Annotated[int, Field(ge=1, le=500)]
Holds = Annotated[int, Field(ge=1, le=500)]
MaxAttempts = Annotated[int, Field(ge=1, le=999)]


class ProblemPoints(Body):
    """The points of one problem."""

    flash: Worth
    top: Worth
    zone: Worth


class ScoringBody(Body):
    """Rules, and their numbers if they differ from the defaults; `best`: number of problems that
    count."""

    rules: Rules
    flash: Worth | None = None
    top: Worth | None = None
    zone: Worth | None = None
    best: Few | None = None

    @property
    def numbers(self) -> dict[str, Any]:
        """Return the rules with the given numbers, as the database stores them."""
        return self.model_dump(mode="json", exclude_none=True)


class CategoryBody(Body):
    """A category; a new one if it has no id."""

    id: UUID | None = None
    name: Name
    gender: Gender = ""
    born_from: Year | None = None
    born_to: Year | None = None


class ProblemBody(Body):
    """A problem. With a route, name, colour, grade and wall come from the route. `holds`: number
    of holds of a route for rope, counted as judges do."""

    id: UUID | None = None
    label: Text = Field("", max_length=20)
    route_id: UUID | None = None
    name: Text = Field("", max_length=80)
    colour: Text = Field("", max_length=40)
    grade: Text = Field("", max_length=80)
    wall: Text = Field("", max_length=80)
    points: ProblemPoints | None = None
    category_ids: list[UUID] = Field([], max_length=50)
    holds: Holds | None = None

    @property
    def words(self) -> dict[str, str]:
        """Fields of a problem without a route, by column."""
        return self.model_dump(include={"name", "colour", "grade", "wall"})


class WaveBody(Body):
    """A wave; a new one if it has no id. `places`: limit of competitors who enter themselves."""

    id: UUID | None = None
    name: Name
    starts_at: Moment
    ends_at: Moment
    places: Annotated[int, Field(ge=1, le=5_000)] | None = None


class RoundBody(Body):
    """A round. Each of `route_ids` becomes a problem after those in `problems`. `max_attempts`:
    limit of attempts on each problem. `isolation_minutes`: how long before `opens_at` isolation
    closes; `rotation_seconds`: time between the starts of two competitors."""

    id: UUID | None = None
    name: Name
    kind: Literal["open", "qualification", "semi", "final", "week"] = "open"
    scoring: ScoringBody
    quota: Annotated[int, Field(ge=1, le=2_000)] | None = None
    opens_at: Moment | None = None
    closes_at: Moment | None = None
    max_attempts: MaxAttempts | None = None
    isolation_minutes: Annotated[int, Field(ge=0, le=1_440)] | None = None
    rotation_seconds: Annotated[int, Field(ge=10, le=7_200)] | None = None
    waves: list[WaveBody] = Field(default_factory=list, max_length=50)
    route_ids: list[UUID] = Field([], max_length=500)
    problems: list[ProblemBody] = Field([], max_length=500)

    @property
    def all_problems(self) -> list[ProblemBody]:
        """Return `problems`, and one problem for each of `route_ids`."""
        return [
            *self.problems,
            *(ProblemBody.model_construct(route_id=route) for route in self.route_ids),
        ]


class SheetBody(Body):
    """All categories and rounds."""

    categories: list[CategoryBody] = Field(min_length=1, max_length=50)
    rounds: list[RoundBody] = Field(min_length=1, max_length=60)


class CompetitionIn(Body):
    """Fields of a competition; a change keeps omitted fields."""

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
        """Return the given fields by column; times and league numbers may be set to null."""
        nullable = ("starts_at", "ends_at", "league_best", "team_size")
        columns = CompetitionIn.model_fields
        given = self.model_dump(exclude_unset=True, include=set(columns))
        return {name: v for name, v in given.items() if v is not None or name in nullable}


class NewCompetition(CompetitionIn, SheetBody):
    """A complete new competition."""

    name: Name
    format: Format


class ProblemOut(BaseModel):
    """A problem of a competition; later changes of its route do not show."""

    id: UUID
    label: str
    route_id: UUID | None
    name: str
    colour: str
    grade: str
    wall: str
    points: ProblemPoints | None
    category_ids: list[UUID]
    holds: int | None


class WaveOut(BaseModel):
    """A wave; `entries`: its number of competitors."""

    id: UUID
    name: str
    starts_at: datetime
    ends_at: datetime
    places: int | None
    entries: int


class RoundOut(BaseModel):
    """A round, its waves and its problems."""

    id: UUID
    name: str
    kind: str
    state: RoundState
    scoring: ScoringBody
    quota: int | None
    opens_at: datetime | None
    closes_at: datetime | None
    begun_at: datetime | None
    max_attempts: int | None
    isolation_minutes: int | None
    rotation_seconds: int | None
    waves: list[WaveOut]
    problems: list[ProblemOut]


class CategoryOut(BaseModel):
    """A category; `entries`: its number of competitors."""

    id: UUID
    name: str
    gender: Gender
    born_from: int | None
    born_to: int | None
    entries: int


class CompetitionOut(BaseModel):
    """A competition in a list; `time_zone` is the gym's, in which its times are to be shown."""

    id: UUID
    name: str
    format: Format
    state: State
    about: str
    fee: str
    starts_at: datetime | None
    ends_at: datetime | None
    time_zone: str
    self_entry: bool
    self_scoring: bool
    entries: int


class CompetitionSheet(CompetitionOut):
    """A competition without its scores. `entered`: whether the viewer takes part."""

    waiver: str
    late_minutes: int
    league_best: int | None
    team_size: int | None
    frozen_at: datetime | None
    revision: int
    entered: bool
    categories: list[CategoryOut]
    rounds: list[RoundOut]


Bib = Annotated[int, Field(ge=1, le=99_999)]


Handicap = Annotated[int, Field(ge=-100_000, le=100_000)]


class EntryBody(Body):
    """A competitor. Without a bib the next free one is given."""

    name: Name
    category_id: UUID
    bib: Bib | None = None
    team: Text = Field("", max_length=80)
    club: Text = Field("", max_length=80)
    birth_year: Year | None = None
    gender: Gender = ""
    handicap: Handicap = 0
    wave_id: UUID | None = None


class MarkFields(BaseModel):
    """A competitor's mark on a problem: tries, and the tries that reached zone and top; on a route
    the hold of the high point below the top, and the climbing time."""

    tries: int
    zone: int | None
    top: int | None
    hold: int | None
    plus: bool
    seconds: int | None


def mark_fields(mark: Mark) -> dict[str, Any]:
    """Return the fields of a mark for a response."""
    return {
        "tries": mark.tries,
        "zone": mark.zone or None,
        "top": mark.top or None,
        "hold": mark.hold if mark.high_try else None,
        "plus": mark.plus,
        "seconds": mark.seconds,
    }


Number = Annotated[int, Field(ge=0, le=2_000_000_000)]


class EventBody(Body):
    """A score event: `n` is the number of the try. A high point has the number of its `hold`,
    maybe with a `plus`; it and a top on a route may have the climbing time in `seconds`. `device`
    and its counter `number` give the order in which one device sent events; `made_at` and `sent_at`
    are by the device's clock."""

    entry_id: UUID
    problem_id: UUID | None = None
    kind: Kind
    n: int | None = Field(None, ge=0, le=999)
    hold: int | None = Field(None, ge=0, le=999)
    plus: bool = False
    seconds: int | None = Field(None, ge=1, le=86_400)
    target_id: UUID | None = None
    text: str = Field("", max_length=500, pattern=LongText)
    device: str = Field(max_length=40, pattern=r"^[A-Za-z0-9_-]+$")
    number: Number
    made_at: Moment
    sent_at: Moment
