"""Leaderboards of a gym."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated, Literal
from uuid import UUID

from fastapi import APIRouter, Query
from pydantic import BaseModel

from walltopo_gym.accounts.actor import Scope
from walltopo_gym.accounts.profiles import profile_of
from walltopo_gym.api.rules import Access, gym_rule
from walltopo_gym.api.services import Db
from walltopo_gym.climbing.boards import Age, Asked, board, circuits, month_of
from walltopo_gym.climbing.points import BEST, FLASH
from walltopo_gym.clock import now
from walltopo_gym.errors import NotFoundError
from walltopo_gym.gyms.models import Gym
from walltopo_gym.gyms.roles import Role

router = APIRouter(tags=["boards"])

ReaderMay = Annotated[Access, gym_rule(Role.MEMBER, Scope.READ)]


class LineFacts(BaseModel):
    """A place on a board; equal points are an equal rank (1, 2, 2, 4)."""

    rank: int
    person_id: UUID
    name: str
    points: int
    tops: int
    flashes: int


class CircuitFacts(BaseModel):
    """A circuit that has a board of its own."""

    label: str
    colour: str


class BoardFacts(BaseModel):
    """Some lines of a board, `of` how many. `own` is one's own place, or the place that one would
    have; `shown`: others see one on boards. `best`, `flash`: of the rule of points."""

    period: str
    lines: list[LineFacts]
    of: int
    own: LineFacts | None
    shown: bool
    categories: bool
    circuits: list[CircuitFacts]
    best: int
    flash: int


@router.get("/gyms/{gym}/board")
def read_board(
    session: Db, access: ReaderMay,
    period: Annotated[str, Query(
        pattern=r"^(\d{4}(-(0[1-9]|1[0-2]))?|all)?$",
        description='"2026-03", "2026" or "all"; empty: this month')] = "",
    circuit: Annotated[str, Query(max_length=80)] = "",
    category: Literal["", "women", "men", "other"] = "",
    age: Age = "",
    friends: bool = False,
    size: Annotated[int, Query(ge=1, le=200)] = 50,
    skip: Annotated[int, Query(ge=0, le=1_000_000)] = 0,
) -> BoardFacts:  # fmt: skip
    """Who has most points: the sum of the best ten routes of a period, of those who want to be
    seen there."""
    gym = session.get_one(Gym, access.gym.id)
    if gym.boards == "off":
        raise NotFoundError("this gym has no board")
    if gym.boards != "categories":
        category, age = "", ""
    me, at = access.actor.known, now()
    asked = Asked(period or month_of(gym, at), circuit, category, age, me if friends else None)
    told = board(session, gym, asked, me, at, size, skip)
    return BoardFacts(
        period=asked.period,
        lines=[LineFacts(**asdict(line)) for line in told.lines],
        of=told.of,
        own=None if told.own is None else LineFacts(**asdict(told.own)),
        shown=profile_of(session, me).on_boards,
        categories=gym.boards == "categories",
        circuits=[CircuitFacts(**circuit) for circuit in circuits(session, gym)],
        best=BEST,
        flash=FLASH,
    )
