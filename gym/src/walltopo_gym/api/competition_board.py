"""The board of a competition: now, as it was, live, and as a table or on paper."""

from __future__ import annotations

from collections.abc import AsyncIterator
from dataclasses import dataclass
from datetime import datetime
from typing import Annotated, Any, Final, Literal
from uuid import UUID
from zoneinfo import ZoneInfo

import msgspec
from fastapi import APIRouter, Depends, Query, Request, Response
from fastapi.sse import EventSourceResponse, ServerSentEvent
from sqlalchemy.orm import Session

from walltopo_gym.api.competitions import competition_of
from walltopo_gym.api.fields import Moment
from walltopo_gym.api.rules import GuestMay
from walltopo_gym.api.services import BoardsOf, Db
from walltopo_gym.competitions.board import Board
from walltopo_gym.competitions.history import board_of
from walltopo_gym.competitions.models import Competition
from walltopo_gym.competitions.ranking import Step
from walltopo_gym.competitions.tables import results_csv, results_pdf
from walltopo_gym.competitions.told import BoardTold
from walltopo_gym.gyms.roles import Role
from walltopo_gym.languages import Language

router = APIRouter(tags=["competitions"])

_WORDS: Final[dict[Language, dict[str, str]]] = {
    "en": {"rank": "#", "bib": "No.", "name": "Name", "team": "Team or club", "points": "Points",
           "out": "out", "frozen": "As it stood when the board was frozen."},
    "de": {"rank": "#", "bib": "Nr.", "name": "Name", "team": "Team oder Verein",
           "points": "Punkte", "out": "raus",
           "frozen": "Stand von dem Moment, in dem die Tafel angehalten wurde."},
    "cs": {"rank": "#", "bib": "Č.", "name": "Jméno", "team": "Tým nebo oddíl", "points": "Body",
           "out": "mimo", "frozen": "Stav z okamžiku, kdy byla tabule zmrazena."},
    "fr": {"rank": "#", "bib": "N°", "name": "Nom", "team": "Équipe ou club", "points": "Points",
           "out": "NC", "frozen": "Tel qu’au moment où le classement a été figé."},
}  # fmt: skip


@dataclass(frozen=True)
class Order:
    """Why one stands before another: `before` is "first", "second", or "" where they share a rank
    or one has none. `steps`: what they were compared by, down to what decides."""

    first: UUID
    second: UUID
    before: Literal["first", "second", ""]
    steps: list[Step]


class ResultsPaper(Response):
    media_type = "application/pdf"


class ResultsTable(Response):
    media_type = "text/csv"


@router.get("/gyms/{gym}/competitions/{competition}/board", response_model=BoardTold)
def read_competition_board(
    competition: UUID, request: Request, session: Db, access: GuestMay, boards: BoardsOf,
    category: UUID | None = None,
    at: Annotated[Moment | None, Query(description="as it stood then")] = None,
) -> Any:  # fmt: skip
    """Who stands where. While the board is frozen all but judges see it as it was then."""
    row = competition_of(session, access, competition)
    public = not access.role.covers(Role.JUDGE)
    if at is None:
        told = boards.told(session, row, public=public)
    else:
        told = _replayed(session, row, at, public=public).told()
    tag = f'"{told.revision}-{told.seq}-{int(told.frozen_at is not None)}"'
    headers = {"etag": tag} if at is None else {}
    if at is None and request.headers.get("if-none-match") == tag:
        return Response(status_code=304, headers=headers)
    if category is not None:
        kept = [one for one in told.categories if one.id == category]
        told = BoardTold(**{**_fields(told), "categories": kept})
    return Response(msgspec.json.encode(told), media_type="application/json", headers=headers)


@router.get("/gyms/{gym}/competitions/{competition}/board/why")
def explain_order(
    competition: UUID, first: UUID, second: UUID, session: Db, access: GuestMay
) -> Order:
    """Why one stands before another, or shares a rank with them."""
    row = competition_of(session, access, competition)
    public = not access.role.covers(Role.JUDGE)
    frozen = row.frozen_at if public else None
    board = board_of(session, row, frozen)
    steps = board.why(first, second)
    before: Literal["first", "second", ""] = ""
    if steps and steps[-1].decides:
        lines = [line for of in board.lines().values() for line in of]
        ranks = {line.entry_id: line.rank or 0 for line in lines}
        before = "first" if ranks[first] < ranks[second] else "second"
    return Order(first, second, before, steps)


@dataclass(frozen=True)
class _Watched:
    """A board that somebody may see."""

    competition: UUID
    public: bool


def _to_watch(competition: UUID, session: Db, access: GuestMay) -> _Watched:
    """Looked up before the answer begins: after that none could say that it is not there."""
    row = competition_of(session, access, competition)
    return _Watched(row.id, not access.role.covers(Role.JUDGE))


@router.get(
    "/gyms/{gym}/competitions/{competition}/board/events", response_class=EventSourceResponse
)
async def watch_competition_board(
    boards: BoardsOf, watched: Annotated[_Watched, Depends(_to_watch)]
) -> AsyncIterator[ServerSentEvent]:
    """The board, then what is otherwise in it, some times a second at most; ends when the
    competition does not run."""
    async for news in boards.watch(watched.competition, public=watched.public):
        yield ServerSentEvent(raw_data=news)


@router.get("/gyms/{gym}/competitions/{competition}/results.csv", response_class=ResultsTable)
def read_results_table(
    competition: UUID, session: Db, access: GuestMay, boards: BoardsOf
) -> ResultsTable:
    """The board as a table, a line each competitor."""
    row = competition_of(session, access, competition)
    told = boards.told(session, row, public=not access.role.covers(Role.JUDGE))
    name = {"content-disposition": 'attachment; filename="results.csv"'}
    return ResultsTable(results_csv(told), headers=name)


@router.get("/gyms/{gym}/competitions/{competition}/results.pdf", response_class=ResultsPaper)
def read_results_paper(
    competition: UUID, session: Db, access: GuestMay, boards: BoardsOf,
    language: Language = "en",
) -> ResultsPaper:  # fmt: skip
    """The board on pages to print."""
    row = competition_of(session, access, competition)
    told = boards.told(session, row, public=not access.role.covers(Role.JUDGE))
    begins = row.starts_at or row.created_at
    when = f"{begins.astimezone(ZoneInfo(access.gym.time_zone)):%Y-%m-%d}"
    content = results_pdf(told, access.gym.name, when, _WORDS[language])
    return ResultsPaper(content, headers={"content-disposition": 'inline; filename="results.pdf"'})


def _replayed(session: Session, row: Competition, at: datetime, *, public: bool) -> Board:
    """The board of a moment; for the public of none after the freezing."""
    frozen = row.frozen_at if public else None
    return board_of(session, row, at if frozen is None else min(at, frozen))


def _fields(told: BoardTold) -> dict[str, Any]:
    return {name: getattr(told, name) for name in BoardTold.__dataclass_fields__}
