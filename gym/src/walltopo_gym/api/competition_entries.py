"""Who takes part in a competition."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any
from uuid import UUID

from fastapi import APIRouter
from pydantic import BaseModel, Field
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.actor import Scope
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.models import Person
from walltopo_gym.api.competition_facts import Gender, LongText, Year
from walltopo_gym.api.competitions import competition_of
from walltopo_gym.api.fields import Body, Name, Text
from walltopo_gym.api.messages import codes_of
from walltopo_gym.api.rules import Access, SetterMay, gym_rule
from walltopo_gym.api.services import Db
from walltopo_gym.competitions.entering import (
    EntryWords,
    add_entry,
    change_entry,
    enter,
    entry_of,
    own_entry,
    sign,
)
from walltopo_gym.competitions.history import marks_of
from walltopo_gym.competitions.making import locked
from walltopo_gym.competitions.models import Competition, Entry, ScoreEvent, WaiverSignature
from walltopo_gym.competitions.start_list import COLUMNS, read_start_list, take_in
from walltopo_gym.errors import NotFoundError
from walltopo_gym.gyms.roles import Role

router = APIRouter(tags=["competitions"])

JudgeMay = Annotated[Access, gym_rule(Role.JUDGE, Scope.MANAGE)]
ClimberMay = Annotated[Access, gym_rule(Role.MEMBER, None)]
ReaderMay = Annotated[Access, gym_rule(Role.MEMBER, Scope.READ)]

Bib = Annotated[int, Field(ge=1, le=99_999)]
Handicap = Annotated[int, Field(ge=-100_000, le=100_000)]
OfEntry = Annotated[str, Field(max_length=80)]


class EntryBody(Body):
    """A competitor; without a bib the next free one."""

    name: Name
    category_id: UUID
    bib: Bib | None = None
    team: Text = Field("", max_length=80)
    club: Text = Field("", max_length=80)
    birth_year: Year | None = None
    gender: Gender = ""
    handicap: Handicap = 0


class EntryChange(Body):
    """What shall be otherwise of a competitor; what is left out stays."""

    name: Name | None = None
    category_id: UUID | None = None
    bib: Bib | None = None
    team: Text | None = Field(None, max_length=80)
    club: Text | None = Field(None, max_length=80)
    birth_year: Year | None = None
    gender: Gender | None = None
    handicap: Handicap | None = None
    withdrawn: bool | None = None


class OwnEntryBody(Body):
    """Oneself as a competitor; `waiver`: the text that one has read and accepts, as it is."""

    category_id: UUID
    name: Name | None = None
    team: Text = Field("", max_length=80)
    club: Text = Field("", max_length=80)
    birth_year: Year | None = None
    gender: Gender = ""
    waiver: str = Field("", max_length=8_000, pattern=LongText)


class EntryFacts(BaseModel):
    """A competitor; `waiver_at`: when the text was accepted last."""

    id: UUID
    category_id: UUID
    name: str
    bib: int
    team: str
    club: str
    birth_year: int | None
    gender: Gender
    handicap: int
    person_id: UUID | None
    withdrawn: bool
    waiver_at: datetime | None


class MarkFacts(BaseModel):
    """What somebody has on a problem: tries, and in which one zone and top came; `event_ids`: of
    the events that count, as they arrived."""

    problem_id: UUID
    tries: int
    zone: int | None
    top: int | None
    event_ids: list[UUID]


class OwnEntry(BaseModel):
    """One's own entry, the text to accept, and what one has on each problem."""

    entry: EntryFacts | None
    waiver: str
    marks: list[MarkFacts]


class StartListBody(Body):
    """A table; `really` false: it is only looked at."""

    csv: str = Field(max_length=1_000_000)
    really: bool = True


class FaultFacts(BaseModel):
    """What is wrong in a line of a table, and what to do; its head is line 1. Codes as those of any
    refusal."""

    line: int
    column: str
    why: str
    hint: str
    code: str = ""
    hint_code: str = ""
    values: dict[str, str] = {}


class StartListFacts(BaseModel):
    """What a table has: with errors nothing of it was taken in."""

    entries: int
    errors: list[FaultFacts]
    columns: list[str]


class Signature(Body):
    signed_by: Name


@router.get("/gyms/{gym}/competitions/{competition}/entries")
def list_entries(competition: UUID, session: Db, access: JudgeMay) -> list[EntryFacts]:
    """All competitors, by their bibs."""
    row = competition_of(session, access, competition)
    rows = select(Entry).where(Entry.competition_id == row.id).order_by(Entry.bib)
    return _facts(session, session.scalars(rows).all())


@router.post("/gyms/{gym}/competitions/{competition}/entries", status_code=201)
def make_entry(competition: UUID, body: EntryBody, session: Db, access: SetterMay) -> EntryFacts:
    """Let somebody take part, with an account or without."""
    row = locked(session, access.gym.id, competition)
    entry = add_entry(session, row, EntryWords(**body.model_dump()))
    _log(session, access, "entry.create", entry)
    return _facts(session, [entry])[0]


@router.patch("/gyms/{gym}/competitions/{competition}/entries/{entry}")
def change_competitor(
    competition: UUID, entry: UUID, body: EntryChange, session: Db, access: SetterMay
) -> EntryFacts:
    """Say something else of a competitor, or let them withdraw."""
    row = locked(session, access.gym.id, competition)
    found = entry_of(session, row, entry)
    given = _given(body)
    change_entry(session, row, found, given)
    if "withdrawn" in given:
        found.removed = given["withdrawn"]
    _log(session, access, "entry.change", found)
    return _facts(session, [found])[0]


@router.post("/gyms/{gym}/competitions/{competition}/entries/import")
def import_entries(
    competition: UUID, body: StartListBody, session: Db, access: SetterMay
) -> StartListFacts:
    """Take a start list in from a table: all of its lines, or, where one has an error, none."""
    row = locked(session, access.gym.id, competition)
    entries, faults = read_start_list(session, row, body.csv)
    if body.really and not faults:
        take_in(session, row, entries)
        log_change(session, "entry.import", person=access.actor.known, gym=access.gym.id,
                   subject=row.name, entries=len(entries))  # fmt: skip
    errors = [
        FaultFacts.model_validate(vars(fault) | codes_of(fault.why, fault.hint)) for fault in faults
    ]
    return StartListFacts(entries=len(entries), errors=errors, columns=list(COLUMNS))


@router.post("/gyms/{gym}/competitions/{competition}/entries/{entry}/waiver", status_code=201)
def sign_waiver(
    competition: UUID, entry: UUID, body: Signature, session: Db, access: JudgeMay
) -> EntryFacts:
    """Note that somebody accepted the text on paper."""
    row = locked(session, access.gym.id, competition)
    found = entry_of(session, row, entry)
    if not row.waiver:
        raise NotFoundError("this competition has no text to accept")
    sign(session, row, found, body.signed_by, access.actor.known, on_paper=True)
    _log(session, access, "entry.waiver", found)
    return _facts(session, [found])[0]


@router.get("/gyms/{gym}/competitions/{competition}/mine")
def read_own_entry(competition: UUID, session: Db, access: ReaderMay) -> OwnEntry:
    """One's own entry and results; no entry where one has not entered."""
    row = competition_of(session, access, competition)
    entry = own_entry(session, row, access.actor.known)
    return _own(session, row, entry)


@router.put("/gyms/{gym}/competitions/{competition}/mine")
def enter_competition(
    competition: UUID, body: OwnEntryBody, session: Db, access: ClimberMay
) -> OwnEntry:
    """Enter a competition, or say otherwise what one said. The text is accepted by it."""
    row = locked(session, access.gym.id, competition)
    competition_of(session, access, competition)
    me = session.get_one(Person, access.actor.known)
    words = EntryWords(
        name=body.name or me.name, category_id=body.category_id, team=body.team, club=body.club,
        birth_year=body.birth_year, gender=body.gender,
    )  # fmt: skip
    entry = enter(session, row, words, me.id, body.waiver)
    _log(session, access, "entry.enter", entry)
    return _own(session, row, entry)


@router.delete("/gyms/{gym}/competitions/{competition}/mine", status_code=204)
def withdraw(competition: UUID, session: Db, access: ClimberMay) -> None:
    """Take part no more; again, too. What one climbed stays noted."""
    row = locked(session, access.gym.id, competition)
    competition_of(session, access, competition)
    entry = own_entry(session, row, access.actor.known)
    if entry is not None and not entry.withdrawn:
        entry.withdrawn = True
        row.revision += 1
        _log(session, access, "entry.withdraw", entry)


def _given(body: EntryChange) -> dict[str, Any]:
    """What was given; only the year of birth can be taken back."""
    given = body.model_dump(exclude_unset=True)
    return {name: v for name, v in given.items() if v is not None or name == "birth_year"}


def _own(session: Session, row: Competition, entry: Entry | None) -> OwnEntry:
    marks = [] if entry is None else marks_of(session, row.id, ScoreEvent.entry_id == entry.id)
    return OwnEntry(
        entry=None if entry is None else _facts(session, [entry])[0],
        waiver=row.waiver,
        marks=[
            MarkFacts(problem_id=found.problem, tries=found.mark.tries,
                      zone=found.mark.zone or None,
                      top=found.mark.top or None, event_ids=found.events)
            for found in marks
        ],
    )  # fmt: skip


def _facts(session: Session, entries: Any) -> list[EntryFacts]:
    signed = (
        select(WaiverSignature.entry_id, func.max(WaiverSignature.created_at))
        .where(WaiverSignature.entry_id.in_([entry.id for entry in entries]))
        .group_by(WaiverSignature.entry_id)
    )
    at: dict[UUID, datetime] = dict(session.execute(signed).all())
    columns = [column.key for column in Entry.__table__.columns]
    return [
        EntryFacts.model_validate(
            {**{name: getattr(entry, name) for name in columns}, "waiver_at": at.get(entry.id)}
        )
        for entry in entries
    ]


def _log(session: Session, access: Access, action: str, entry: Entry) -> None:
    log_change(session, action, person=access.actor.known, gym=access.gym.id, subject=entry.name,
               entry=str(entry.id))  # fmt: skip
