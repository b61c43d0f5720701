"""Endpoints of films of clips, and of reports on them."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any
from uuid import UUID

from fastapi import APIRouter, Header
from pydantic import BaseModel
from sqlalchemy import Select, select
from starlette.responses import StreamingResponse

from walltopo_gym.accounts.limits import count_report
from walltopo_gym.accounts.models import Person
from walltopo_gym.api.fields import Body, Complaint
from walltopo_gym.api.paging import Cursor, Page, Size, page_by
from walltopo_gym.api.ranges import ranged_file
from walltopo_gym.api.services import Db, ServicesOf
from walltopo_gym.clips.films import (
    MIN_AGE,
    check_films,
    film_of,
    publish_film,
    published_films,
    remove_film,
)
from walltopo_gym.clips.http.uploads import ClimberMay
from walltopo_gym.clips.models import Clip, FilmReport
from walltopo_gym.clips.service import attempt_in, clip_of
from walltopo_gym.errors import ForbiddenError, NotFoundError
from walltopo_gym.gyms.access import GuestMay, SetterMay
from walltopo_gym.gyms.roles import Role
from walltopo_gym.publishing.models import Route
from walltopo_gym.publishing.versions import route_of
from walltopo_gym.walls.models import Wall

router = APIRouter(tags=["clips"])


class FilmOut(BaseModel):
    """A published film of a clip; `top_s`: when the climber holds the top, null: no top."""

    clip_id: UUID
    person_id: UUID
    name: str
    published_at: datetime
    top_s: float | None


@router.get("/gyms/{gym}/routes/{route}/films")
def list_films(
    route: UUID,
    session: Db,
    services: ServicesOf,
    access: GuestMay,
    cursor: Cursor = None,
    size: Size = 10,
) -> Page[FilmOut]:
    """Return the published films of a route, the newest first; none where the gym has none."""
    found = route_of(session, access.gym.id, route)
    if "films" not in access.gym.features(services.settings.features):
        return Page(items=[], next=None)
    rows: Select[*tuple[Any, ...]] = published_films(access.gym.id, found.id).add_columns(
        Clip.published_at, Clip.id
    )
    page, following = page_by(session, rows, (Clip.published_at, Clip.id), cursor, size)
    return Page(items=[_film_out(clip, name) for clip, name, *_ in page], next=following)


def _film_out(clip: Clip, name: str) -> FilmOut:
    attempt = attempt_in(clip)
    assert clip.published_at is not None
    return FilmOut(
        clip_id=clip.id,
        person_id=clip.person_id,
        name=name,
        published_at=clip.published_at,
        top_s=None if attempt is None else attempt.top,
    )


@router.get("/gyms/{gym}/clips/{clip}/film", response_class=StreamingResponse)
def read_film(
    clip: UUID,
    session: Db,
    services: ServicesOf,
    access: GuestMay,
    byte_range: Annotated[str | None, Header(alias="range", max_length=100)] = None,
) -> StreamingResponse:
    """Return a published film, or one's own, as MP4; `Range` is answered."""
    row = film_of(session, access.gym.id, clip, access.actor.person)
    is_on = "films" in access.gym.features(services.settings.features)
    if row.person_id != access.actor.person and not is_on:
        raise NotFoundError("not-there-film")
    assert row.film_size is not None
    return ranged_file(services.store, row.film, row.film_size, "video/mp4", byte_range)


class FilmConsent(Body):
    """The climber's word to be old enough; `false` is refused."""

    of_age: bool


@router.put("/gyms/{gym}/clips/{clip}/film", status_code=204)
def put_film(
    clip: UUID, body: FilmConsent, session: Db, services: ServicesOf, access: ClimberMay
) -> None:
    """Publish the film of one's own confirmed clip at its route; repeating it is fine."""
    me = access.actor.known
    row = clip_of(session, access.gym.id, clip, me)
    check_films(session, access.gym, me, services.settings.features)
    if not body.of_age:
        raise ForbiddenError("film-too-young", "film-age", age=MIN_AGE)
    publish_film(session, row)


@router.delete("/gyms/{gym}/clips/{clip}/film", status_code=204)
def drop_film(clip: UUID, session: Db, access: ClimberMay) -> None:
    """Remove a film: one's own, or as a setter a published one. The moves that were read stay."""
    row = film_of(session, access.gym.id, clip, access.actor.known)
    if row.person_id != access.actor.known:
        if not access.role.covers(Role.SETTER):
            raise ForbiddenError("not-allowed-role", role=Role.SETTER)
        access.log_change(session, "film.remove", str(row.id))
    remove_film(session, row)


class FilmReportOut(BaseModel):
    """A report on a film. The reporter's name is not disclosed."""

    id: UUID
    clip_id: UUID
    route_id: UUID
    wall_id: UUID
    person_id: UUID
    name: str
    reason: str
    created_at: datetime


@router.put("/gyms/{gym}/clips/{clip}/film/report", status_code=204)
def report_film(clip: UUID, body: Complaint, session: Db, access: ClimberMay) -> None:
    """Report a film to the gym. Repeated reports count once."""
    me = access.actor.known
    row = film_of(session, access.gym.id, clip, me)
    count_report(session, me)
    mine = select(FilmReport).where(FilmReport.clip_id == row.id, FilmReport.person_id == me)
    report = session.scalar(mine) or FilmReport(clip_id=row.id, person_id=me)
    report.reason = body.reason
    session.add(report)


@router.get("/gyms/{gym}/film-reports")
def list_film_reports(
    session: Db, access: SetterMay, cursor: Cursor = None, size: Size = 50
) -> Page[FilmReportOut]:
    """Return reported films without a decision, the newest first."""
    rows: Select[*tuple[Any, ...]] = (
        select(FilmReport, Clip, Route.wall_id, Person.name, FilmReport.created_at, FilmReport.id)
        .join(Clip, Clip.id == FilmReport.clip_id)
        .join(Route, Route.id == Clip.route_id)
        .join(Wall, Wall.id == Route.wall_id)
        .join(Person, Person.id == Clip.person_id)
        .where(Wall.gym_id == access.gym.id)
    )
    order = FilmReport.created_at, FilmReport.id
    found, following = page_by(session, rows, order, cursor, size)
    items = [
        FilmReportOut(
            id=report.id,
            clip_id=clip.id,
            route_id=clip.route_id,
            wall_id=wall,
            person_id=clip.person_id,
            name=name,
            reason=report.reason,
            created_at=report.created_at,
        )
        for report, clip, wall, name, *_ in found
    ]
    return Page(items=items, next=following)


@router.delete("/gyms/{gym}/film-reports/{report}", status_code=204)
def dismiss_film_report(report: UUID, session: Db, access: SetterMay) -> None:
    """Keep a reported film and close the report."""
    row = session.get(FilmReport, report)
    if row is None:
        raise NotFoundError("not-there-report")
    clip = film_of(session, access.gym.id, row.clip_id, access.actor.known)
    session.delete(row)
    access.log_change(session, "film.keep", str(clip.id))
