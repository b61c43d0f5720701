"""Ascents as they arrive. Each is stored once, however often it is sent."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated
from uuid import UUID

from pydantic import Field
from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.models import Person
from walltopo_gym.api.fields import Body, Moment
from walltopo_gym.climbing.counting import count_again, value_ascent
from walltopo_gym.climbing.dates import begin_of, check_climbed
from walltopo_gym.climbing.edits import Edit, is_newer_edit
from walltopo_gym.climbing.models import Ascent
from walltopo_gym.clock import now
from walltopo_gym.errors import ConflictError, NotFoundError, RequestError
from walltopo_gym.gyms.days import zone_of
from walltopo_gym.gyms.models import Gym
from walltopo_gym.publishing.models import Route


class Kind(StrEnum):
    """Results of an ascent."""

    FLASH = "flash"
    TOP = "top"
    ZONE = "zone"
    TRY = "try"
    PROJECT = "project"


Words = Annotated[str, Field(max_length=500, pattern=r"^[^\x00-\x08\x0b-\x1f\x7f]*$")]


class EditOriginIn(Body):
    """The origin of an edit, by which late copies of older edits are ignored. `number` grows with
    each edit of the device; `age_s` is the edit's age when it is sent, by the device's clock."""

    device: UUID
    number: int = Field(ge=1, le=2**53)
    age_s: float = Field(0, ge=0, le=1e9)

    def read(self) -> Edit:
        """Return the edit as the services use it."""
        return Edit(self.device, self.number, self.age_s)


class NewAscent(Body):
    """An ascent of a route: `tries` of that day, `climbed_at` by the climber's clock."""

    route_id: UUID
    kind: Kind
    tries: int = Field(1, ge=1, le=999)
    climbed_at: Moment
    note: Words = ""
    edit: EditOriginIn | None = None


def store_ascent(
    session: Session,
    ascent: UUID,
    person: UUID,
    gym: Gym,
    route: Route,
    climb: NewAscent,
    edit: Edit | None = None,
) -> tuple[Ascent, bool]:
    """Store or correct an ascent; return it and whether it is new.

    A time of the next hours counts as now, because clocks differ. A withdrawn ascent stays
    withdrawn, and a newer edit stays.

    Raises
    ------
    RequestError : a flash in several tries, or a new time at which the route was not there;
        ConflictError : the id belongs to another person.
    """
    if climb.kind == Kind.FLASH and climb.tries != 1:
        raise RequestError("flash-one-try", tries=climb.tries)
    # One person's ascents come one after the other, so that two copies at once are one.
    session.execute(select(Person.id).where(Person.id == person).with_for_update())
    row = session.get(Ascent, ascent)
    is_new = row is None
    if row is None or row.climbed_at != climb.climbed_at:
        check_climbed(climb.climbed_at, begin_of(session, gym, route), zone_of(gym))
    if row is None:
        row = Ascent(
            id=ascent,
            person_id=person,
            gym_id=gym.id,
            route_id=route.id,
            gym_name=gym.name,
            route_name=route.name,
            grade=route.grade,
        )
        value_ascent(session, row, route)
        session.add(row)
    elif row.person_id != person:
        raise ConflictError("id-taken", "id-another")
    elif row.taken_back_at is not None:
        return row, False
    elif row.route_id != route.id:
        raise ConflictError("ascent-other-route", "ascent-make-new")
    if not is_newer_edit(row, edit):
        return row, False
    before = set() if is_new else {row.climbed_at}
    row.kind, row.tries, row.note = climb.kind, climb.tries, climb.note
    row.climbed_at = min(climb.climbed_at, now())
    count_again(session, gym, person, before | {row.climbed_at})
    return row, is_new


def withdraw(session: Session, ascent: UUID, person: UUID) -> None:
    """Withdraw an ascent; repeating it is fine.

    Raises
    ------
    NotFoundError : this person has no ascent with that id.
    """
    session.execute(select(Person.id).where(Person.id == person).with_for_update())
    mine = select(Ascent).where(Ascent.id == ascent, Ascent.person_id == person)
    row = session.scalar(mine)
    if row is None:
        raise NotFoundError("not-there-ascent")
    if row.taken_back_at is None:
        row.taken_back_at = now()
        if row.gym_id is not None:
            count_again(session, session.get_one(Gym, row.gym_id), person, [row.climbed_at])
