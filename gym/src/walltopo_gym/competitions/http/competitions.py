"""Endpoints of competitions: create, change, open, start, end; running order."""

from __future__ import annotations

from collections import defaultdict
from datetime import datetime
from typing import Literal
from uuid import UUID

from fastapi import APIRouter
from pydantic import BaseModel, Field
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from walltopo_gym.api.fields import Body
from walltopo_gym.api.services import Db
from walltopo_gym.competitions.bodies import (
    CategoryOut,
    CompetitionIn,
    CompetitionOut,
    CompetitionSheet,
    NewCompetition,
    ProblemOut,
    RoundOut,
    SheetBody,
    State,
    WaveOut,
)
from walltopo_gym.competitions.entering import entries_in, own_entry, waves_of
from walltopo_gym.competitions.models import Category, Competition, Entry, Problem, Round, Wave
from walltopo_gym.competitions.order import draw_order, planned_start, put_order, starters
from walltopo_gym.competitions.service import (
    change_sheet,
    locked_competition,
    move_competition,
    move_round,
    round_of,
    set_board_frozen,
)
from walltopo_gym.errors import ConflictError, NotFoundError, RequestError
from walltopo_gym.gyms.access import Access, GuestMay, OwnerMay, SetterMay
from walltopo_gym.gyms.roles import Role

router = APIRouter(tags=["competitions"])


class StateBody(Body):
    state: State


class RoundStateBody(Body):
    state: Literal["waiting", "running", "ended"]


class FrozenBody(Body):
    frozen: bool


def competition_of(session: Session, access: Access, competition: UUID) -> Competition:
    """Return a competition of this gym that the person may see.

    Raises
    ------
    NotFoundError : no such competition in this gym, or a draft and the person is no setter.
    """
    row = session.get(Competition, competition)
    hidden = row is not None and row.state == "draft" and not access.role.covers(Role.SETTER)
    if row is None or row.gym_id != access.gym.id or hidden:
        raise NotFoundError("not-there-competition")
    return row


@router.get("/gyms/{gym}/competitions")
def list_competitions(session: Db, access: GuestMay) -> list[CompetitionOut]:
    """Return the gym's competitions, the latest first. Only setters see drafts."""
    rows = select(Competition).where(Competition.gym_id == access.gym.id)
    if not access.role.covers(Role.SETTER):
        rows = rows.where(Competition.state != "draft")
    latest = func.coalesce(Competition.starts_at, Competition.created_at).desc()
    found = session.scalars(rows.order_by(latest, Competition.id).limit(500)).all()
    entries = entries_in(session, [row.id for row in found])
    zone = access.gym.time_zone
    return [
        CompetitionOut.model_validate(
            {**_competition_columns(row), "entries": entries.get(row.id, 0), "time_zone": zone}
        )
        for row in found
    ]


@router.post("/gyms/{gym}/competitions", status_code=201)
def make_competition(body: NewCompetition, session: Db, access: SetterMay) -> CompetitionSheet:
    """Create a competition as a draft."""
    row = Competition(
        gym_id=access.gym.id,
        format=body.format,
        state="draft",
        revision=0,
        last_seq=0,
        **body.facts(),
    )
    _check_dates(row)
    session.add(row)
    session.flush()
    change_sheet(session, row, body.categories, body.rounds)
    log_competition(session, access, "competition.create", row)
    return _sheet(session, access, row)


@router.get("/gyms/{gym}/competitions/{competition}")
def read_competition(competition: UUID, session: Db, access: GuestMay) -> CompetitionSheet:
    """Return a competition without its scores."""
    return _sheet(session, access, competition_of(session, access, competition))


@router.patch("/gyms/{gym}/competitions/{competition}")
def change_competition(
    competition: UUID, body: CompetitionIn, session: Db, access: SetterMay
) -> CompetitionSheet:
    """Change a competition. Accepted texts stay as they were accepted."""
    row = locked_competition(session, access.gym.id, competition)
    for name, value in body.facts().items():
        setattr(row, name, value)
    _check_dates(row)
    row.revision += 1
    return _log_and_return_sheet(session, access, row, "competition.change")


@router.put("/gyms/{gym}/competitions/{competition}/sheet")
def put_competition_sheet(
    competition: UUID, body: SheetBody, session: Db, access: SetterMay
) -> CompetitionSheet:
    """Change categories, rounds and problems; those with an id keep it."""
    row = locked_competition(session, access.gym.id, competition)
    change_sheet(session, row, body.categories, body.rounds)
    return _log_and_return_sheet(session, access, row, "competition.change")


@router.put("/gyms/{gym}/competitions/{competition}/state")
def put_competition_state(
    competition: UUID, body: StateBody, session: Db, access: SetterMay
) -> CompetitionSheet:
    """Open a competition for entries, begin or end it, or go back. Beginning it begins its first
    round."""
    row = locked_competition(session, access.gym.id, competition)
    move_competition(session, row, body.state)
    return _log_and_return_sheet(session, access, row, f"competition.{body.state}")


@router.put("/gyms/{gym}/competitions/{competition}/frozen")
def freeze_board(
    competition: UUID, body: FrozenBody, session: Db, access: SetterMay
) -> CompetitionSheet:
    """Freeze the board for all but judges, or unfreeze it."""
    row = locked_competition(session, access.gym.id, competition)
    set_board_frozen(session, row, body.frozen)
    return _log_and_return_sheet(
        session, access, row, "competition.freeze" if body.frozen else "competition.thaw"
    )


@router.delete("/gyms/{gym}/competitions/{competition}", status_code=204)
def drop_competition(competition: UUID, session: Db, access: OwnerMay) -> None:
    """Delete a competition for good, unless it has scores."""
    row = locked_competition(session, access.gym.id, competition)
    if row.last_seq:
        raise ConflictError("cup-scored", "cup-end-instead")
    session.delete(row)
    log_competition(session, access, "competition.delete", row)


@router.put("/gyms/{gym}/competitions/{competition}/rounds/{one}/state")
def put_round_state(
    competition: UUID, one: UUID, body: RoundStateBody, session: Db, access: SetterMay
) -> CompetitionSheet:
    """Begin or end a round. A round with a quota draws its starters when it begins."""
    row = locked_competition(session, access.gym.id, competition)
    found = round_of(session, row, one)
    move_round(session, row, found, body.state)
    return _log_and_return_sheet(session, access, row, f"round.{body.state}")


def _log_and_return_sheet(
    session: Session, access: Access, row: Competition, action: str
) -> CompetitionSheet:
    session.flush()
    log_competition(session, access, action, row)
    return _sheet(session, access, row)


def _check_dates(row: Competition) -> None:
    if row.ends_at is not None and (row.starts_at is None or row.ends_at < row.starts_at):
        raise RequestError("cup-ends-before")


def _competition_columns(row: Competition) -> dict[str, object]:
    return {column.key: getattr(row, column.key) for column in Competition.__table__.columns}


def _sheet(session: Session, access: Access, row: Competition) -> CompetitionSheet:
    in_category = (
        select(Entry.category_id, func.count())
        .where(Entry.competition_id == row.id, Entry.withdrawn.is_(False))
        .group_by(Entry.category_id)
    )
    entries: dict[UUID, int] = dict(session.execute(in_category).all())
    me = access.actor.person
    mine = None if me is None else own_entry(session, row, me)
    return CompetitionSheet.model_validate(
        {
            **_competition_columns(row),
            "entries": sum(entries.values()),
            "time_zone": access.gym.time_zone,
            "entered": mine is not None and not mine.withdrawn,
            "categories": _categories(session, row, entries),
            "rounds": _rounds(session, row),
        }
    )


def _categories(session: Session, row: Competition, entries: dict[UUID, int]) -> list[CategoryOut]:
    rows = select(Category).where(Category.competition_id == row.id).order_by(Category.place)
    return [
        CategoryOut.model_validate({**_fields_of(category), "entries": entries.get(category.id, 0)})
        for category in session.scalars(rows)
    ]


def _rounds(session: Session, row: Competition) -> list[RoundOut]:
    rounds = select(Round).where(Round.competition_id == row.id).order_by(Round.place)
    found = session.scalars(rounds).all()
    problems = defaultdict[UUID, list[ProblemOut]](list)
    of = select(Problem).where(Problem.round_id.in_([one.id for one in found]))
    for problem in session.scalars(of.order_by(Problem.place)):
        facts = ProblemOut.model_validate(problem, from_attributes=True)
        facts.label = facts.label or str(len(problems[problem.round_id]) + 1)
        problems[problem.round_id].append(facts)
    waves = _waves_by_round(session, row)
    return [
        RoundOut.model_validate(
            {**_fields_of(one), "problems": problems[one.id], "waves": waves[one.id]}
        )
        for one in found
    ]


def _waves_by_round(session: Session, row: Competition) -> dict[UUID, list[WaveOut]]:
    """Return the waves by round."""
    entered = select(Entry.wave_id, func.count()).where(
        Entry.competition_id == row.id, Entry.withdrawn.is_(False)
    )
    entries = dict(session.execute(entered.group_by(Entry.wave_id)).all())
    waves = defaultdict[UUID, list[WaveOut]](list)
    for wave in waves_of(session, row):
        facts = {**_fields_of(wave), "entries": entries.get(wave.id, 0)}
        waves[wave.round_id].append(WaveOut.model_validate(facts))
    return waves


def _fields_of(row: Category | Round | Wave) -> dict[str, object]:
    return {column.key: getattr(row, column.key) for column in row.__table__.columns}


def log_competition(
    session: Session, access: Access, action: str, row: Competition, **details: str
) -> None:
    """Log a change of a competition; `details`: any facts that are not secret."""
    access.log_change(
        session,
        action,
        subject=row.name,
        competition=str(row.id),
        **details,
    )


class StarterOut(BaseModel):
    """A competitor's place in the running order of their category, from 1. `starts_at`: the planned
    start on the first problem, if the round has a beginning and a rotation."""

    category_id: UUID
    place: int
    entry_id: UUID
    bib: int
    name: str
    starts_at: datetime | None


class OrderBody(Body):
    """Starters of a category in a round, in running order."""

    category_id: UUID
    entry_ids: list[UUID] = Field(max_length=2_000)


@router.get("/gyms/{gym}/competitions/{competition}/rounds/{one}/starters")
def list_starters(competition: UUID, one: UUID, session: Db, access: GuestMay) -> list[StarterOut]:
    """Return the starters of a round, by category and in running order."""
    row = competition_of(session, access, competition)
    return running_order(session, row, round_of(session, row, one))


@router.put("/gyms/{gym}/competitions/{competition}/rounds/{one}/starters")
def put_starters(
    competition: UUID, one: UUID, body: OrderBody, session: Db, access: SetterMay
) -> list[StarterOut]:
    """Set the running order of a category; in a round with a quota also its starters. Starters who
    are not named come last."""
    row = locked_competition(session, access.gym.id, competition)
    found = round_of(session, row, one)
    put_order(session, row, found, body.category_id, body.entry_ids)
    log_competition(session, access, "round.order", row)
    return running_order(session, row, found)


@router.post("/gyms/{gym}/competitions/{competition}/rounds/{one}/starters/draw")
def draw_starters(competition: UUID, one: UUID, session: Db, access: SetterMay) -> list[StarterOut]:
    """Draw a new running order while the round has no scores: by lot, or, with a quota, from the
    ranks of the round before, whose best comes last."""
    row = locked_competition(session, access.gym.id, competition)
    found = round_of(session, row, one)
    draw_order(session, row, found)
    log_competition(session, access, "round.order", row)
    return running_order(session, row, found)


def running_order(session: Session, row: Competition, one: Round) -> list[StarterOut]:
    """Return the starters of a round, by category and in running order."""
    return [
        StarterOut(
            category_id=entry.category_id,
            place=place,
            entry_id=entry.id,
            bib=entry.bib,
            name=entry.name,
            starts_at=planned_start(one, place),
        )
        for entry, place in starters(session, row, one)
    ]
