"""Entries of a competition."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any
from uuid import UUID

from fastapi import APIRouter
from pydantic import BaseModel, Field
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.actor import Scope
from walltopo_gym.accounts.models import Person
from walltopo_gym.api.error_responses import FaultOut
from walltopo_gym.api.fields import Body, LongText, Name, Text
from walltopo_gym.api.services import Db
from walltopo_gym.competitions.bodies import (
    Bib,
    EntryBody,
    Gender,
    Handicap,
    MarkFields,
    Year,
    mark_fields,
)
from walltopo_gym.competitions.entering import (
    accept_text,
    add_entry,
    change_entry,
    enter_person,
    entry_of,
    own_entry,
)
from walltopo_gym.competitions.history import marks_of
from walltopo_gym.competitions.http.competitions import competition_of
from walltopo_gym.competitions.models import Competition, Entry, ScoreEvent, WaiverSignature
from walltopo_gym.competitions.service import locked_competition
from walltopo_gym.competitions.start_list import COLUMNS, read_start_list, take_in
from walltopo_gym.errors import NotFoundError
from walltopo_gym.gyms.access import Access, SetterMay, gym_rule
from walltopo_gym.gyms.roles import Role

router = APIRouter(tags=["competitions"])

JudgeMay = Annotated[Access, gym_rule(Role.JUDGE, Scope.MANAGE)]
ClimberMay = Annotated[Access, gym_rule(Role.MEMBER, None)]
ReaderMay = Annotated[Access, gym_rule(Role.MEMBER, Scope.READ)]

OfEntry = Annotated[str, Field(max_length=80)]


class EntryChange(Body):
    """Changes of a competitor; omitted fields stay."""

    name: Name | None = None
    category_id: UUID | None = None
    bib: Bib | None = None
    team: Text | None = Field(None, max_length=80)
    club: Text | None = Field(None, max_length=80)
    birth_year: Year | None = None
    gender: Gender | None = None
    handicap: Handicap | None = None
    wave_id: UUID | None = None
    withdrawn: bool | None = None


class OwnEntryBody(Body):
    """One's own entry; `waiver`: the accepted text, verbatim."""

    category_id: UUID
    name: Name | None = None
    team: Text = Field("", max_length=80)
    club: Text = Field("", max_length=80)
    birth_year: Year | None = None
    gender: Gender = ""
    wave_id: UUID | None = None
    waiver: str = Field("", max_length=8_000, pattern=LongText)


class EntryOut(BaseModel):
    """A competitor; `waiver_at`: when the text was last accepted."""

    id: UUID
    category_id: UUID
    name: str
    bib: int
    team: str
    club: str
    birth_year: int | None
    gender: Gender
    handicap: int
    wave_id: UUID | None
    person_id: UUID | None
    withdrawn: bool
    waiver_at: datetime | None


class MarkOut(MarkFields):
    """One's own mark on a problem. `event_ids`: the events that count, in order of arrival."""

    problem_id: UUID
    event_ids: list[UUID]


class OwnEntry(BaseModel):
    """One's own entry, the text to accept, and one's marks."""

    entry: EntryOut | None
    waiver: str
    marks: list[MarkOut]


class StartListBody(Body):
    """A start list as text; with `really` false it is only checked. `others`: lines of people who
    only have the name of somebody on the list."""

    csv: str = Field(max_length=1_000_000)
    really: bool = True
    others: list[Annotated[int, Field(ge=1)]] = Field([], max_length=2_000)


class KnownCompetitor(BaseModel):
    """A line that nothing but its number tells apart from a competitor on the list."""

    line: int
    entry_id: UUID
    bib: int
    name: str
    club: str
    birth_year: int | None


class StartListOut(BaseModel):
    """The content of a start list. If it has errors, nothing is imported.

    `entries`: number of new competitors; `known`: lines of people who are on the list already.
    """

    entries: int
    known: list[KnownCompetitor]
    errors: list[FaultOut]
    columns: list[str]


class Signature(Body):
    signed_by: Name


@router.get("/gyms/{gym}/competitions/{competition}/entries")
def list_entries(competition: UUID, session: Db, access: JudgeMay) -> list[EntryOut]:
    """Return all competitors by bib."""
    row = competition_of(session, access, competition)
    rows = select(Entry).where(Entry.competition_id == row.id).order_by(Entry.bib)
    return _entries_out(session, session.scalars(rows).all())


@router.post("/gyms/{gym}/competitions/{competition}/entries", status_code=201)
def make_entry(competition: UUID, body: EntryBody, session: Db, access: SetterMay) -> EntryOut:
    """Add a competitor, with an account or without."""
    row = locked_competition(session, access.gym.id, competition)
    entry = add_entry(session, row, body)
    _log_entry(session, access, "entry.create", entry)
    return _entries_out(session, [entry])[0]


@router.patch("/gyms/{gym}/competitions/{competition}/entries/{entry}")
def change_competitor(
    competition: UUID, entry: UUID, body: EntryChange, session: Db, access: SetterMay
) -> EntryOut:
    """Change or withdraw a competitor."""
    row = locked_competition(session, access.gym.id, competition)
    found = entry_of(session, row, entry)
    given = _given_fields(body)
    change_entry(session, row, found, given)
    if "withdrawn" in given:
        found.removed = given["withdrawn"]
    _log_entry(session, access, "entry.change", found)
    return _entries_out(session, [found])[0]


@router.post("/gyms/{gym}/competitions/{competition}/entries/import")
def import_entries(
    competition: UUID, body: StartListBody, session: Db, access: SetterMay
) -> StartListOut:
    """Import a start list: all of its lines that are new, or none if one has an error."""
    row = locked_competition(session, access.gym.id, competition)
    entries, known, faults = read_start_list(session, row, body.csv, set(body.others))
    if body.really and not faults and entries:
        take_in(session, row, entries)
        access.log_change(
            session,
            "entry.import",
            subject=row.name,
            entries=len(entries),
        )
    errors = [FaultOut.of(fault) for fault in faults]
    return StartListOut(
        entries=len(entries),
        errors=errors,
        columns=list(COLUMNS),
        known=[
            KnownCompetitor(
                line=one.line,
                entry_id=one.entry.id,
                bib=one.entry.bib,
                name=one.entry.name,
                club=one.entry.club,
                birth_year=one.entry.birth_year,
            )
            for one in known
        ],
    )


@router.post("/gyms/{gym}/competitions/{competition}/entries/{entry}/waiver", status_code=201)
def sign_waiver(
    competition: UUID, entry: UUID, body: Signature, session: Db, access: JudgeMay
) -> EntryOut:
    """Record that a competitor accepted the text on paper."""
    row = locked_competition(session, access.gym.id, competition)
    found = entry_of(session, row, entry)
    if not row.waiver:
        raise NotFoundError("cup-no-text")
    accept_text(session, row, found, body.signed_by, access.actor.known, on_paper=True)
    _log_entry(session, access, "entry.waiver", found)
    return _entries_out(session, [found])[0]


@router.get("/gyms/{gym}/competitions/{competition}/mine")
def read_own_entry(competition: UUID, session: Db, access: ReaderMay) -> OwnEntry:
    """Return one's own entry and results; the entry is null if one has not entered."""
    row = competition_of(session, access, competition)
    entry = own_entry(session, row, access.actor.known)
    return _own_entry(session, row, entry)


@router.put("/gyms/{gym}/competitions/{competition}/mine")
def enter_competition(
    competition: UUID, body: OwnEntryBody, session: Db, access: ClimberMay
) -> OwnEntry:
    """Enter a competition, or change one's entry. This accepts the text."""
    row = locked_competition(session, access.gym.id, competition)
    competition_of(session, access, competition)
    me = session.get_one(Person, access.actor.known)
    words = EntryBody(
        name=body.name or me.name,
        category_id=body.category_id,
        team=body.team,
        club=body.club,
        birth_year=body.birth_year,
        gender=body.gender,
        wave_id=body.wave_id,
    )
    entry = enter_person(session, row, words, me.id, body.waiver)
    _log_entry(session, access, "entry.enter", entry)
    return _own_entry(session, row, entry)


@router.delete("/gyms/{gym}/competitions/{competition}/mine", status_code=204)
def withdraw(competition: UUID, session: Db, access: ClimberMay) -> None:
    """Withdraw from a competition; repeating it is fine. Results stay."""
    row = locked_competition(session, access.gym.id, competition)
    competition_of(session, access, competition)
    entry = own_entry(session, row, access.actor.known)
    if entry is not None and not entry.withdrawn:
        entry.withdrawn = True
        row.revision += 1
        _log_entry(session, access, "entry.withdraw", entry)


def _given_fields(body: EntryChange) -> dict[str, Any]:
    """Return the given fields; only the year of birth and the wave may be set to null."""
    given = body.model_dump(exclude_unset=True)
    nullable = ("birth_year", "wave_id")
    return {name: v for name, v in given.items() if v is not None or name in nullable}


def _own_entry(session: Session, row: Competition, entry: Entry | None) -> OwnEntry:
    marks = [] if entry is None else marks_of(session, row.id, ScoreEvent.entry_id == entry.id)
    return OwnEntry(
        entry=None if entry is None else _entries_out(session, [entry])[0],
        waiver=row.waiver,
        marks=[
            MarkOut(
                problem_id=found.problem,
                **mark_fields(found.mark),
                event_ids=found.events,
            )
            for found in marks
        ],
    )


def _entries_out(session: Session, entries: Any) -> list[EntryOut]:
    signed = (
        select(WaiverSignature.entry_id, func.max(WaiverSignature.created_at))
        .where(WaiverSignature.entry_id.in_([entry.id for entry in entries]))
        .group_by(WaiverSignature.entry_id)
    )
    at: dict[UUID, datetime] = dict(session.execute(signed).all())
    columns = [column.key for column in Entry.__table__.columns]
    return [
        EntryOut.model_validate(
            {**{name: getattr(entry, name) for name in columns}, "waiver_at": at.get(entry.id)}
        )
        for entry in entries
    ]


def _log_entry(session: Session, access: Access, action: str, entry: Entry) -> None:
    # By number: the log outlives the competitor's account.
    access.log_change(
        session,
        action,
        subject=f"#{entry.bib}",
        entry=str(entry.id),
    )
