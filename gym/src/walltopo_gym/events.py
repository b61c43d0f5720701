"""Events and questions between slices, handled in the transaction in which they arise.

A slice publishes an event without knowing its listeners, and asks a question without knowing who
answers. `features.py` lists the listeners, and the database carries them, so that every transaction
finds them. An error of a listener undoes the change.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import date, datetime
from typing import TYPE_CHECKING, Any, Final, Generic, Literal, TypeVar
from uuid import UUID

from sqlalchemy import ColumnElement, and_, false, or_
from sqlalchemy.orm import InstrumentedAttribute, Session

from walltopo_gym.database.engine import Database

if TYPE_CHECKING:
    from walltopo_climb.grades.model import Range

Answer = TypeVar("Answer")


class Event:
    """Something that happened."""


@dataclass(frozen=True)
class GymEvent(Event):
    """Something that happened in a gym."""

    gym: UUID


@dataclass(frozen=True)
class DaysChanged(GymEvent):
    """The gym's time zone changed: its days begin at another time."""


@dataclass(frozen=True)
class ReviewChanged(GymEvent):
    """The routes of a scan in review, or of a published one, are new or were edited."""

    scan: UUID


@dataclass(frozen=True)
class ScanFinished(GymEvent):
    """A scan reached its review, or failed.

    Parameters
    ----------
    failed : it has no result.
    """

    wall: UUID
    scan: UUID
    failed: bool


@dataclass(frozen=True)
class AscentsChanged(GymEvent):
    """Ascents of routes were stored, corrected or withdrawn."""

    routes: frozenset[UUID]


@dataclass(frozen=True)
class WallPublished(GymEvent):
    """A scan became a wall's published version."""

    wall: UUID
    scan: UUID


@dataclass(frozen=True)
class RoutesAdded(GymEvent):
    """Routes were added to a wall by hand."""

    wall: UUID


@dataclass(frozen=True)
class RouteStripped(GymEvent):
    """A route was stripped without a new scan."""

    wall: UUID
    route: UUID


@dataclass(frozen=True)
class RouteRestored(GymEvent):
    """The stripping of a route was undone."""

    wall: UUID
    route: UUID


@dataclass(frozen=True)
class HoldReported(GymEvent):
    """A climber reported a hold.

    Parameters
    ----------
    person : the climber, None after the deletion of the account.
    route : the hold's route, if known; kind : of the fault; colour : of the hold; note : in words.
    """

    wall: UUID
    report: UUID
    person: UUID | None
    route: UUID | None
    kind: str
    colour: str
    note: str


@dataclass(frozen=True)
class HoldReportDone(HoldReported):
    """A reported hold was repaired."""


@dataclass(frozen=True)
class HoldsChanged(GymEvent):
    """A new version shows that holds turned, moved, went or came, though their routes stayed.

    Parameters
    ----------
    scan : the version. count : of the holds.
    """

    wall: UUID
    scan: UUID
    count: int


@dataclass(frozen=True)
class HoldMarked(GymEvent):
    """A setter checked a hold, and marked what was done to it.

    Parameters
    ----------
    hold : its id in the version `scan`. mark : "fine", "tightened", "washed" or "removed".
    at : when it was marked, perhaps some days ago.
    """

    wall: UUID
    scan: UUID
    hold: int
    mark: str
    at: datetime
    person: UUID


@dataclass(frozen=True)
class InspectionDue(GymEvent):
    """An inspection is due; published several times.

    Parameters
    ----------
    level : "visual", "operational" or "annual". walls : the names of the due walls.
    on : the day on which the last of them became due.
    """

    level: str
    on: date
    walls: tuple[str, ...]


@dataclass(frozen=True)
class RoutesToForerun(GymEvent):
    """The routes of a planned reset are set, or further forerunners were named for them."""

    wall: UUID
    plan: UUID
    day: date
    forerunners: frozenset[UUID]


@dataclass(frozen=True)
class CompetitionBegins(GymEvent):
    """A competition begins within hours; published several times.

    Parameters
    ----------
    entered : the competitors who have an account.
    """

    competition: UUID
    name: str
    at: datetime
    entered: frozenset[UUID]


@dataclass(frozen=True)
class CompetitionMoved(GymEvent):
    """A competition was published ("open"), started ("running") or ended ("ended"), perhaps again
    after it was moved back."""

    competition: UUID
    state: Literal["open", "running", "ended"]


@dataclass(frozen=True)
class PersonDeleted(Event):
    """An account is about to be deleted, with every row that refers to it."""

    person: UUID


@dataclass(frozen=True)
class Question(Generic[Answer]):
    """A question to all listeners; each may add to `found`."""

    found: list[Answer] = field(default_factory=list[Answer], init=False)


@dataclass(frozen=True)
class OwnTables(Question[tuple[str, type[Any]]]):
    """The tables that name a person (`person_id`), with their names in an export of data."""


@dataclass(frozen=True)
class Admission(Question[bool]):
    """May a request with these cookies see a private gym, though its sender is no member?"""

    gym: UUID
    cookies: Mapping[str, str]


@dataclass(frozen=True)
class ClosedWalls(Question[tuple[UUID, datetime]]):
    """The walls of a gym that are closed to climbers, and since when."""

    gym: UUID


@dataclass(frozen=True)
class TookPart(Question[bool]):
    """Did a person leave data in a gym?"""

    gym: UUID
    person: UUID


@dataclass(frozen=True)
class LoggedClimb:
    """An entry of a person's log.

    Parameters
    ----------
    origin : "route" and "problem": of a gym of this server; "other": of anywhere else.
    day : the gym's day of `at`. kind, high_point : as in an ascent.
    location : the gym's name, a crag, a board. venue : of others, else empty.
    discipline : empty for an unknown one.
    gym : its slug; "" after its deletion. route, wall : None after their deletion.
    current : whether the route or problem can still be climbed.
    """

    id: UUID
    origin: Literal["route", "problem", "other"]
    at: datetime
    day: date
    kind: str
    tries: int
    name: str
    grade: str
    location: str
    note: str = ""
    venue: str = ""
    discipline: str = ""
    high_point: int | None = None
    gym: str = ""
    route: UUID | None = None
    wall: UUID | None = None
    colour: str = ""
    steepness: str = ""
    current: bool = False


@dataclass(frozen=True)
class LoggedClimbs(Question[LoggedClimb]):
    """A person's ascents, in any order.

    Parameters
    ----------
    since, until : climbed at `since` or later and before `until`; None: no limit.
    """

    person: UUID
    since: datetime | None = None
    until: datetime | None = None

    def rows_of(
        self, person: InstrumentedAttribute[UUID], at: InstrumentedAttribute[Any]
    ) -> list[ColumnElement[bool]]:
        """Return the conditions of this person and time on a table's columns."""
        wanted = [person == self.person]
        if self.since is not None:
            wanted.append(at >= self.since)
        if self.until is not None:
            wanted.append(at < self.until)
        return wanted


@dataclass(frozen=True)
class ListedClimb:
    """A route or problem as a list shows it.

    Parameters
    ----------
    number : of a route in the wall's published version. current : whether it can be climbed.
    """

    id: UUID
    kind: Literal["route", "problem"]
    wall_id: UUID
    name: str
    colour: str
    grade_system_id: UUID | None
    grade: str
    number: int | None
    current: bool


@dataclass(frozen=True)
class ClimbsById(Question[ListedClimb]):
    """Those of these routes and problems that are a gym's and that a person may see.

    Parameters
    ----------
    person : None for guests.
    """

    gym: UUID
    ids: frozenset[UUID]
    person: UUID | None
    is_member: bool
    is_setter: bool


@dataclass(frozen=True)
class ClimbedBy(Question[tuple[UUID, UUID, datetime]]):
    """The first time that each of these people topped each of these routes and problems: person,
    climb and moment."""

    climbs: frozenset[UUID]
    people: frozenset[UUID]


@dataclass(frozen=True)
class GymDate:
    """A planned date of a gym.

    Parameters
    ----------
    kind : "reset": new routes come to a wall; "strip": routes of a wall go; "competition".
    id : stable while it is the same date; at : a moment, or an all-day date; end : its end, if
        known.
    name : of the wall or competition; number : of stripped routes.
    path : of its page, below the server's address.
    """

    kind: str
    id: str
    at: datetime | date
    name: str
    path: str
    end: datetime | None = None
    number: int = 0


@dataclass(frozen=True)
class ComingDates(Question[GymDate]):
    """The dates of a gym until a moment, those of today included."""

    gym: UUID
    until: datetime


@dataclass(frozen=True)
class HoldMoment:
    """Something that happened to a hold.

    Parameters
    ----------
    kind : "set", "rescanned", "turned", "moved", "reported", "report-closed", "wall-washed", or a
        mark as in `HoldMarked`. note : in words; person : a name, if known. fault : of a report,
        as in `HoldReported.kind`. inspection : of a mark.
    """

    at: datetime
    kind: str
    note: str = ""
    person: str = ""
    fault: str = ""
    inspection: UUID | None = None


@dataclass(frozen=True)
class HoldHistoryOf(Question[HoldMoment]):
    """The moments of a hold of a wall, in any order.

    Parameters
    ----------
    places : its id in each version that has it. since : of the first of these versions.
    most : maximum number of the latest moments of each kind of answer.
    """

    wall: UUID
    places: Mapping[UUID, int]
    since: datetime
    most: int

    def rows_of(
        self, scan: InstrumentedAttribute[Any], hold: InstrumentedAttribute[Any]
    ) -> ColumnElement[bool]:
        """Return the condition of this hold on a table's columns."""
        here = (and_(scan == version, hold == number) for version, number in self.places.items())
        return or_(false(), *here)


@dataclass(frozen=True)
class RowsExpired(Question[int]):
    """How many rows were deleted that nobody needs any more? Asked by `walltopo gym purge`."""


@dataclass(frozen=True)
class MailQueue:
    """The queued mails of the server.

    Parameters
    ----------
    job : name of the job that sends one.
    waiting : mails that are not sent yet; failed : mails that were given up in the last 30 days.
    error, error_at : reason of the last failure that a mail has, and when that mail was made.
    """

    job: str
    waiting: int
    failed: int
    error: str
    error_at: datetime | None


@dataclass(frozen=True)
class MailQueueOf(Question[MailQueue]):
    """The state of the queued mails."""


@dataclass(frozen=True)
class GradeRangeOf(Question["Range"]):
    """In which range lies the grade of a climb that is no route of the scan?

    Parameters
    ----------
    scan : a version of its wall. model : identity of the model that gave `place`.
    known : whether its hold types are known.
    """

    gym: UUID
    scan: UUID
    model: str
    place: float
    known: bool


@dataclass(frozen=True)
class GradeOutlier:
    """A route whose grade lies outside of its range.

    Parameters
    ----------
    side : "soft" if its grade is above, "hard" if it is below. by : steps of the Font scale.
    """

    route: UUID
    range: Range
    side: Literal["soft", "hard"]
    by: int


@dataclass(frozen=True)
class GradeOutliers:
    """Outliers, the largest first; empty while fewer than `enough` routes are graded."""

    graded: int
    enough: int
    routes: list[GradeOutlier]


NO_OUTLIERS: Final = GradeOutliers(0, 0, [])


@dataclass(frozen=True)
class GradeOutliersOf(Question[GradeOutliers]):
    """The current routes whose grade lies outside of the range that all others suggest."""

    gym: UUID


def publish_event(session: Session, event: Event) -> None:
    """Call all listeners of an event, in this transaction."""
    _call_listeners(session, event)


def collect_answers(session: Session, question: Question[Answer]) -> list[Answer]:
    """Return all answers to a question."""
    _call_listeners(session, question)
    return question.found


def _call_listeners(session: Session, what: object) -> None:
    database: Database = session.info["database"]
    for listener in database.listeners.get(type(what), ()):
        listener(session, what)
