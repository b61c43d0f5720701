"""Ascents as they arrive: once, however often they are sent."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo.core import InputError
from walltopo_gym.accounts.models import Person
from walltopo_gym.climbing.counting import count_again, value
from walltopo_gym.climbing.edits import Edit, takes
from walltopo_gym.climbing.models import Ascent
from walltopo_gym.clock import now
from walltopo_gym.errors import ConflictError, NotFoundError
from walltopo_gym.gyms.models import Gym
from walltopo_gym.publishing.models import Route


class Kind(StrEnum):
    """What came of it."""

    FLASH = "flash"
    TOP = "top"
    ZONE = "zone"
    TRY = "try"
    PROJECT = "project"


@dataclass(frozen=True)
class Climb:
    """What a climber says of it.

    Parameters
    ----------
    tries : of that day, the successful one among them; climbed_at : by the climber's clock;
    note : for nobody but the climber.
    """

    kind: Kind
    tries: int
    climbed_at: datetime
    note: str = ""


def keep_ascent(
    session: Session, ascent: UUID, person: UUID, gym: Gym, route: Route, climb: Climb,
    edit: Edit | None = None,
) -> tuple[Ascent, bool]:  # fmt: skip
    """Keep an ascent, and whether it is new; one that is there already is made to say this.

    A clock that is ahead counts as now. One that was taken back stays so, and one that says
    something newer does.

    Raises
    ------
    InputError : a flash in several tries; ConflictError : somebody else has this id.
    """
    if climb.kind == Kind.FLASH and climb.tries != 1:
        raise InputError(f"a flash is one try, not {climb.tries}")
    # One person's ascents come one after the other, so that two copies at once are one.
    session.execute(select(Person.id).where(Person.id == person).with_for_update())
    row = session.get(Ascent, ascent)
    is_new = row is None
    if row is None:
        row = Ascent(
            id=ascent, person_id=person, gym_id=gym.id, route_id=route.id, gym_name=gym.name,
            route_name=route.name, grade=route.grade,
        )  # fmt: skip
        value(session, row, route)
        session.add(row)
    elif row.person_id != person:
        raise ConflictError("this id is taken", "Make another one.")
    elif row.taken_back_at is not None:
        return row, False
    elif row.route_id != route.id:
        raise ConflictError("this ascent is of another route", "Take it back, and make a new one.")
    if not takes(row, edit):
        return row, False
    before = set() if is_new else {row.climbed_at}
    row.kind, row.tries, row.note = climb.kind, climb.tries, climb.note
    row.climbed_at = min(climb.climbed_at, now())
    count_again(session, gym, person, before | {row.climbed_at})
    return row, is_new


def take_back(session: Session, ascent: UUID, person: UUID) -> None:
    """Let an ascent count no more; again, too.

    Raises
    ------
    NotFoundError : this person has none of that id.
    """
    session.execute(select(Person.id).where(Person.id == person).with_for_update())
    mine = select(Ascent).where(Ascent.id == ascent, Ascent.person_id == person)
    row = session.scalar(mine)
    if row is None:
        raise NotFoundError("no such ascent")
    if row.taken_back_at is None:
        row.taken_back_at = now()
        if row.gym_id is not None:
            count_again(session, session.get_one(Gym, row.gym_id), person, [row.climbed_at])
