"""Walls of a gym."""

from __future__ import annotations

from datetime import datetime
from uuid import UUID

from fastapi import APIRouter
from pydantic import BaseModel, Field
from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.audit import log_change
from walltopo_gym.api.fields import Body, Name, Text
from walltopo_gym.api.rules import Access, GuestMay, OwnerMay, SetterMay
from walltopo_gym.api.services import Db
from walltopo_gym.errors import ConflictError, NotFoundError
from walltopo_gym.gyms.models import Wall

router = APIRouter(tags=["walls"])


class NewWall(Body):
    """A wall; `place` orders the gym's walls from left to right, `zone` joins those that are set
    together."""

    name: Name
    place: int = Field(0, ge=-10_000, le=10_000)
    zone: Text = Field("", max_length=80)


class WallChange(Body):
    """What shall be otherwise; what is left out stays."""

    name: Name | None = None
    place: int | None = Field(None, ge=-10_000, le=10_000)
    zone: Text | None = Field(None, max_length=80)


class WallFacts(BaseModel):
    """A wall; `published_scan_id` is the version that the public sees."""

    id: UUID
    name: str
    place: int
    zone: str
    published_scan_id: UUID | None
    revision: int
    created_at: datetime


def wall_of(session: Session, gym: UUID, wall: UUID) -> Wall:
    """A wall of this gym.

    Raises
    ------
    NotFoundError : there is none, or it is another gym's.
    """
    row = session.get(Wall, wall)
    if row is None or row.gym_id != gym:
        raise NotFoundError("no such wall")
    return row


@router.get("/gyms/{gym}/walls")
def list_walls(session: Db, access: GuestMay) -> list[WallFacts]:
    """The gym's walls from left to right."""
    rows = session.scalars(
        select(Wall).where(Wall.gym_id == access.gym.id).order_by(Wall.place, Wall.name)
    )
    return [_facts(row) for row in rows]


@router.post("/gyms/{gym}/walls", status_code=201)
def make_wall(body: NewWall, session: Db, access: SetterMay) -> WallFacts:
    """Add a wall."""
    _refuse_taken(session, access.gym.id, body.name)
    row = Wall(gym_id=access.gym.id, name=body.name, place=body.place, zone=body.zone)
    session.add(row)
    session.flush()
    _log(session, access, "wall.create", row)
    return _facts(row)


@router.get("/gyms/{gym}/walls/{wall}")
def read_wall(wall: UUID, session: Db, access: GuestMay) -> WallFacts:
    """One wall."""
    return _facts(wall_of(session, access.gym.id, wall))


@router.patch("/gyms/{gym}/walls/{wall}")
def change_wall(wall: UUID, body: WallChange, session: Db, access: SetterMay) -> WallFacts:
    """Rename a wall, or give it another place."""
    row = wall_of(session, access.gym.id, wall)
    if body.name is not None and body.name != row.name:
        _refuse_taken(session, access.gym.id, body.name)
        row.name = body.name
    if body.place is not None:
        row.place = body.place
    if body.zone is not None:
        row.zone = body.zone
    _log(session, access, "wall.change", row)
    return _facts(row)


@router.delete("/gyms/{gym}/walls/{wall}", status_code=204)
def drop_wall(wall: UUID, session: Db, access: OwnerMay) -> None:
    """Take a wall away for good, with its scans and routes."""
    row = wall_of(session, access.gym.id, wall)
    session.delete(row)
    _log(session, access, "wall.delete", row)


def _facts(row: Wall) -> WallFacts:
    return WallFacts.model_validate(row, from_attributes=True)


def _refuse_taken(session: Session, gym: UUID, name: str) -> None:
    taken = select(Wall.id).where(Wall.gym_id == gym, Wall.name == name)
    if session.scalar(taken) is not None:
        raise ConflictError(f"there is a wall {name!r} already")


def _log(session: Session, access: Access, action: str, row: Wall) -> None:
    log_change(session, action, person=access.actor.known, gym=access.gym.id, subject=row.name,
               wall=str(row.id))  # fmt: skip
