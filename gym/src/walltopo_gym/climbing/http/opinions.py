"""Endpoints of anonymous tallies, and of comments and their moderation."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import datetime
from typing import Annotated, Any
from uuid import UUID

from fastapi import APIRouter
from pydantic import BaseModel
from sqlalchemy import Select, and_, delete, exists, or_, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.actor import Scope
from walltopo_gym.accounts.limits import count_report
from walltopo_gym.accounts.models import Person
from walltopo_gym.api.fields import Complaint
from walltopo_gym.api.paging import Cursor, Page, Size, page_by
from walltopo_gym.api.services import Db
from walltopo_gym.climbing.models import HiddenComment, Opinion, Report
from walltopo_gym.climbing.tallies import tallies
from walltopo_gym.climbing.untouched import delete_route
from walltopo_gym.errors import NotFoundError
from walltopo_gym.gyms.access import Access, GuestMay, PublisherMay, SetterMay, gym_rule
from walltopo_gym.gyms.models import Ban
from walltopo_gym.gyms.roles import Role
from walltopo_gym.publishing.models import Placement, Route
from walltopo_gym.publishing.versions import gym_routes, route_of, wall_routes
from walltopo_gym.scans.models import Scan
from walltopo_gym.walls.lookup import wall_of
from walltopo_gym.walls.models import Wall

router = APIRouter(tags=["climbing"])


class TallyOut(BaseModel):
    """Counts of the ascents and opinions of a route.

    `crowd` is the median of the grade `votes`, empty if they are too few. People who have not voted
    do not see the distribution (`grades` is empty), so that each vote is independent; setters
    always do.
    """

    route_id: UUID
    ascents: dict[str, int]
    climbers: int
    stars: float | None
    crowd: str
    votes: int
    grades: dict[str, int]
    wishes: dict[str, int]


class Past(BaseModel):
    """A version of the wall that had the route, with its number and holds there."""

    scan_id: UUID
    published_at: datetime
    number: int
    holds: list[int]


class RouteHistory(BaseModel):
    """Tallies of a route; `versions` from the latest to the first."""

    tally: TallyOut
    versions: list[Past]


@router.get("/gyms/{gym}/walls/{wall}/tallies")
def list_tallies(wall: UUID, session: Db, access: GuestMay) -> list[TallyOut]:
    """Tallies of each current route of a wall."""
    rows = wall_routes(session, wall_of(session, access.gym.id, wall))
    return _tallies_out(session, access, [route.id for route, _ in rows])


@router.get("/gyms/{gym}/tallies")
def list_gym_tallies(session: Db, access: GuestMay) -> list[TallyOut]:
    """Tallies of each current route of the gym."""
    return _tallies_out(
        session, access, [route.id for route, _ in gym_routes(session, access.gym.id)]
    )


@router.get("/gyms/{gym}/routes/{route}/history")
def read_route_history(route: UUID, session: Db, access: GuestMay) -> RouteHistory:
    """Tallies of one route, current or former, and the versions of the wall that had it."""
    found = route_of(session, access.gym.id, route)
    placed = session.execute(
        select(Placement, Scan.published_at)
        .join(Scan, Scan.id == Placement.scan_id)
        .where(Placement.route_id == found.id)
        .order_by(Scan.published_at.desc())
    )
    versions = [
        Past(scan_id=row.scan_id, published_at=at, number=row.number, holds=row.holds)
        for row, at in placed
        if at is not None
    ]
    return RouteHistory(tally=_tallies_out(session, access, [found.id])[0], versions=versions)


@router.delete("/gyms/{gym}/routes/{route}", status_code=204)
def drop_route(route: UUID, session: Db, access: PublisherMay) -> None:
    """Delete a route that was added by hand by mistake, while no climber has used it."""
    row = route_of(session, access.gym.id, route)
    delete_route(session, row)
    access.log_change(
        session,
        "route.delete",
        subject=row.name or row.colour,
        route=str(row.id),
    )


def _tallies_out(session: Session, access: Access, routes: Iterable[UUID]) -> list[TallyOut]:
    tallied = tallies(session, routes)
    voted = set[UUID]()
    if access.actor.person is not None:
        mine = select(Opinion.route_id).where(
            Opinion.person_id == access.actor.person, Opinion.grade != ""
        )
        voted = set(session.scalars(mine.where(Opinion.route_id.in_(tallied))))
    sees_all = access.role.covers(Role.SETTER)
    return [
        TallyOut(
            route_id=route,
            ascents=tally.ascents,
            climbers=tally.climbers,
            stars=tally.stars,
            crowd=tally.crowd,
            votes=sum(tally.grades.values()),
            wishes=tally.wishes,
            grades=tally.grades if sees_all or route in voted else {},
        )
        for route, tally in tallied.items()
    ]


comments_router = APIRouter(tags=["comments"])

ReaderMay = Annotated[Access, gym_rule(Role.MEMBER, Scope.READ)]

MemberMay = Annotated[Access, gym_rule(Role.MEMBER, None)]


class Comment(BaseModel):
    """A comment with its author's name; `hidden`: only its author and the gym see it."""

    person_id: UUID
    name: str
    comment: str
    changed_at: datetime
    hidden: bool


class ReportOut(BaseModel):
    """A reported comment as it read then. The reporter's name is not disclosed."""

    id: UUID
    route_id: UUID
    wall_id: UUID
    route_name: str
    person_id: UUID
    name: str
    comment: str
    reason: str
    created_at: datetime


@comments_router.get("/gyms/{gym}/routes/{route}/comments")
def list_comments(
    route: UUID, session: Db, access: ReaderMay, cursor: Cursor = None, size: Size = 50
) -> Page[Comment]:
    """Return members' comments on a route, the newest first."""
    found = route_of(session, access.gym.id, route)
    order = Opinion.changed_at, Opinion.person_id
    rows, following = page_by(session, _visible_opinions(access, found.id), order, cursor, size)
    items = [
        Comment(name=row[0], comment=row[1], hidden=row[2], changed_at=row[3], person_id=row[4])
        for row in rows
    ]
    return Page(items=items, next=following)


def _visible_opinions(access: Access, route: UUID) -> Select[*tuple[Any, ...]]:
    hidden = exists().where(
        HiddenComment.route_id == Opinion.route_id, HiddenComment.person_id == Opinion.person_id
    )
    banned = exists().where(Ban.gym_id == access.gym.id, Ban.person_id == Opinion.person_id)
    rows: Select[*tuple[Any, ...]] = (
        select(
            Person.name, Opinion.comment, or_(hidden, banned), Opinion.changed_at, Opinion.person_id
        )
        .join(Person, Person.id == Opinion.person_id)
        .where(Opinion.route_id == route, Opinion.comment != "")
    )
    if access.role.covers(Role.SETTER):
        return rows
    mine = Opinion.person_id == access.actor.known
    return rows.where(or_(mine, and_(~hidden, ~banned)))


@comments_router.put("/gyms/{gym}/routes/{route}/comments/{person}/report", status_code=204)
def report_comment(
    route: UUID, person: UUID, body: Complaint, session: Db, access: MemberMay
) -> None:
    """Report a comment to the gym. Repeated reports count once."""
    found = _comment_of(session, access, route, person)
    me = access.actor.known
    count_report(session, me)
    query = select(Report).where(
        Report.route_id == route, Report.author_id == person, Report.person_id == me
    )
    row = session.scalar(query) or Report(route_id=route, author_id=person, person_id=me)
    row.comment, row.reason = found.comment, body.reason
    session.add(row)


@comments_router.get("/gyms/{gym}/reports")
def list_reports(
    session: Db, access: SetterMay, cursor: Cursor = None, size: Size = 50
) -> Page[ReportOut]:
    """Return reported comments without a decision, the newest first."""
    rows: Select[*tuple[Any, ...]] = (
        select(Report, Route.name, Route.wall_id, Person.name, Report.created_at, Report.id)
        .join(Route, Route.id == Report.route_id)
        .join(Wall, Wall.id == Route.wall_id)
        .join(Person, Person.id == Report.author_id)
        .where(Wall.gym_id == access.gym.id)
    )
    found, following = page_by(session, rows, (Report.created_at, Report.id), cursor, size)
    items = [
        ReportOut(
            id=report.id,
            route_id=report.route_id,
            wall_id=wall,
            route_name=route_name,
            person_id=report.author_id,
            name=name,
            comment=report.comment,
            reason=report.reason,
            created_at=report.created_at,
        )
        for report, route_name, wall, name, *_ in found
    ]
    return Page(items=items, next=following)


@comments_router.delete("/gyms/{gym}/reports/{report}", status_code=204)
def dismiss_report(report: UUID, session: Db, access: SetterMay) -> None:
    """Keep a reported comment and close its reports."""
    row = session.get(Report, report)
    if row is None:
        raise NotFoundError("not-there-report")
    route_of(session, access.gym.id, row.route_id)
    session.delete(row)
    _log_comment(session, access, "comment.keep", row.route_id, row.author_id)


@comments_router.put("/gyms/{gym}/routes/{route}/comments/{person}/hidden", status_code=204)
def hide_comment(route: UUID, person: UUID, session: Db, access: SetterMay) -> None:
    """Hide a comment from all but its author, and close its reports."""
    _comment_of(session, access, route, person)
    session.merge(HiddenComment(route_id=route, person_id=person))
    session.execute(delete(Report).where(Report.route_id == route, Report.author_id == person))
    _log_comment(session, access, "comment.hide", route, person)


@comments_router.delete("/gyms/{gym}/routes/{route}/comments/{person}/hidden", status_code=204)
def show_comment(route: UUID, person: UUID, session: Db, access: SetterMay) -> None:
    """Show a hidden comment again; repeating it is fine."""
    route_of(session, access.gym.id, route)
    row = session.get(HiddenComment, (route, person))
    if row is not None:
        session.delete(row)
        _log_comment(session, access, "comment.show", route, person)


def _comment_of(session: Session, access: Access, route: UUID, person: UUID) -> Opinion:
    route_of(session, access.gym.id, route)
    row = session.get(Opinion, (route, person))
    if row is None or not row.comment:
        raise NotFoundError("not-there-comment")
    return row


def _log_comment(session: Session, access: Access, action: str, route: UUID, author: UUID) -> None:
    access.log_change(
        session,
        action,
        subject=str(route),
        author=str(author),
    )
