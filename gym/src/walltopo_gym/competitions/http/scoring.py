"""Endpoints of score events and appeals, and of the board: now, at a moment, live, as a table."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import AsyncIterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Annotated, Any, Final, Literal
from uuid import UUID
from zoneinfo import ZoneInfo

import msgspec
from fastapi import APIRouter, Depends, Query, Request, Response
from fastapi.sse import EventSourceResponse, ServerSentEvent
from pydantic import BaseModel
from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.people import names_by_id
from walltopo_gym.api.documents import DocumentTurn, document_response
from walltopo_gym.api.fields import Digits, Moment
from walltopo_gym.api.paging import Size
from walltopo_gym.api.services import Db, ServicesOf
from walltopo_gym.api.tables import CsvDialectOf, CsvFile
from walltopo_gym.api.turns import turn_for
from walltopo_gym.competitions.board_view import BoardView
from walltopo_gym.competitions.bodies import EventBody, MarkFields, mark_fields
from walltopo_gym.competitions.history import marks_of, struck_events
from walltopo_gym.competitions.http.competitions import competition_of
from walltopo_gym.competitions.http.entries import ClimberMay, JudgeMay
from walltopo_gym.competitions.judge_links import link_names
from walltopo_gym.competitions.judging import Account, store_event
from walltopo_gym.competitions.ledger import Kind
from walltopo_gym.competitions.live import LiveBoards
from walltopo_gym.competitions.models import Competition, Problem, Round, ScoreEvent
from walltopo_gym.competitions.ranking import Step
from walltopo_gym.competitions.service import locked_competition
from walltopo_gym.competitions.tables import results_csv, results_pdf
from walltopo_gym.errors import NotFoundError
from walltopo_gym.gyms.access import GuestMay
from walltopo_gym.gyms.roles import Role
from walltopo_gym.languages import Language

router = APIRouter(tags=["competitions"])


async def _boards(services: ServicesOf) -> LiveBoards:
    return services.get(LiveBoards)


BoardsOf = Annotated[LiveBoards, Depends(_boards)]


class PadEvent(BaseModel):
    """A score event on a judge's pad. `counts`: no other event strikes it. `by_name`: the sender's,
    empty where accounts are hidden; `by_link`: label of the problem whose judge's link it came by,
    null for an account."""

    id: UUID
    entry_id: UUID
    problem_id: UUID | None
    kind: Kind
    n: int | None
    hold: int | None
    plus: bool
    seconds: int | None
    target_id: UUID | None
    made_at: datetime
    by_name: str
    by_link: str | None
    counts: bool


class EventOut(PadEvent):
    """A score event. `seq`, `at`: its arrival at the server; `climbed_at`: `made_at` corrected by
    the error of the device's clock."""

    seq: int
    text: str
    device: str
    number: int
    climbed_at: datetime
    at: datetime


class EventPage(BaseModel):
    """A page of events in order; `next`: the cursor of the next page."""

    items: list[EventOut]
    next: int | None


class ProblemMark(MarkFields):
    """A competitor's mark on a problem, and its events."""

    entry_id: UUID
    events: list[EventOut]


class AppealOut(BaseModel):
    """An appeal and its decision (`n` 1: upheld), if there is one."""

    event: EventOut
    decision: EventOut | None


@router.put("/gyms/{gym}/competitions/{competition}/events/{event}")
def put_score_event(
    competition: UUID,
    event: UUID,
    body: EventBody,
    response: Response,
    services: ServicesOf,
    access: ClimberMay,
) -> EventOut:
    """Store a score event under an id that the device made, so that it is stored once. Judges score
    everybody; competitors score themselves if the competition lets them."""
    sender = Account(access.actor.known, access.role.covers(Role.JUDGE))
    # A whole hall writes: the transaction is as short as can be.
    with services.database.writing() as session:
        row = locked_competition(session, access.gym.id, competition)
        competition_of(session, access, competition)
        kept, is_new = store_event(session, row, event, body, sender)
    response.status_code = 201 if is_new else 200
    with services.database.reading() as session:
        return events_out(session, competition, [kept], about=not is_new)[0]


@router.get("/gyms/{gym}/competitions/{competition}/events")
def list_score_events(
    competition: UUID,
    session: Db,
    access: JudgeMay,
    after: Annotated[Digits, Query(ge=0, le=2_000_000_000)] = 0,
    size: Size = 100,
    entry: UUID | None = None,
    problem: UUID | None = None,
    kind: Kind | None = None,
) -> EventPage:
    """Return score events with their authors, in order of arrival."""
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
    return EventPage(items=events_out(session, row.id, found[:size]), next=following)


@router.get("/gyms/{gym}/competitions/{competition}/problems/{problem}/marks")
def list_marks(
    competition: UUID, problem: UUID, session: Db, access: JudgeMay
) -> list[ProblemMark]:
    """Return the competitors' marks on a problem."""
    row = competition_of(session, access, competition)
    here = select(Problem.id).join(Round, Round.id == Problem.round_id)
    if session.scalar(here.where(Problem.id == problem, Round.competition_id == row.id)) is None:
        raise NotFoundError("not-there-problem")
    return problem_marks(session, row, problem)


def problem_marks(session: Session, row: Competition, problem: UUID) -> list[ProblemMark]:
    """Return the competitors' marks on a problem of this competition."""
    of_problem = marks_of(session, row.id, ScoreEvent.problem_id == problem)
    found = [has for has in of_problem if has.problem == problem]
    ids = [event for has in found for event in has.events]
    rows = select(ScoreEvent).where(
        ScoreEvent.competition_id == row.id, ScoreEvent.problem_id == problem
    )
    wanted = set(ids)
    events = defaultdict[UUID, list[EventOut]](list)
    ordered = session.scalars(rows.order_by(ScoreEvent.seq)).all()
    for facts in events_out(session, row.id, [one for one in ordered if one.id in wanted]):
        events[facts.entry_id].append(facts)
    return [
        ProblemMark(
            entry_id=has.entry,
            **mark_fields(has.mark),
            events=events[has.entry],
        )
        for has in found
    ]


@router.get("/gyms/{gym}/competitions/{competition}/appeals")
def list_appeals(competition: UUID, session: Db, access: JudgeMay) -> list[AppealOut]:
    """Return appeals, the latest first, with their latest decisions."""
    row = competition_of(session, access, competition)
    kinds = ScoreEvent.kind.in_((Kind.APPEAL, Kind.DECISION))
    rows = select(ScoreEvent).where(ScoreEvent.competition_id == row.id, kinds)
    found = events_out(session, row.id, session.scalars(rows.order_by(ScoreEvent.seq)).all())
    decided = {
        event_out.target_id: event_out
        for event_out in found
        if event_out.kind == Kind.DECISION and event_out.counts
    }
    return [
        AppealOut(event=event_out, decision=decided.get(event_out.id))
        for event_out in reversed(found)
        if event_out.kind == Kind.APPEAL and event_out.counts
    ]


def events_out(
    session: Session, competition: UUID, events: Sequence[ScoreEvent], *, about: bool = True
) -> list[EventOut]:
    """Return messages of events; `about`: whether other events may refer to them already."""
    names = names_by_id(session, (event.person_id for event in events))
    links = link_names(session, {event.link_judge_id for event in events} - {None})
    ids = [event.id for event in events]
    gone = struck_events(session, competition, ids) if ids and about else set()
    return [
        EventOut.model_validate(
            {
                **{name: getattr(event, name) for name in _COLUMNS},
                "by_name": names.get(event.person_id, ""),
                **links.get(event.link_judge_id, {"by_link": None}),
                "counts": event.id not in gone,
            }
        )
        for event in events
    ]


_COLUMNS = [name for name in EventOut.model_fields if name not in ("by_name", "by_link", "counts")]

_WORDS: Final[dict[Language, dict[str, str]]] = {
    "en": {
        "rank": "#",
        "bib": "No.",
        "name": "Name",
        "team": "Team or club",
        "points": "Points",
        "out": "out",
        "frozen": "As it stood when the board was frozen.",
        "lacks": "The font of this page lacks letters (shown as ?): {scripts}.",
    },
    "de": {
        "rank": "#",
        "bib": "Nr.",
        "name": "Name",
        "team": "Team oder Verein",
        "points": "Punkte",
        "out": "raus",
        "frozen": "Stand von dem Moment, in dem die Tafel angehalten wurde.",
        "lacks": "Der Schrift dieser Seite fehlen Zeichen (als ? gedruckt): {scripts}.",
    },
    "cs": {
        "rank": "#",
        "bib": "Č.",
        "name": "Jméno",
        "team": "Tým nebo oddíl",
        "points": "Body",
        "out": "mimo",
        "frozen": "Stav z okamžiku, kdy byla tabule zmrazena.",
        "lacks": "V písmu této stránky chybí znaky (vytištěny jako ?): {scripts}.",
    },
    "fr": {
        "rank": "#",
        "bib": "N°",
        "name": "Nom",
        "team": "Équipe ou club",
        "points": "Points",
        "out": "NC",
        "frozen": "Tel qu’au moment où le classement a été figé.",
        "lacks": "Caractères absents de la police de cette page (imprimés « ? ») : {scripts}.",
    },
}


@dataclass(frozen=True)
class Order:
    """The comparison of two competitors: `before` is "first", "second", or "" for a shared or
    missing rank. `steps`: the compared criteria, down to the deciding one."""

    first: UUID
    second: UUID
    before: Literal["first", "second", ""]
    steps: list[Step]


class ResultsPaper(Response):
    media_type = "application/pdf"


# A board of the past is computed from all events; a request for one waits for its turn.
_PastTurn = Annotated[None, turn_for("past-board", when=lambda req: "at" in req.query_params)]


@router.get("/gyms/{gym}/competitions/{competition}/board", response_model=BoardView)
def read_competition_board(
    competition: UUID,
    request: Request,
    _: _PastTurn,
    session: Db,
    access: GuestMay,
    boards: BoardsOf,
    category: UUID | None = None,
    at: Annotated[Moment | None, Query(description="as it stood then")] = None,
) -> Any:
    """Return the board; while it is frozen, only judges see later results."""
    row = competition_of(session, access, competition)
    public = not access.role.covers(Role.JUDGE)
    if at is None:
        view = boards.view(session, row, public=public)
    else:
        view = boards.board_at(session, row, at, public=public)
    tag = f'"{view.revision}-{view.seq}-{int(view.frozen_at is not None)}"'
    headers = {"etag": tag} if at is None else {}
    if at is None and request.headers.get("if-none-match") == tag:
        return Response(status_code=304, headers=headers)
    if category is not None:
        kept = [one for one in view.categories if one.id == category]
        view = BoardView(**{**_fields(view), "categories": kept})
    return Response(msgspec.json.encode(view), media_type="application/json", headers=headers)


@router.get("/gyms/{gym}/competitions/{competition}/board/why")
def explain_order(
    competition: UUID, first: UUID, second: UUID, session: Db, access: GuestMay, boards: BoardsOf
) -> Order:
    """Explain the order of two competitors."""
    row = competition_of(session, access, competition)
    public = not access.role.covers(Role.JUDGE)
    steps, ranks = boards.compare(session, row, first, second, public=public)
    before: Literal["first", "second", ""] = ""
    if steps and steps[-1].decides:
        before = "first" if (ranks[first] or 0) < (ranks[second] or 0) else "second"
    return Order(first, second, before, steps)


@dataclass(frozen=True)
class _Watched:
    """A board that the viewer may see."""

    competition: UUID
    public: bool


def _to_watch(competition: UUID, session: Db, access: GuestMay) -> _Watched:
    """Look the competition up before the response begins, because a stream cannot answer 404."""
    row = competition_of(session, access, competition)
    return _Watched(row.id, not access.role.covers(Role.JUDGE))


@router.get(
    "/gyms/{gym}/competitions/{competition}/board/events", response_class=EventSourceResponse
)
async def watch_competition_board(
    boards: BoardsOf, watched: Annotated[_Watched, Depends(_to_watch)]
) -> AsyncIterator[ServerSentEvent]:
    """Stream the board and then its changes, a few times a second at most, until the competition
    stops running."""
    async for news in boards.watch(watched.competition, public=watched.public):
        yield ServerSentEvent(raw_data=news)


@router.get("/gyms/{gym}/competitions/{competition}/results.csv", response_class=CsvFile)
def read_results_table(
    competition: UUID, session: Db, access: GuestMay, boards: BoardsOf, dialect: CsvDialectOf
) -> CsvFile:
    """Return the board as CSV, a line per competitor."""
    row = competition_of(session, access, competition)
    view = boards.view(session, row, public=not access.role.covers(Role.JUDGE))
    return CsvFile.of("results", results_csv(view, dialect))


@router.get("/gyms/{gym}/competitions/{competition}/results.pdf", response_class=ResultsPaper)
def read_results_paper(
    competition: UUID,
    request: Request,
    _: DocumentTurn,
    session: Db,
    access: GuestMay,
    boards: BoardsOf,
    language: Language = "en",
    size: Literal["a4", "letter"] = "a4",
) -> Response:
    """Return the board as PDF."""
    row = competition_of(session, access, competition)
    view = boards.view(session, row, public=not access.role.covers(Role.JUDGE))
    begins = row.starts_at or row.created_at
    when = f"{begins.astimezone(ZoneInfo(access.gym.time_zone)):%Y-%m-%d}"
    content, missing = results_pdf(view, access.gym.name, when, _WORDS[language], size)
    return document_response(
        request, content, "application/pdf", "results.pdf", shown=True, missing=missing
    )


def _fields(view: BoardView) -> dict[str, Any]:
    return {name: getattr(view, name) for name in BoardView.__dataclass_fields__}
