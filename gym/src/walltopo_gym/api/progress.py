"""One's progress in a gym, as JSON and as tables."""

from __future__ import annotations

from dataclasses import asdict
from datetime import date
from typing import Annotated, Literal

from fastapi import APIRouter
from pydantic import BaseModel
from starlette.responses import PlainTextResponse

from walltopo_gym.accounts.actor import Scope
from walltopo_gym.api.rules import Access, gym_rule
from walltopo_gym.api.services import Db
from walltopo_gym.climbing.progress import progress
from walltopo_gym.clock import now
from walltopo_gym.gyms.roles import Role
from walltopo_gym.spreadsheets import csv_table

router = APIRouter(tags=["progress"])

ReaderMay = Annotated[Access, gym_rule(Role.MEMBER, Scope.READ)]
Part = Literal["grades", "months", "weeks", "hanging", "steepness", "holds"]


class OfGradeFacts(BaseModel):
    """Routes of one grade that were topped, each once; `worth`: points of a top."""

    grade: str
    worth: int
    routes: int
    flashes: int


class MonthFacts(BaseModel):
    """A month, such as "2026-03"; each route once in it."""

    month: str
    hardest: str
    hardest_worth: int
    routes: int
    flashes: int


class WeekFacts(BaseModel):
    """A week from its Monday on."""

    begins: date
    sessions: int
    ascents: int
    tops: int
    points: int


class HangingFacts(BaseModel):
    """Of the routes of one grade that hang now: how many one has topped."""

    system: str
    grade: str
    colour: str
    done: int
    of: int


class StyleFacts(BaseModel):
    """Routes of one steepness, or with most holds of one type; each once."""

    kind: str
    tried: int
    topped: int
    flashed: int


class ProgressFacts(BaseModel):
    """All of it; `streak` and `longest` are weeks in a row with a session."""

    sessions: int
    ascents: int
    tries: int
    routes: int
    flashes: int
    streak: int
    longest: int
    grades: list[OfGradeFacts]
    months: list[MonthFacts]
    weeks: list[WeekFacts]
    hanging: list[HangingFacts]
    steepness: list[StyleFacts]
    holds: list[StyleFacts]


@router.get("/gyms/{gym}/progress")
def read_progress(session: Db, access: ReaderMay) -> ProgressFacts:
    """How one gets on in this gym."""
    return ProgressFacts(**asdict(progress(session, access.gym, access.actor.known, now())))


@router.get("/gyms/{gym}/progress/{part}.csv", response_class=PlainTextResponse)
def read_progress_table(part: Part, session: Db, access: ReaderMay) -> PlainTextResponse:
    """A part of it as a table."""
    told = asdict(progress(session, access.gym, access.actor.known, now()))
    headers = {"content-disposition": f'attachment; filename="{part}.csv"'}
    kinds: dict[Part, type[BaseModel]] = {
        "grades": OfGradeFacts,
        "months": MonthFacts,
        "weeks": WeekFacts,
        "hanging": HangingFacts,
        "steepness": StyleFacts,
        "holds": StyleFacts,
    }
    table = csv_table(list(kinds[part].model_fields), told[part])
    return PlainTextResponse(table, headers=headers, media_type="text/csv")
