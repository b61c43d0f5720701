"""What one climbed, and what one thinks of a route."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal
from uuid import UUID

from fastapi import APIRouter, Query, Response
from pydantic import BaseModel, Field
from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.models import Person
from walltopo_gym.api.fields import Body, Moment, Text
from walltopo_gym.api.paging import Cursor, Page, Size, page_of
from walltopo_gym.api.routes import route_of
from walltopo_gym.api.rules import Access, SignedInMay, gym_rule
from walltopo_gym.api.services import Db
from walltopo_gym.climbing.ascents import Climb, Kind, keep_ascent, take_back
from walltopo_gym.climbing.edits import Edit, takes
from walltopo_gym.climbing.models import Ascent, Opinion
from walltopo_gym.clock import now
from walltopo_gym.gyms.roles import Role
from walltopo_gym.publishing.change import check_grade
from walltopo_gym.publishing.models import Route

router = APIRouter(tags=["climbing"])

ClimberMay = Annotated[Access, gym_rule(Role.MEMBER, None)]
Wish = Literal["", "keep", "renew"]
Words = Annotated[str, Field(max_length=500, pattern=r"^[^\x00-\x08\x0b-\x1f\x7f]*$")]


class EditWords(Body):
    """Which edit of a device this is, so that a copy of an older one that arrives late changes
    nothing: `number` grows with each edit of the device, `age_s` is how long ago it was made when
    it is sent, by the device's own clock."""

    device: UUID
    number: int = Field(ge=1, le=2**53)
    age_s: float = Field(0, ge=0, le=1e9)

    def read(self) -> Edit:
        """As the rooms below know it."""
        return Edit(self.device, self.number, self.age_s)


class NewAscent(Body):
    """What one did on a route; `tries` of that day, `climbed_at` by one's own clock."""

    route_id: UUID
    kind: Kind
    tries: int = Field(1, ge=1, le=999)
    climbed_at: Moment
    note: Words = ""
    edit: EditWords | None = None


class AscentFacts(BaseModel):
    """An ascent; names and grade are those of the day on which it arrived."""

    id: UUID
    gym_id: UUID | None
    route_id: UUID | None
    gym_name: str
    route_name: str
    grade: str
    kind: Kind
    tries: int
    climbed_at: datetime
    created_at: datetime


class OwnAscent(AscentFacts):
    """An ascent as its climber alone sees it."""

    note: str


class OpinionWords(Body):
    """What one thinks of a route; all of it, each time."""

    grade: Text = ""
    stars: int | None = Field(None, ge=1, le=5)
    wish: Wish = ""
    comment: Words = ""


class NewOpinion(OpinionWords):
    """What one thinks, and which edit of it this is."""

    edit: EditWords | None = None


@router.put("/gyms/{gym}/ascents/{ascent}")
def put_ascent(
    ascent: UUID, body: NewAscent, response: Response, session: Db, access: ClimberMay
) -> OwnAscent:
    """Tell what one did; under an id that one's phone has made, so that it arrives once however
    often it is sent. Sent again with other words it is corrected; taken back it stays. The answer
    is what it says now: a late copy of an older `edit` changes nothing."""
    route = route_of(session, access, body.route_id)
    climb = Climb(body.kind, body.tries, body.climbed_at, body.note)
    edit = body.edit.read() if body.edit else None
    row, is_new = keep_ascent(session, ascent, access.actor.known, access.gym, route, climb, edit)
    response.status_code = 201 if is_new else 200
    return OwnAscent.model_validate(row, from_attributes=True)


@router.get("/me/ascents")
def list_ascents(
    session: Db, actor: SignedInMay, cursor: Cursor = None, size: Size = 50,
    wall: Annotated[UUID | None, Query(description="only of routes of this wall")] = None,
) -> Page[OwnAscent]:  # fmt: skip
    """One's own ascents, the last that arrived first."""
    rows = select(Ascent).where(Ascent.person_id == actor.known, Ascent.taken_back_at.is_(None))
    if wall is not None:
        rows = rows.where(Ascent.route_id.in_(select(Route.id).where(Route.wall_id == wall)))
    found, following = page_of(session, rows, Ascent, cursor, size)
    items = [OwnAscent.model_validate(row, from_attributes=True) for row in found]
    return Page(items=items, next=following)


@router.delete("/me/ascents/{ascent}", status_code=204)
def drop_ascent(ascent: UUID, session: Db, actor: SignedInMay) -> None:
    """Take an ascent back; again, too."""
    take_back(session, ascent, actor.known)


@router.get("/gyms/{gym}/routes/{route}/opinion")
def read_opinion(route: UUID, session: Db, access: ClimberMay) -> OpinionWords:
    """What one thinks of a route; empty where one has not said."""
    row = _opinion(session, route_of(session, access, route).id, access.actor.known)
    return OpinionWords.model_validate(row or Opinion(grade="", wish="", comment=""),
                                       from_attributes=True)  # fmt: skip


@router.put("/gyms/{gym}/routes/{route}/opinion", status_code=204)
def put_opinion(route: UUID, body: NewOpinion, session: Db, access: ClimberMay) -> None:
    """Say what one thinks of a route; a late copy of an older `edit` changes nothing."""
    found = route_of(session, access, route)
    if body.grade:
        check_grade(session, access.gym.id, found.grade_system_id, body.grade)
    me = access.actor.known
    # One person's come one after the other, so that two copies at once are one.
    session.execute(select(Person.id).where(Person.id == me).with_for_update())
    row = _opinion(session, route, me) or Opinion(route_id=route, person_id=me)
    if takes(row, body.edit.read() if body.edit else None):
        row.changed_at = now()
        for name, value in body.model_dump(exclude={"edit"}).items():
            setattr(row, name, value)
    session.add(row)


@router.delete("/gyms/{gym}/routes/{route}/opinion", status_code=204)
def drop_opinion(route: UUID, session: Db, access: ClimberMay) -> None:
    """Have no opinion of a route any more."""
    found = route_of(session, access, route)
    mine = Opinion.route_id == found.id, Opinion.person_id == access.actor.known
    session.execute(delete(Opinion).where(*mine))


def _opinion(session: Session, route: UUID, person: UUID) -> Opinion | None:
    return session.get(Opinion, (route, person))
