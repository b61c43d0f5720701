"""Endpoints of the screen in the hall: content, settings, and the link that opens it."""

from __future__ import annotations

from datetime import date, datetime
from typing import Annotated, Final
from uuid import UUID

from fastapi import APIRouter, Path, Response
from pydantic import BaseModel, Field
from sqlalchemy import select

from walltopo_gym.accounts.access import BrowserMay
from walltopo_gym.api.fields import Body, Secret
from walltopo_gym.api.services import Db, ServicesOf
from walltopo_gym.errors import NotFoundError
from walltopo_gym.gyms.access import GuestMay, OwnerMay, SetterMay
from walltopo_gym.gyms.lookup import gym_by_slug
from walltopo_gym.gyms.models import Gym
from walltopo_gym.hall.coming import climbers_today, planned_dates
from walltopo_gym.hall.models import HallSettings
from walltopo_gym.hall.screen import (
    KIOSK,
    Part,
    drop_key,
    has_key,
    new_key,
    public_board,
    settings_of,
)
from walltopo_gym.publishing.new_routes import new_routes
from walltopo_gym.walls.models import Wall

router = APIRouter(tags=["hall"])

_LINES: Final = 10
_ROUTES: Final = 60
_DATES: Final = 8
_KEY_S: Final = 400 * 86400  # as long as browsers keep a cookie


class HallIn(Body):
    """The screen's settings: `parts` in order, each for `seconds`. Routes are new for `days`.
    `board`: the screen shows the people who agreed to it."""

    parts: Annotated[list[Part], Field(min_length=1, max_length=5)]
    seconds: int = Field(ge=5, le=600)
    days: int = Field(ge=1, le=90)
    board: bool


class HallOut(BaseModel):
    """The screen's settings; `key_made_at`: creation time of the link to a private gym's screen."""

    parts: list[Part]
    seconds: int
    days: int
    board: bool
    key_made_at: datetime | None


class HallKey(BaseModel):
    """A link to the screen, shown once."""

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
    """A wall on the screen."""

    id: UUID
    name: str
    scan_id: UUID


class ScreenLine(BaseModel):
    """A place on this month's board, of people who agreed to be public."""

    rank: int
    name: str
    points: int


class ScreenDate(BaseModel):
    """A date: `kind` "reset", "strip" (of `number` routes) or "competition"; a day or a moment."""

    kind: str
    id: str
    day: date | None
    moment: datetime | None
    name: str
    number: int
    path: str


class ScreenOut(BaseModel):
    """The content of the screen. `climbers`: number of climbers today, null below five; `board`:
    null if the gym shows none."""

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
def read_screen(session: Db, access: GuestMay) -> ScreenOut:
    """Return the current content of the hall screen."""
    gym = session.get_one(Gym, access.gym.id)
    chosen = settings_of(session, gym.id)
    walls = session.scalars(
        select(Wall)
        .where(Wall.gym_id == gym.id, Wall.published_scan_id.is_not(None))
        .order_by(Wall.place, Wall.name)
    )
    lines = public_board(session, gym, _LINES)
    dates = []
    for each in planned_dates(session, gym)[:_DATES]:
        is_moment = isinstance(each.at, datetime)
        dates.append(
            ScreenDate(
                kind=each.kind,
                id=each.id,
                day=None if is_moment else each.at,
                moment=each.at if isinstance(each.at, datetime) else None,
                name=each.name,
                number=each.number,
                path=each.path,
            )
        )
    return ScreenOut(
        name=gym.name,
        **_hall_out(chosen).model_dump(include={"parts", "seconds", "days"}),
        routes=[
            ScreenRoute.model_validate(route, from_attributes=True)
            for route in new_routes(session, gym, chosen.days)[:_ROUTES]
        ],
        walls=[
            ScreenWall(id=wall.id, name=wall.name, scan_id=wall.published_scan_id)
            for wall in walls
            if wall.published_scan_id is not None
        ],
        climbers=climbers_today(session, gym),
        board=None
        if lines is None
        else [ScreenLine(rank=line.rank, name=line.name, points=line.points) for line in lines],
        dates=dates,
    )


@router.get("/gyms/{gym}/hall")
def read_hall(session: Db, access: SetterMay) -> HallOut:
    """Return the screen's settings."""
    return _hall_out(settings_of(session, access.gym.id))


@router.put("/gyms/{gym}/hall")
def put_hall(body: HallIn, session: Db, access: OwnerMay) -> HallOut:
    """Change the screen's settings."""
    row = session.merge(settings_of(session, access.gym.id))
    row.parts = list(dict.fromkeys(body.parts))
    row.seconds, row.days, row.board = body.seconds, body.days, body.board
    access.log_change(session, "hall.change", access.gym.slug)
    return _hall_out(row)


@router.post("/gyms/{gym}/hall/key", status_code=201)
def make_hall_key(session: Db, services: ServicesOf, access: OwnerMay) -> HallKey:
    """Create a new link to a private gym's screen; the earlier link is void."""
    secret = new_key(session, access.gym.id)
    access.log_change(session, "hall.key", access.gym.slug)
    return HallKey(link=f"{services.settings.link_base}/kiosk/g/{access.gym.slug}#{secret}")


@router.delete("/gyms/{gym}/hall/key", status_code=204)
def drop_hall_key(session: Db, access: OwnerMay) -> None:
    """Revoke the link; screens that it opened go blank."""
    drop_key(session, access.gym.id)
    access.log_change(session, "hall.no-key", access.gym.slug)


@router.post("/gyms/{gym}/screen/open", status_code=204)
def open_screen(
    gym: Annotated[str, Path(max_length=60)],
    body: HallSecret,
    session: Db,
    response: Response,
    actor: BrowserMay,
) -> None:
    """Open a private gym's screen in this anonymous browser."""
    row = gym_by_slug(session, gym)
    if row is None or not has_key(session, row.id, body.secret):
        raise NotFoundError("screen-link-unknown", "ask-the-gym-new")
    response.set_cookie(
        KIOSK, body.secret, max_age=_KEY_S, path="/", secure=True, httponly=True, samesite="lax"
    )


def _hall_out(row: HallSettings) -> HallOut:
    return HallOut.model_validate(row, from_attributes=True)
