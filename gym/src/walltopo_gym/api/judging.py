"""Score events: what judges and competitors enter, appeals, and what was decided."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from datetime import datetime
from typing import Annotated
from uuid import UUID

from fastapi import APIRouter, Query, Response
from pydantic import BaseModel, Field
from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.models import Person
from walltopo_gym.api.competition_entries import ClimberMay, JudgeMay
from walltopo_gym.api.competition_facts import LongText
from walltopo_gym.api.competitions import competition_of
from walltopo_gym.api.fields import Body, Moment
from walltopo_gym.api.paging import Size
from walltopo_gym.api.services import Db, ServicesOf
from walltopo_gym.competitions.history import marks_of, struck
from walltopo_gym.competitions.judging import Said, keep_event
from walltopo_gym.competitions.ledger import Kind
from walltopo_gym.competitions.making import locked
from walltopo_gym.competitions.models import Problem, Round, ScoreEvent
from walltopo_gym.errors import NotFoundError
from walltopo_gym.gyms.roles import Role

router = APIRouter(tags=["competitions"])

Number = Annotated[int, Field(ge=0, le=2_000_000_000)]


class EventBody(Body):
    """What was seen: `n` is the number of the try; `device` and `number`, which counts up there,
    say in which order one device said it. `made_at`, `sent_at`: by the device's clock."""

    entry_id: UUID
    problem_id: UUID | None = None
    kind: Kind
    n: int | None = Field(None, ge=0, le=999)
    target_id: UUID | None = None
    text: str = Field("", max_length=500, pattern=LongText)
    device: str = Field(max_length=40, pattern=r"^[A-Za-z0-9_-]+$")
    number: Number
    made_at: Moment
    sent_at: Moment


class EventFacts(BaseModel):
    """A score event. `seq`, `at`: when it came to the server; `climbed_at`: `made_at` without the
    error of the device's clock; `counts`: no other one stands in its place."""

    id: UUID
    seq: int
    entry_id: UUID
    problem_id: UUID | None
    kind: Kind
    n: int | None
    target_id: UUID | None
    text: str
    device: str
    number: int
    made_at: datetime
    climbed_at: datetime
    at: datetime
    by_name: str
    counts: bool


class EventPage(BaseModel):
    """Some events, the first first; `next`: ask after this one for more."""

    items: list[EventFacts]
    next: int | None


class ProblemMark(BaseModel):
    """What a competitor has on a problem, and the events that say so."""

    entry_id: UUID
    tries: int
    zone: int | None
    top: int | None
    events: list[EventFacts]


class AppealFacts(BaseModel):
    """An appeal and its decision (`n` 1: upheld), once there is one."""

    event: EventFacts
    decision: EventFacts | None


@router.put("/gyms/{gym}/competitions/{competition}/events/{event}")
def put_score_event(
    competition: UUID, event: UUID, body: EventBody, response: Response, services: ServicesOf,
    access: ClimberMay,
) -> EventFacts:  # fmt: skip
    """Say what was seen, under an id that one's device has made, so that it arrives once however
    often it is sent. Judges speak for everybody; others for themselves, where the competition
    lets them."""
    said = Said(**body.model_dump())
    judges = access.role.covers(Role.JUDGE)
    # A whole hall writes: the transaction is as short as can be.
    with services.database.writing() as session:
        row = locked(session, access.gym.id, competition)
        competition_of(session, access, competition)
        kept, is_new = keep_event(session, row, event, said, access.actor.known, judges=judges)
    response.status_code = 201 if is_new else 200
    with services.database.reading() as session:
        return _told(session, competition, [kept], about=not is_new)[0]


@router.get("/gyms/{gym}/competitions/{competition}/events")
def list_score_events(
    competition: UUID, session: Db, access: JudgeMay,
    after: Annotated[int, Query(ge=0, le=2_000_000_000)] = 0,
    size: Size = 100,
    entry: UUID | None = None,
    problem: UUID | None = None,
    kind: Kind | None = None,
) -> EventPage:  # fmt: skip
    """Who entered what, in the order in which it came."""
    row = competition_of(session, access, competition)
    rows = select(ScoreEvent).where(ScoreEvent.competition_id == row.id, ScoreEvent.seq > after)
    if entry is not None:
        rows = rows.where(ScoreEvent.entry_id == entry)
    if problem is not None:
        rows = rows.where(ScoreEvent.problem_id == problem)
    if kind is not None:
        rows = rows.where(ScoreEvent.kind == kind)
    found = session.scalars(rows.order_by(ScoreEvent.seq).limit(size + 1)).all()
    following = found[size - 1].seq if len(found) > size else None
    return EventPage(items=_told(session, row.id, found[:size]), next=following)


@router.get("/gyms/{gym}/competitions/{competition}/problems/{problem}/marks")
def list_marks(
    competition: UUID, problem: UUID, session: Db, access: JudgeMay
) -> list[ProblemMark]:
    """What competitors have on a problem."""
    row = competition_of(session, access, competition)
    here = select(Problem.id).join(Round, Round.id == Problem.round_id)
    if session.scalar(here.where(Problem.id == problem, Round.competition_id == row.id)) is None:
        raise NotFoundError("no such problem")
    of_problem = marks_of(session, row.id, ScoreEvent.problem_id == problem)
    found = [has for has in of_problem if has.problem == problem]
    ids = [event for has in found for event in has.events]
    rows = select(ScoreEvent).where(ScoreEvent.competition_id == row.id,
                                    ScoreEvent.problem_id == problem)  # fmt: skip
    wanted = set(ids)
    events = defaultdict[UUID, list[EventFacts]](list)
    ordered = session.scalars(rows.order_by(ScoreEvent.seq)).all()
    for told in _told(session, row.id, [one for one in ordered if one.id in wanted]):
        events[told.entry_id].append(told)
    return [
        ProblemMark(entry_id=has.entry, tries=has.mark.tries, zone=has.mark.zone or None,
                    top=has.mark.top or None, events=events[has.entry])
        for has in found
    ]  # fmt: skip


@router.get("/gyms/{gym}/competitions/{competition}/appeals")
def list_appeals(competition: UUID, session: Db, access: JudgeMay) -> list[AppealFacts]:
    """What competitors object to, the latest first, and what was decided last."""
    row = competition_of(session, access, competition)
    kinds = ScoreEvent.kind.in_((Kind.APPEAL, Kind.DECISION))
    rows = select(ScoreEvent).where(ScoreEvent.competition_id == row.id, kinds)
    found = _told(session, row.id, session.scalars(rows.order_by(ScoreEvent.seq)).all())
    decided = {told.target_id: told for told in found if told.kind == Kind.DECISION and told.counts}
    return [
        AppealFacts(event=told, decision=decided.get(told.id))
        for told in reversed(found)
        if told.kind == Kind.APPEAL and told.counts
    ]


def _told(
    session: Session, competition: UUID, events: Sequence[ScoreEvent], *, about: bool = True
) -> list[EventFacts]:
    """Events, in words for people; `about`: whether others can be about them already."""
    people = {event.person_id for event in events if event.person_id is not None}
    named = session.execute(select(Person.id, Person.name).where(Person.id.in_(people)))
    names: dict[UUID | None, str] = dict(named.all())
    ids = [event.id for event in events]
    gone = struck(session, competition, ids) if ids and about else set()
    return [
        EventFacts.model_validate({
            **{name: getattr(event, name) for name in _COLUMNS},
            "by_name": names.get(event.person_id, ""), "counts": event.id not in gone,
        })
        for event in events
    ]  # fmt: skip


_COLUMNS = [name for name in EventFacts.model_fields if name not in ("by_name", "counts")]
