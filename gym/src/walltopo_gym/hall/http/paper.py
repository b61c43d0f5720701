"""Endpoints of posters, cards, calendar and new-route feed."""

from __future__ import annotations

from datetime import timedelta
from typing import Annotated, Literal
from uuid import UUID

from fastapi import APIRouter, Query, Request, Response
from pydantic import BaseModel
from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.access import AnyoneMay
from walltopo_gym.accounts.limits import count_document
from walltopo_gym.api.documents import DocumentTurn, document_response
from walltopo_gym.api.fields import Digits, Text
from walltopo_gym.api.services import Db, ServicesOf
from walltopo_gym.errors import NotFoundError
from walltopo_gym.gyms.access import Access, GuestMay, SetterMay, visible_gym
from walltopo_gym.gyms.days import today
from walltopo_gym.gyms.models import Gym
from walltopo_gym.hall.cards import CardPaper, Cards, CardSize
from walltopo_gym.hall.coming import planned_dates
from walltopo_gym.hall.feeds import atom, calendar
from walltopo_gym.hall.poster import Poster
from walltopo_gym.hall.screen import settings_of
from walltopo_gym.languages import Language
from walltopo_gym.publishing.codes import route_by_code
from walltopo_gym.publishing.models import Route
from walltopo_gym.publishing.new_routes import new_routes
from walltopo_gym.publishing.versions import gym_routes
from walltopo_gym.scans.pictures import wall_picture
from walltopo_gym.storage.files import FileStore
from walltopo_gym.walls.lookup import walls_of
from walltopo_gym.walls.models import Wall
from walltopo_gym.words import words_in

router = APIRouter(tags=["hall"])

_PDF = "application/pdf"
Days = Annotated[Digits, Query(ge=1, le=90)]
Code = Annotated[str, Query(max_length=20)]


def _media_response(*kinds: str) -> dict[int | str, dict[str, object]]:
    """Return the OpenAPI response of a media type other than JSON."""
    text = {"schema": {"type": "string", "format": "binary"}}
    return {200: {"content": dict.fromkeys(kinds, text)}}


class ShortLink(BaseModel):
    """The route that a short address leads to."""

    gym: str
    wall_id: UUID
    route_id: UUID


@router.get("/gyms/{gym}/poster.pdf", response_class=Response, responses=_media_response(_PDF))
def read_poster(
    request: Request,
    services: ServicesOf,
    _: DocumentTurn,
    access: SetterMay,
    days: Days = 7,
    language: Language = "en",
    size: Literal["a3", "a4", "letter", "tabloid"] = "a4",
) -> Response:
    """Return a poster of new routes: each wall with its picture and a code that leads there."""
    _count(services, access)
    with services.database.reading() as session:
        gym = session.get_one(Gym, access.gym.id)
        routes = new_routes(session, gym, days)
        day = today(gym)
        walls = walls_of(session, gym.id)
    by_wall = [(wall, [r for r in routes if r.wall_id == wall.id]) for wall in walls]
    poster = Poster(
        gym,
        [(wall, new) for wall, new in by_wall if new],
        day - timedelta(days=days - 1),
        day,
        lambda scan: _find_picture(services.store, scan),
        services.settings.link_base,
    )
    sheet = poster.draw(words_in(language), size)
    content = sheet.pdf()
    name = f"{gym.slug}-{day}.pdf"
    return document_response(request, content, _PDF, name, shown=True, missing=sheet.missing)


@router.get("/gyms/{gym}/cards.pdf", response_class=Response, responses=_media_response(_PDF))
def read_cards(
    request: Request,
    services: ServicesOf,
    _: DocumentTurn,
    access: SetterMay,
    size: CardSize = "a6",
    language: Language = "en",
    wall: UUID | None = None,
    days: Annotated[Digits, Query(ge=0, le=90, description="new for at most so long; 0: all")] = 0,
    text: Text = "",
    paper: CardPaper = "a4",
) -> Response:
    """Return route cards, several on a sheet, with lines to cut along. Their sizes are those on
    A4."""
    _count(services, access)
    with services.database.reading() as session:
        gym = session.get_one(Gym, access.gym.id)
        if days:
            routes = new_routes(session, gym, days, wall)
        else:
            current = gym_routes(session, gym.id)
            routes = [route for route, _ in current if wall in (None, route.wall_id)]
    if not routes:
        raise NotFoundError("cards-none")
    cards = Cards(routes, gym.name, text, services.settings.link_base)
    content, missing = cards.pdf(words_in(language), size, paper)
    return document_response(
        request, content, _PDF, f"{gym.slug}-cards-{size}.pdf", shown=True, missing=missing
    )


@router.get(
    "/gyms/{gym}/calendar.ics", response_class=Response, responses=_media_response("text/calendar")
)
def read_calendar(
    request: Request,
    session: Db,
    services: ServicesOf,
    access: GuestMay,
    language: Language = "en",
) -> Response:
    """Return the calendar for subscriptions: resets, strippings, competitions."""
    gym = session.get_one(Gym, access.gym.id)
    base = services.settings.link_base
    dates = planned_dates(session, gym)
    content = calendar(gym, dates, words_in(language), base)
    return document_response(request, content, "text/calendar", f"{gym.slug}.ics", shown=True)


@router.get(
    "/gyms/{gym}/new-routes.atom",
    response_class=Response,
    responses=_media_response("application/atom+xml"),
)
def read_new_routes(
    request: Request,
    session: Db,
    services: ServicesOf,
    access: GuestMay,
    language: Language = "en",
) -> Response:
    """Return the Atom feed of the gym's new routes."""
    gym = session.get_one(Gym, access.gym.id)
    base = services.settings.link_base
    routes: list[Route] = new_routes(session, gym, settings_of(session, gym.id).days)[:200]
    walls = _wall_names(session, gym)
    own = f"{base}{request.url.path}"
    content = atom(gym, routes, walls, words_in(language), base, own)
    return document_response(
        request, content, "application/atom+xml", f"{gym.slug}.atom", shown=True
    )


@router.get("/short/{code}")
def read_short_link(code: str, session: Db, request: Request, actor: AnyoneMay) -> ShortLink:
    """Return the target of a route's short address, from a tag or a card."""
    gym, route = route_by_code(session, code)
    try:
        visible_gym(session, gym.slug, actor, request)
    except NotFoundError as error:
        raise NotFoundError("short-link-unknown") from error
    return ShortLink(gym=gym.slug, wall_id=route.wall_id, route_id=route.id)


def _wall_names(session: Session, gym: Gym) -> dict[object, str]:
    return {wall.id: wall.name for wall in session.scalars(select(Wall).filter_by(gym_id=gym.id))}


def _find_picture(store: FileStore, scan: UUID) -> bytes | None:
    try:
        return wall_picture(store, scan)
    except NotFoundError:
        return None


def _count(services: ServicesOf, access: Access) -> None:
    with services.database.writing() as session:
        count_document(session, access.actor.known)
