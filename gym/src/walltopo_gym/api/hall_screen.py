"""The screen in the hall: what it shows, what is chosen of that, and who may open it."""

from __future__ import annotations

from datetime import date, datetime
from typing import Annotated, Final
from uuid import UUID

from fastapi import APIRouter, Path, Response
from pydantic import BaseModel, Field
from sqlalchemy import select

from walltopo_gym.accounts.audit import log_change
from walltopo_gym.api.fields import Body, Secret
from walltopo_gym.api.rules import KIOSK, AnyoneMay, GuestMay, OwnerMay, SetterMay
from walltopo_gym.api.services import Db, ServicesOf
from walltopo_gym.errors import NotFoundError
from walltopo_gym.gyms.models import Gym, Wall
from walltopo_gym.hall.fresh import climbers_today, coming, fresh
from walltopo_gym.hall.models import HallSettings
from walltopo_gym.hall.screen import (
    Part,
    drop_key,
    has_key,
    new_key,
    public_board,
    settings_of,
)

router = APIRouter(tags=["hall"])

_LINES: Final = 10
_ROUTES: Final = 60
_DATES: Final = 8
_KEY_S: Final = 400 * 86400  # as long as browsers keep a cookie


class HallWords(Body):
    """What the screen shows: `parts` in their order, each for `seconds`. Routes are new for `days`.
    `board`: who agreed to it is shown to everybody."""

    parts: Annotated[list[Part], Field(min_length=1, max_length=5)]
    seconds: int = Field(ge=5, le=600)
    days: int = Field(ge=1, le=90)
    board: bool


class HallFacts(BaseModel):
    """The same; `key_made_at`: since when there is a link that opens a private gym's screen."""

    parts: list[Part]
    seconds: int
    days: int
    board: bool
    key_made_at: datetime | None


class HallKey(BaseModel):
    """A link to the screen, told this once."""

    link: str


class HallSecret(Body):
    secret: Secret


class ScreenRoute(BaseModel):
    """A new route."""

    id: UUID
    wall_id: UUID
    name: str
    colour: str
    grade: str
    setter: str
    set_on: date


class ScreenWall(BaseModel):
    """A wall that can be shown."""

    id: UUID
    name: str
    scan_id: UUID


class ScreenLine(BaseModel):
    """A place on the board of this month, of those who agreed that everybody sees it."""

    rank: int
    name: str
    points: int


class ScreenDate(BaseModel):
    """What happens: `kind` "reset", "strip" (`number` routes go) or "competition"; a day, or a
    moment of it."""

    kind: str
    id: str
    day: date | None
    moment: datetime | None
    name: str
    number: int
    path: str


class ScreenFacts(BaseModel):
    """All that a screen shows. `climbers`: how many climb there today, null below five; `board`:
    null where the gym shows none."""

    name: str
    parts: list[Part]
    seconds: int
    days: int
    routes: list[ScreenRoute]
    walls: list[ScreenWall]
    climbers: int | None
    board: list[ScreenLine] | None
    dates: list[ScreenDate]


@router.get("/gyms/{gym}/screen")
def read_screen(session: Db, access: GuestMay) -> ScreenFacts:
    """What the screen in the hall shows now."""
    gym = session.get_one(Gym, access.gym.id)
    chosen = settings_of(session, gym.id)
    walls = session.scalars(
        select(Wall)
        .where(Wall.gym_id == gym.id, Wall.published_scan_id.is_not(None))
        .order_by(Wall.place, Wall.name)
    )
    lines = public_board(session, gym, _LINES)
    dates = []
    for each in coming(session, gym)[:_DATES]:
        is_moment = isinstance(each.at, datetime)
        dates.append(ScreenDate(
            kind=each.kind, id=each.id, day=None if is_moment else each.at,
            moment=each.at if isinstance(each.at, datetime) else None, name=each.name,
            number=each.number, path=each.path,
        ))  # fmt: skip
    return ScreenFacts(
        name=gym.name,
        **_facts(chosen).model_dump(include={"parts", "seconds", "days"}),
        routes=[
            ScreenRoute.model_validate(route, from_attributes=True)
            for route in fresh(session, gym, chosen.days)[:_ROUTES]
        ],
        walls=[
            ScreenWall(id=wall.id, name=wall.name, scan_id=wall.published_scan_id)
            for wall in walls
            if wall.published_scan_id is not None
        ],
        climbers=climbers_today(session, gym),
        board=None if lines is None else [
            ScreenLine(rank=line.rank, name=line.name, points=line.points) for line in lines
        ],
        dates=dates,
    )  # fmt: skip


@router.get("/gyms/{gym}/hall")
def read_hall(session: Db, access: SetterMay) -> HallFacts:
    """What is chosen for the screen."""
    return _facts(settings_of(session, access.gym.id))


@router.put("/gyms/{gym}/hall")
def put_hall(body: HallWords, session: Db, access: OwnerMay) -> HallFacts:
    """Choose what the screen shows."""
    row = session.merge(settings_of(session, access.gym.id))
    row.parts = list(dict.fromkeys(body.parts))
    row.seconds, row.days, row.board = body.seconds, body.days, body.board
    _log(session, access, "hall.change")
    return _facts(row)


@router.post("/gyms/{gym}/hall/key", status_code=201)
def make_hall_key(session: Db, services: ServicesOf, access: OwnerMay) -> HallKey:
    """A new link that opens the screen of a private gym; the one before opens it no more."""
    secret = new_key(session, access.gym.id)
    _log(session, access, "hall.key")
    return HallKey(link=f"{services.settings.link_base}/kiosk/g/{access.gym.slug}#{secret}")


@router.delete("/gyms/{gym}/hall/key", status_code=204)
def drop_hall_key(session: Db, access: OwnerMay) -> None:
    """Take the link back; screens that were opened by it show nothing more."""
    drop_key(session, access.gym.id)
    _log(session, access, "hall.no-key")


@router.post("/gyms/{gym}/screen/open", status_code=204)
def open_screen(
    gym: Annotated[str, Path(max_length=60)], body: HallSecret, session: Db, response: Response,
    actor: AnyoneMay,
) -> None:  # fmt: skip
    """Let this browser, in which nobody is signed in, be the screen of a private gym."""
    row = session.scalar(select(Gym).where(Gym.slug == gym))
    if row is None or not has_key(session, row.id, body.secret):
        raise NotFoundError("this link opens no screen", "Ask the gym for a new one.")
    response.set_cookie(
        KIOSK, body.secret, max_age=_KEY_S, path="/", secure=True, httponly=True, samesite="lax"
    )


def _facts(row: HallSettings) -> HallFacts:
    return HallFacts.model_validate(row, from_attributes=True)


def _log(session: Db, access: OwnerMay, action: str) -> None:
    log_change(session, action, person=access.actor.known, gym=access.gym.id,
               subject=access.gym.slug)  # fmt: skip
