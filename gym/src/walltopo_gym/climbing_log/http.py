"""Endpoints of one's log of all climbs."""

from __future__ import annotations

from dataclasses import asdict
from datetime import date, datetime
from typing import Annotated, Final, Literal
from uuid import UUID

from fastapi import APIRouter, Depends, Path, Query, Response
from pydantic import BaseModel, Field

from walltopo_gym.accounts.access import SignedInMay
from walltopo_gym.api.error_responses import FaultOut
from walltopo_gym.api.fields import Body, Day, Digits, LongText, Text
from walltopo_gym.api.services import Db
from walltopo_gym.api.tables import CsvDialectOf, CsvFile
from walltopo_gym.climbing_log.entries import (
    LogFilter,
    choices_of,
    climbs_of,
    climbs_of_month,
    months_of,
    year_of,
)
from walltopo_gym.climbing_log.importing.reading import read_log
from walltopo_gym.climbing_log.imports import PlannedLine, import_lines, plan_import
from walltopo_gym.climbing_log.models import MAX_GRADE, MAX_NAME, MAX_NOTE
from walltopo_gym.climbing_log.other import (
    Discipline,
    OtherClimb,
    OtherKind,
    Venue,
    day_of,
    noon_of,
    store_other,
    withdraw_other,
)
from walltopo_gym.events import LoggedClimb
from walltopo_gym.spreadsheets import MAX_FAULTS, csv_table

router = APIRouter(tags=["log"])

Month = Annotated[str, Path(pattern=r"^(19|20|21)[0-9]{2}-(0[1-9]|1[0-2])$", description="2026-03")]
_Exact = Annotated[str, Query(max_length=MAX_NAME)]


def _log_filter(
    location: _Exact = "",
    grade: _Exact = "",
    colour: _Exact = "",
    steepness: _Exact = "",
    kind: _Exact = "",
    discipline: _Exact = "",
    words: Annotated[
        str, Query(max_length=200, description="each stands in the name, note or location")
    ] = "",
) -> LogFilter:
    return LogFilter(location, grade, colour, steepness, kind, discipline, words)


Wanted = Annotated[LogFilter, Depends(_log_filter)]


class TotalsOut(BaseModel):
    """Sums over some entries; `days`: on which the person climbed."""

    ascents: int
    tops: int
    flashes: int
    days: int


class MonthOfLog(TotalsOut):
    """The sums of a month, such as "2026-03"."""

    month: str


class ChoicesOut(BaseModel):
    """The values by which one's whole log can be filtered, the commonest first."""

    locations: list[str]
    grades: list[str]
    colours: list[str]
    steepness: list[str]
    kinds: list[str]
    disciplines: list[str]


class LogOverview(BaseModel):
    """The months with entries that pass the filter, the latest first."""

    months: list[MonthOfLog]
    choices: ChoicesOut


class LogEntry(BaseModel):
    """An entry of one's log.

    `origin`: "route" and "problem" are of gyms of this server, "other" of anywhere else, with
    `venue`. `high_point`: number of the highest clip, for that kind alone. `day`: by the gym's
    clock. `gym`: the gym's slug, empty after its deletion; `route` and `wall` are null after
    theirs. `current`: it can still be climbed.
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
    note: str
    venue: str
    discipline: str
    high_point: int | None
    gym: str
    route: UUID | None
    wall: UUID | None
    colour: str
    steepness: str
    current: bool


class OtherAscentIn(Body):
    """An ascent outdoors, in another gym or on a board."""

    venue: Venue
    discipline: Discipline = ""
    name: Text = Field(min_length=1, max_length=MAX_NAME)
    location: Text = ""
    grade: Text = Field("", max_length=MAX_GRADE)
    kind: OtherKind
    tries: int = Field(1, ge=1, le=999)
    note: str = Field("", max_length=MAX_NOTE, pattern=LongText)
    day: Day


class NumberOf(BaseModel):
    """A label and the number of tops."""

    label: str
    tops: int


class YearOut(BaseModel):
    """One's year. `months`: tops from January to December; `grades` and `locations`: the commonest
    first; `streak`: weeks in a row with a climbing day."""

    totals: TotalsOut
    months: list[int]
    grades: list[NumberOf]
    locations: list[NumberOf]
    streak: int


class LogImport(Body):
    """An exported log as text, CSV or JSON; with `really` false it is only checked."""

    text: str = Field(max_length=1_900_000)
    really: bool = False


class ImportedLine(BaseModel):
    """A climb of an imported file. `known`: the log has it already; `shortened`: a text was longer
    than the log keeps."""

    line: int
    day: date
    name: str
    location: str
    grade: str
    kind: OtherKind
    known: bool
    shortened: bool


class LogImportOut(BaseModel):
    """The fate of each line of a file. `added`: number of new climbs, 0 for a check; `faulty`:
    number of lines with errors, of which `errors` lists the first."""

    source: str
    new: int
    added: int
    faulty: int
    lines: list[ImportedLine]
    errors: list[FaultOut]


@router.get("/me/log")
def read_log_overview(session: Db, actor: SignedInMay, wanted: Wanted) -> LogOverview:
    """Return the months of one's log over all gyms, and the values to filter by."""
    climbs = climbs_of(session, actor.known)
    months = months_of(climb for climb in climbs if wanted.wants(climb))
    return LogOverview(
        months=[MonthOfLog(month=month, **vars(totals)) for month, totals in months],
        choices=ChoicesOut(**vars(choices_of(climbs))),
    )


@router.get("/me/log/months/{month}")
def read_log_month(month: Month, session: Db, actor: SignedInMay, wanted: Wanted) -> list[LogEntry]:
    """Return the entries of a month that pass the filter, the latest first."""
    year, number = map(int, month.split("-"))
    found = climbs_of_month(session, actor.known, year, number, wanted)
    return [_entry_out(climb) for climb in found]


@router.get("/me/log/years/{year}")
def read_log_year(
    year: Annotated[Digits, Path(ge=1, le=9999)], session: Db, actor: SignedInMay
) -> YearOut:
    """Return the figures of one's calendar year."""
    found = year_of(climbs_of(session, actor.known), year)
    return YearOut(
        totals=TotalsOut(**vars(found.totals)),
        months=found.months,
        grades=[NumberOf(label=label, tops=tops) for label, tops in found.grades],
        locations=[NumberOf(label=label, tops=tops) for label, tops in found.locations],
        streak=found.streak,
    )


@router.put("/me/log/others/{ascent}", status_code=204)
def put_other_ascent(
    ascent: UUID, body: OtherAscentIn, response: Response, session: Db, actor: SignedInMay
) -> None:
    """Store an ascent elsewhere under an id that the phone made; sending it again corrects it."""
    fields = body.model_dump(exclude={"day"})
    is_new = store_other(
        session, ascent, actor.known, OtherClimb(**fields, climbed_at=noon_of(body.day))
    )
    response.status_code = 201 if is_new else 204


@router.delete("/me/log/others/{ascent}", status_code=204)
def drop_other_ascent(ascent: UUID, session: Db, actor: SignedInMay) -> None:
    """Delete an ascent elsewhere; repeating it is fine."""
    withdraw_other(session, ascent, actor.known)


@router.post("/me/log/import")
def import_log(body: LogImport, session: Db, actor: SignedInMay) -> LogImportOut:
    """Import a log that another service exported. A second import of a file adds nothing."""
    file = read_log(body.text)
    planned = (import_lines if body.really else plan_import)(session, actor.known, file)
    new = sum(not each.is_known for each in planned)
    return LogImportOut(
        source=file.source,
        new=new,
        added=new if body.really else 0,
        faulty=len(file.faults),
        lines=[_imported_line(each) for each in planned],
        errors=[FaultOut.of(fault) for fault in file.faults[:MAX_FAULTS]],
    )


_COLUMNS: Final = (
    "climbed_at",
    "day",
    "venue",
    "location",
    "name",
    "grade",
    "discipline",
    "kind",
    "tries",
    "note",
)


@router.get("/me/log.csv", response_class=CsvFile)
def read_log_table(session: Db, actor: SignedInMay, dialect: CsvDialectOf) -> CsvFile:
    """Return one's whole log as CSV, the earliest first; it can be imported elsewhere."""
    climbs = reversed(climbs_of(session, actor.known))
    rows = (
        asdict(climb) | {"climbed_at": climb.at.isoformat(), "venue": climb.venue or "gym"}
        for climb in climbs
    )
    return CsvFile.of("log", csv_table(_COLUMNS, rows, dialect))


def _entry_out(climb: LoggedClimb) -> LogEntry:
    return LogEntry.model_validate(climb, from_attributes=True)


def _imported_line(planned: PlannedLine) -> ImportedLine:
    line = planned.line
    return ImportedLine(
        line=line.number,
        day=day_of(line.climbed_at),
        name=line.name,
        location=line.location,
        grade=line.grade,
        kind=line.kind,
        known=planned.is_known,
        shortened=line.is_shortened,
    )


ROUTERS = (router,)
