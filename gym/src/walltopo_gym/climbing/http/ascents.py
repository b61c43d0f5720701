"""Endpoints of one's own ascents and opinions."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal
from uuid import UUID

from fastapi import APIRouter, Query, Response
from pydantic import BaseModel, Field
from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.access import SignedInMay
from walltopo_gym.accounts.actor import Scope
from walltopo_gym.accounts.people import lock_person
from walltopo_gym.api.fields import Body, Text
from walltopo_gym.api.paging import Cursor, Page, Size, page_of
from walltopo_gym.api.services import Db
from walltopo_gym.climbing.ascents import (
    AscentChange,
    EditOriginIn,
    IdentifiedClimb,
    NewAscent,
    Words,
    correct_ascent,
    store_ascent,
    store_ascents,
    withdraw,
)
from walltopo_gym.climbing.edits import is_newer_edit
from walltopo_gym.climbing.kinds import Kind
from walltopo_gym.climbing.logbook import logbook
from walltopo_gym.climbing.models import Ascent, Opinion
from walltopo_gym.clock import now
from walltopo_gym.gyms.access import Access, gym_rule
from walltopo_gym.gyms.roles import Role
from walltopo_gym.publishing.models import Route
from walltopo_gym.publishing.service import grade_of
from walltopo_gym.publishing.versions import route_of
from walltopo_gym.walls.disciplines import Discipline

router = APIRouter(tags=["climbing"])

ClimberMay = Annotated[Access, gym_rule(Role.MEMBER, None)]

Wish = Literal["", "keep", "renew"]


class AscentOut(BaseModel):
    """An ascent; names and grade are those of the day on which it arrived."""

    id: UUID
    gym_id: UUID | None
    route_id: UUID | None
    gym_name: str
    route_name: str
    grade: str
    kind: Kind
    tries: int
    discipline: Discipline
    high_point: int | None
    climbed_at: datetime
    created_at: datetime


class OwnAscent(AscentOut):
    """An ascent with its private fields, for its climber."""

    note: str


class OpinionIn(Body):
    """A complete opinion of a route."""

    grade: Text = ""
    stars: int | None = Field(None, ge=1, le=5)
    wish: Wish = ""
    comment: Words = ""


class NewOpinion(OpinionIn):
    """A complete opinion of a route and the origin of the edit."""

    edit: EditOriginIn | None = None


class ManyAscents(Body):
    """Ascents of one gym, such as those of a session, and the origin of the edit."""

    ascents: list[IdentifiedClimb] = Field(min_length=1, max_length=200)
    edit: EditOriginIn | None = None


@router.put("/gyms/{gym}/ascents")
def put_ascents(body: ManyAscents, session: Db, access: ClimberMay) -> list[OwnAscent]:
    """Store several ascents, all or none, as `PUT /gyms/{gym}/ascents/{ascent}` stores each."""
    climbs = [(route_of(session, access.gym.id, one.route_id), one) for one in body.ascents]
    edit = body.edit.read() if body.edit else None
    rows = store_ascents(session, access.actor.known, access.gym, climbs, edit)
    return [OwnAscent.model_validate(row, from_attributes=True) for row in rows]


@router.put("/gyms/{gym}/ascents/{ascent}")
def put_ascent(
    ascent: UUID, body: NewAscent, response: Response, session: Db, access: ClimberMay
) -> OwnAscent:
    """Store an ascent under an id that the phone made, so that it is stored once. Sending it again
    with other fields corrects it. A withdrawn ascent stays. The response is the stored state: a
    late copy of an older `edit` changes nothing."""
    route = route_of(session, access.gym.id, body.route_id)
    edit = body.edit.read() if body.edit else None
    row, is_new = store_ascent(session, ascent, access.actor.known, access.gym, route, body, edit)
    response.status_code = 201 if is_new else 200
    return OwnAscent.model_validate(row, from_attributes=True)


@router.get("/me/ascents")
def list_ascents(
    session: Db,
    actor: SignedInMay,
    cursor: Cursor = None,
    size: Size = 50,
    wall: Annotated[UUID | None, Query(description="only of routes of this wall")] = None,
) -> Page[OwnAscent]:
    """Return one's own ascents in order of arrival, the latest first."""
    rows = select(Ascent).where(Ascent.person_id == actor.known, Ascent.taken_back_at.is_(None))
    if wall is not None:
        rows = rows.where(Ascent.route_id.in_(select(Route.id).where(Route.wall_id == wall)))
    found, following = page_of(session, rows, Ascent, cursor, size)
    items = [OwnAscent.model_validate(row, from_attributes=True) for row in found]
    return Page(items=items, next=following)


@router.patch("/me/ascents/{ascent}")
def change_ascent(ascent: UUID, body: AscentChange, session: Db, actor: SignedInMay) -> OwnAscent:
    """Correct an own ascent of any gym, also of a route or gym that is gone."""
    row = correct_ascent(session, ascent, actor.known, body)
    return OwnAscent.model_validate(row, from_attributes=True)


@router.delete("/me/ascents/{ascent}", status_code=204)
def drop_ascent(ascent: UUID, session: Db, actor: SignedInMay) -> None:
    """Withdraw an ascent; repeating it is fine."""
    withdraw(session, ascent, actor.known)


@router.get("/gyms/{gym}/routes/{route}/opinion")
def read_opinion(route: UUID, session: Db, access: ClimberMay) -> OpinionIn:
    """Return one's own opinion of a route; empty if there is none."""
    row = _opinion(session, route_of(session, access.gym.id, route).id, access.actor.known)
    return OpinionIn.model_validate(
        row or Opinion(grade="", wish="", comment=""), from_attributes=True
    )


@router.put("/gyms/{gym}/routes/{route}/opinion", status_code=204)
def put_opinion(route: UUID, body: NewOpinion, session: Db, access: ClimberMay) -> None:
    """Store one's opinion of a route. A late copy of an older `edit` changes nothing."""
    found = route_of(session, access.gym.id, route)
    grade = grade_of(session, access.gym.id, found.grade_system_id, body.grade)
    me = access.actor.known
    # One person's come one after the other, so that two copies at once are one.
    lock_person(session, me)
    row = _opinion(session, route, me) or Opinion(route_id=route, person_id=me)
    if is_newer_edit(row, body.edit.read() if body.edit else None):
        row.changed_at = now()
        for name, value in {**body.model_dump(exclude={"edit"}), "grade": grade}.items():
            setattr(row, name, value)
    session.add(row)


@router.delete("/gyms/{gym}/routes/{route}/opinion", status_code=204)
def drop_opinion(route: UUID, session: Db, access: ClimberMay) -> None:
    """Delete one's opinion of a route."""
    found = route_of(session, access.gym.id, route)
    mine = Opinion.route_id == found.id, Opinion.person_id == access.actor.known
    session.execute(delete(Opinion).where(*mine))


def _opinion(session: Session, route: UUID, person: UUID) -> Opinion | None:
    return session.get(Opinion, (route, person))


ReaderMay = Annotated[Access, gym_rule(Role.MEMBER, Scope.READ)]


class OwnOpinion(OpinionIn):
    """One's own opinion of a route."""

    route_id: UUID


class LogbookOut(BaseModel):
    """Own ascents on the current routes, the latest first, and own opinions."""

    ascents: list[OwnAscent]
    opinions: list[OwnOpinion]


@router.get("/gyms/{gym}/logbook")
def read_logbook(session: Db, access: ReaderMay) -> LogbookOut:
    """Return own ascents and opinions in this gym; former routes are in `/me/ascents`."""
    kept = logbook(session, access.gym.id, access.actor.known)
    return LogbookOut(
        ascents=[OwnAscent.model_validate(row, from_attributes=True) for row in kept.ascents],
        opinions=[_own_opinion(row) for row in kept.opinions],
    )


def _own_opinion(row: object) -> OwnOpinion:
    return OwnOpinion.model_validate(row, from_attributes=True)
