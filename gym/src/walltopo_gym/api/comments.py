"""Comments on routes: read, reported, hidden.

A comment is part of its author's opinion (api/climbing.py). Whose comment the gym has hidden, and
whom it has excluded, is read by nobody else; the author sees that it is hidden.
"""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any
from uuid import UUID

from fastapi import APIRouter
from pydantic import BaseModel, Field
from sqlalchemy import Select, and_, delete, exists, or_, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.actor import Scope
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.limits import count_report
from walltopo_gym.accounts.models import Person
from walltopo_gym.api.fields import Body, Text
from walltopo_gym.api.paging import Cursor, Page, Size, page_by
from walltopo_gym.api.routes import route_of
from walltopo_gym.api.rules import Access, SetterMay, gym_rule
from walltopo_gym.api.services import Db
from walltopo_gym.climbing.models import HiddenComment, Opinion, Report
from walltopo_gym.errors import NotFoundError
from walltopo_gym.gyms.models import Ban, Wall
from walltopo_gym.gyms.roles import Role
from walltopo_gym.publishing.models import Route

router = APIRouter(tags=["comments"])

ReaderMay = Annotated[Access, gym_rule(Role.MEMBER, Scope.READ)]
MemberMay = Annotated[Access, gym_rule(Role.MEMBER, None)]


class Comment(BaseModel):
    """A comment, under its author's name; `hidden`: shown to its author and the gym alone."""

    person_id: UUID
    name: str
    comment: str
    changed_at: datetime
    hidden: bool


class Complaint(Body):
    """Why a comment should not be there; may be empty."""

    reason: Text = Field("", max_length=200)


class ReportFacts(BaseModel):
    """A comment that somebody reported, as it read then; who reported it stays with the server."""

    id: UUID
    route_id: UUID
    wall_id: UUID
    route_name: str
    person_id: UUID
    name: str
    comment: str
    reason: str
    created_at: datetime


@router.get("/gyms/{gym}/routes/{route}/comments")
def list_comments(
    route: UUID, session: Db, access: ReaderMay, cursor: Cursor = None, size: Size = 50
) -> Page[Comment]:
    """What members wrote of a route, the newest first."""
    found = route_of(session, access, route)
    order = Opinion.changed_at, Opinion.person_id
    rows, following = page_by(session, _shown(access, found.id), order, cursor, size)
    items = [
        Comment(name=row[0], comment=row[1], hidden=row[2], changed_at=row[3], person_id=row[4])
        for row in rows
    ]
    return Page(items=items, next=following)


def _shown(access: Access, route: UUID) -> Select[*tuple[Any, ...]]:
    hidden = exists().where(
        HiddenComment.route_id == Opinion.route_id, HiddenComment.person_id == Opinion.person_id
    )
    banned = exists().where(Ban.gym_id == access.gym.id, Ban.person_id == Opinion.person_id)
    rows: Select[*tuple[Any, ...]] = (
        select(Person.name, Opinion.comment, or_(hidden, banned), Opinion.changed_at,
               Opinion.person_id)
        .join(Person, Person.id == Opinion.person_id)
        .where(Opinion.route_id == route, Opinion.comment != "")
    )  # fmt: skip
    if access.role.covers(Role.SETTER):
        return rows
    mine = Opinion.person_id == access.actor.known
    return rows.where(or_(mine, and_(~hidden, ~banned)))


@router.put("/gyms/{gym}/routes/{route}/comments/{person}/report", status_code=204)
def report_comment(
    route: UUID, person: UUID, body: Complaint, session: Db, access: MemberMay
) -> None:
    """Tell the gym that a comment should not be there; said again it counts once."""
    found = _comment(session, access, route, person)
    me = access.actor.known
    count_report(session, me)
    told = select(Report).where(
        Report.route_id == route, Report.author_id == person, Report.person_id == me
    )
    row = session.scalar(told) or Report(route_id=route, author_id=person, person_id=me)
    row.comment, row.reason = found.comment, body.reason
    session.add(row)


@router.get("/gyms/{gym}/reports")
def list_reports(
    session: Db, access: SetterMay, cursor: Cursor = None, size: Size = 50
) -> Page[ReportFacts]:
    """Comments of the gym that were reported and not decided on, the newest first."""
    rows: Select[*tuple[Any, ...]] = (
        select(Report, Route.name, Route.wall_id, Person.name, Report.created_at, Report.id)
        .join(Route, Route.id == Report.route_id)
        .join(Wall, Wall.id == Route.wall_id)
        .join(Person, Person.id == Report.author_id)
        .where(Wall.gym_id == access.gym.id)
    )
    found, following = page_by(session, rows, (Report.created_at, Report.id), cursor, size)
    items = [
        ReportFacts(
            id=report.id, route_id=report.route_id, wall_id=wall, route_name=route_name,
            person_id=report.author_id, name=name, comment=report.comment, reason=report.reason,
            created_at=report.created_at,
        )
        for report, route_name, wall, name, *_ in found
    ]  # fmt: skip
    return Page(items=items, next=following)


@router.delete("/gyms/{gym}/reports/{report}", status_code=204)
def dismiss_report(report: UUID, session: Db, access: SetterMay) -> None:
    """Leave a reported comment where it is."""
    row = session.get(Report, report)
    if row is None:
        raise NotFoundError("no such report")
    route_of(session, access, row.route_id)
    session.delete(row)
    _log(session, access, "comment.keep", row.route_id, row.author_id)


@router.put("/gyms/{gym}/routes/{route}/comments/{person}/hidden", status_code=204)
def hide_comment(route: UUID, person: UUID, session: Db, access: SetterMay) -> None:
    """Show a comment to nobody but its author, and settle what was reported of it."""
    _comment(session, access, route, person)
    session.merge(HiddenComment(route_id=route, person_id=person))
    session.execute(delete(Report).where(Report.route_id == route, Report.author_id == person))
    _log(session, access, "comment.hide", route, person)


@router.delete("/gyms/{gym}/routes/{route}/comments/{person}/hidden", status_code=204)
def show_comment(route: UUID, person: UUID, session: Db, access: SetterMay) -> None:
    """Show a hidden comment again; again, too."""
    route_of(session, access, route)
    row = session.get(HiddenComment, (route, person))
    if row is not None:
        session.delete(row)
        _log(session, access, "comment.show", route, person)


def _comment(session: Session, access: Access, route: UUID, person: UUID) -> Opinion:
    route_of(session, access, route)
    row = session.get(Opinion, (route, person))
    if row is None or not row.comment:
        raise NotFoundError("no such comment")
    return row


def _log(session: Session, access: Access, action: str, route: UUID, author: UUID) -> None:
    log_change(session, action, person=access.actor.known, gym=access.gym.id, subject=str(route),
               author=str(author))  # fmt: skip
