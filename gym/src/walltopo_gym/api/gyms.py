"""Gyms: opened, described, closed; and the log of who changed what in one."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, Literal
from uuid import UUID

from fastapi import APIRouter
from pydantic import BaseModel, Field
from sqlalchemy import delete, select

from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.models import AuditEntry
from walltopo_gym.api.fields import Body, Name, Slug, Text
from walltopo_gym.api.paging import Cursor, Page, Size, page_of
from walltopo_gym.api.rules import (
    Access,
    AnyoneMay,
    GuestMay,
    OwnerMay,
    SignedInMay,
    gym_rule,
)
from walltopo_gym.api.services import Db, ServicesOf
from walltopo_gym.climbing.counting import recount
from walltopo_gym.errors import ForbiddenError
from walltopo_gym.gyms.models import Gym, Membership
from walltopo_gym.gyms.opening import check_time_zone, open_gym
from walltopo_gym.gyms.roles import Role

router = APIRouter(tags=["gyms"])

Visibility = Literal["public", "unlisted", "private"]
Joining = Literal["open", "invitation"]
Boards = Literal["off", "one", "categories"]


class NewGym(Body):
    """A gym to open; `slug` is its part of the address, made from the name where it is left out."""

    name: Name
    slug: Slug = ""
    place: Text = ""
    time_zone: str = Field("UTC", max_length=60)
    visibility: Visibility = "private"
    joining: Joining = "invitation"


class GymChange(Body):
    """What shall be otherwise; what is left out stays."""

    name: Name | None = None
    place: Text | None = None
    time_zone: str | None = Field(None, max_length=60)
    visibility: Visibility | None = None
    joining: Joining | None = None
    boards: Boards | None = None


class GymFacts(BaseModel):
    """A gym; `role` is the asker's in it."""

    id: UUID
    slug: str
    name: str
    place: str
    time_zone: str
    visibility: Visibility
    joining: Joining
    boards: Boards
    created_at: datetime
    role: Role = Role.GUEST


class AuditLine(BaseModel):
    """Who changed what, and when."""

    created_at: datetime
    person_id: UUID | None
    action: str
    subject: str
    details: dict[str, Any]


@router.get("/gyms")
def list_gyms(
    session: Db, actor: AnyoneMay, cursor: Cursor = None, size: Size = 50
) -> Page[GymFacts]:
    """The public gyms, the newest first."""
    rows, following = page_of(
        session, select(Gym).where(Gym.visibility == "public"), Gym, cursor, size
    )
    return Page(items=[gym_facts(row, Role.GUEST) for row in rows], next=following)


@router.get("/me/gyms")
def list_own_gyms(session: Db, actor: SignedInMay) -> list[GymFacts]:
    """The gyms that one belongs to."""
    rows = session.execute(
        select(Gym, Membership.role)
        .join(Membership, Membership.gym_id == Gym.id)
        .where(Membership.person_id == actor.known)
        .order_by(Gym.name)
    )
    return [gym_facts(gym, Role(role)) for gym, role in rows]


@router.post("/gyms", status_code=201)
def make_gym(body: NewGym, session: Db, services: ServicesOf, actor: SignedInMay) -> GymFacts:
    """Open a gym, as its owner."""
    if services.settings.new_gyms == "operators" and not actor.operator:
        raise ForbiddenError("only an operator opens gyms here", "Ask whoever runs this server.")
    facts = body.model_dump(include={"place", "time_zone", "visibility", "joining"})
    gym = open_gym(session, actor.known, body.name, body.slug, **facts)
    return gym_facts(gym, Role.OWNER)


@router.get("/gyms/{gym}")
def read_gym(access: GuestMay) -> GymFacts:
    """One gym."""
    return gym_facts(access.gym, access.role)


@router.patch("/gyms/{gym}")
def change_gym(body: GymChange, session: Db, access: OwnerMay) -> GymFacts:
    """Change what is said of a gym, and who sees it."""
    changes = body.model_dump(exclude_none=True)
    if "time_zone" in changes:
        check_time_zone(changes["time_zone"])
    gym = session.get_one(Gym, access.gym.id)
    zone = gym.time_zone
    for name, value in changes.items():
        setattr(gym, name, value)
    if gym.time_zone != zone:  # its days begin otherwise
        recount(session, gym)
    log_change(session, "gym.change", person=access.actor.known, gym=gym.id, subject=gym.slug,
               **changes)  # fmt: skip
    return gym_facts(gym, access.role)


@router.delete("/gyms/{gym}", status_code=204)
def close_gym(session: Db, access: Annotated[Access, gym_rule(Role.OWNER, None)]) -> None:
    """Close a gym for good, with its walls, scans and routes."""
    session.execute(delete(Gym).where(Gym.id == access.gym.id))
    log_change(session, "gym.delete", person=access.actor.known, gym=access.gym.id,
               subject=access.gym.slug)  # fmt: skip


@router.get("/gyms/{gym}/audit")
def list_changes(
    session: Db, access: OwnerMay, cursor: Cursor = None, size: Size = 50
) -> Page[AuditLine]:
    """Who changed what in the gym, the newest first."""
    wanted = select(AuditEntry).where(AuditEntry.gym_id == access.gym.id)
    rows, following = page_of(session, wanted, AuditEntry, cursor, size)
    lines = [AuditLine.model_validate(row, from_attributes=True) for row in rows]
    return Page(items=lines, next=following)


def gym_facts(gym: Gym, role: Role) -> GymFacts:
    """A gym as it is told to somebody with that role."""
    facts = GymFacts.model_validate(gym, from_attributes=True)
    return facts.model_copy(update={"role": role})
