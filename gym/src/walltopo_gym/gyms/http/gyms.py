"""Endpoints of gyms, their grade systems and audit log."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, Literal, Self
from uuid import UUID

from fastapi import APIRouter, Query
from pydantic import BaseModel, Field, model_validator
from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.access import AnyoneMay, SignedInMay
from walltopo_gym.accounts.models import AuditEntry
from walltopo_gym.api.fields import Body, Name, Slug, Text
from walltopo_gym.api.paging import Cursor, Page, Size, page_of
from walltopo_gym.api.services import Db, ServicesOf
from walltopo_gym.errors import ConflictError, ForbiddenError, NotFoundError
from walltopo_gym.events import DaysChanged, publish_event
from walltopo_gym.gyms.access import Access, GuestMay, OwnerMay, gym_rule
from walltopo_gym.gyms.grade_labels import own_label, spelled_labels, spelled_range
from walltopo_gym.gyms.grade_uses import change_labels, replace_system
from walltopo_gym.gyms.models import GradeSystem, Gym, Membership
from walltopo_gym.gyms.roles import Role
from walltopo_gym.gyms.service import check_time_zone, open_gym
from walltopo_gym.settings import Switch

router = APIRouter(tags=["gyms"])

Visibility = Literal["public", "unlisted", "private"]

Joining = Literal["open", "invitation"]

Boards = Literal["off", "one", "categories"]

Units = Literal["metric", "imperial"]

GymPaper = Literal["a4", "letter"]


class NewGym(Body):
    """A new gym; `slug` is its part of the address, derived from the name by default."""

    name: Name
    slug: Slug = ""
    place: Text = ""
    time_zone: str = Field("UTC", max_length=60)
    visibility: Visibility = "private"
    joining: Joining = "invitation"
    units: Units = "metric"
    paper: GymPaper = "a4"


class GymChange(Body):
    """Changes of a gym; omitted fields stay."""

    name: Name | None = None
    place: Text | None = None
    time_zone: str | None = Field(None, max_length=60)
    visibility: Visibility | None = None
    joining: Joining | None = None
    units: Units | None = None
    paper: GymPaper | None = None
    boards: Boards | None = None
    features_off: list[Switch] | None = Field(None, max_length=10)


class GymOut(BaseModel):
    """A gym; `role` is the viewer's, `features_off` the features that the gym has turned off,
    `features_barred` those that an operator has turned off for it. Lengths are in metres whatever
    its `units` are, in which pages show them."""

    id: UUID
    slug: str
    name: str
    place: str
    time_zone: str
    visibility: Visibility
    joining: Joining
    units: Units
    paper: GymPaper
    boards: Boards
    features_off: list[Switch]
    features_barred: list[Switch]
    created_at: datetime
    role: Role = Role.GUEST


class AuditLine(BaseModel):
    """An entry of the audit log."""

    created_at: datetime
    person_id: UUID | None
    action: str
    subject: str
    details: dict[str, Any]


@router.get("/gyms")
def list_gyms(
    session: Db, actor: AnyoneMay, cursor: Cursor = None, size: Size = 50
) -> Page[GymOut]:
    """Return the public gyms, the newest first."""
    rows, following = page_of(
        session, select(Gym).where(Gym.visibility == "public"), Gym, cursor, size
    )
    return Page(items=[gym_out(row, Role.GUEST) for row in rows], next=following)


@router.get("/me/gyms")
def list_own_gyms(session: Db, actor: SignedInMay) -> list[GymOut]:
    """Return one's own gyms."""
    rows = session.execute(
        select(Gym, Membership.role)
        .join(Membership, Membership.gym_id == Gym.id)
        .where(Membership.person_id == actor.known)
        .order_by(Gym.name)
    )
    return [gym_out(gym, Role(role)) for gym, role in rows]


@router.post("/gyms", status_code=201)
def make_gym(body: NewGym, session: Db, services: ServicesOf, actor: SignedInMay) -> GymOut:
    """Create a gym as its owner."""
    if services.settings.new_gyms == "operators" and not actor.operator:
        raise ForbiddenError("gyms-by-operators", "ask-operator")
    facts = body.model_dump(exclude={"name", "slug"})
    gym = open_gym(session, actor.known, body.name, body.slug, **facts)
    return gym_out(gym, Role.OWNER)


@router.get("/gyms/{gym}")
def read_gym(access: GuestMay) -> GymOut:
    """Return a gym."""
    return gym_out(access.gym, access.role)


@router.patch("/gyms/{gym}")
def change_gym(body: GymChange, session: Db, access: OwnerMay) -> GymOut:
    """Change a gym's facts and visibility."""
    changes = body.model_dump(exclude_none=True)
    if "time_zone" in changes:
        check_time_zone(changes["time_zone"])
    if "features_off" in changes:
        changes["features_off"] = sorted(set(changes["features_off"]))
    gym = session.get_one(Gym, access.gym.id)
    zone = gym.time_zone
    for name, value in changes.items():
        setattr(gym, name, value)
    if gym.time_zone != zone:  # its days begin otherwise
        publish_event(session, DaysChanged(gym.id))
    access.log_change(session, "gym.change", gym.slug, **changes)
    return gym_out(gym, access.role)


@router.delete("/gyms/{gym}", status_code=204)
def close_gym(session: Db, access: Annotated[Access, gym_rule(Role.OWNER, None)]) -> None:
    """Delete a gym for good, with its walls, scans and routes."""
    session.execute(delete(Gym).where(Gym.id == access.gym.id))
    access.log_change(session, "gym.delete", subject=access.gym.slug)


@router.get("/gyms/{gym}/audit")
def list_changes(
    session: Db, access: OwnerMay, cursor: Cursor = None, size: Size = 50
) -> Page[AuditLine]:
    """Return the gym's audit log, the newest first."""
    wanted = select(AuditEntry).where(AuditEntry.gym_id == access.gym.id)
    rows, following = page_of(session, wanted, AuditEntry, cursor, size)
    lines = [AuditLine.model_validate(row, from_attributes=True) for row in rows]
    return Page(items=lines, next=following)


def gym_out(gym: Gym, role: Role) -> GymOut:
    """Return a gym's facts for a role."""
    facts = GymOut.model_validate(gym, from_attributes=True)
    return facts.model_copy(update={"role": role})


grades_router = APIRouter(tags=["grades"])


class Grade(Body):
    """One grade; a circuit has a colour and a range in Font or V."""

    label: Name
    colour: str | None = Field(None, pattern=r"^#[0-9a-f]{6}$")
    low: str | None = Field(None, max_length=10)
    high: str | None = Field(None, max_length=10)


class NewGradeSystem(Body):
    """A grade system, from the easiest grade to the hardest. Grades of the scales "font", "v",
    "french" and "uiaa" get the spelling of the scale."""

    name: Name
    kind: Literal["font", "v", "french", "uiaa", "circuits", "own"]
    grades: list[Grade] = Field(min_length=1, max_length=60)

    @model_validator(mode="after")
    def _make_sense(self) -> Self:
        labels = spelled_labels(self.kind, [grade.label for grade in self.grades])
        for grade, label in zip(self.grades, labels, strict=True):
            grade.label = label
            grade.low, grade.high = spelled_range(label, grade.low, grade.high)
        return self

    def rows(self) -> list[dict[str, Any]]:
        """Return the grades as stored."""
        return [grade.model_dump(exclude_none=True) for grade in self.grades]


class ChangedGradeSystem(NewGradeSystem):
    """A complete grade system after a change; `renamed`: new label by old label."""

    renamed: dict[str, Name] = Field(default_factory=dict, max_length=60)

    def new_labels(self) -> dict[str, str]:
        """Return the system's label of each renamed grade, or the unknown name as it is."""
        labels = [grade.label for grade in self.grades]
        return {old: own_label(self.kind, labels, new) or new for old, new in self.renamed.items()}


class GradeSystemOut(BaseModel):
    """A gym's grade system."""

    id: UUID
    name: str
    kind: str
    grades: list[Grade]


@grades_router.get("/gyms/{gym}/grade-systems")
def list_grade_systems(session: Db, access: GuestMay) -> list[GradeSystemOut]:
    """Return the gym's grade systems."""
    rows = session.scalars(
        select(GradeSystem)
        .where(GradeSystem.gym_id == access.gym.id)
        .order_by(GradeSystem.created_at, GradeSystem.id)
    )
    return [_system(row) for row in rows]


@grades_router.post("/gyms/{gym}/grade-systems", status_code=201)
def make_grade_system(body: NewGradeSystem, session: Db, access: OwnerMay) -> GradeSystemOut:
    """Add a grade system."""
    row = GradeSystem(gym_id=access.gym.id, name=body.name, kind=body.kind, grades=body.rows())
    _refuse_taken(session, access.gym.id, body.name)
    session.add(row)
    session.flush()
    access.log_change(session, "grades.create", subject=body.name)
    return _system(row)


@grades_router.put("/gyms/{gym}/grade-systems/{system}")
def change_grade_system(
    system: UUID, body: ChangedGradeSystem, session: Db, access: OwnerMay
) -> GradeSystemOut:
    """Change a grade system. Renames apply wherever a grade is used; removing a grade in use is
    refused."""
    row = _system_of(session, access.gym.id, system)
    if row.name != body.name:
        _refuse_taken(session, access.gym.id, body.name)
    change_labels(session, row, [grade.label for grade in body.grades], body.new_labels())
    row.name, row.kind, row.grades = body.name, body.kind, body.rows()
    access.log_change(session, "grades.change", subject=body.name)
    return _system(row)


@grades_router.delete("/gyms/{gym}/grade-systems/{system}", status_code=204)
def drop_grade_system(
    system: UUID,
    session: Db,
    access: OwnerMay,
    replacement: Annotated[UUID | None, Query(description="system that the grades move to")] = None,
) -> None:
    """Delete a grade system; one in use needs a replacement that has the same grades."""
    row = _system_of(session, access.gym.id, system)
    by = None if replacement is None else _system_of(session, access.gym.id, replacement)
    replace_system(session, row, None if by is row else by)
    session.delete(row)
    access.log_change(session, "grades.delete", subject=row.name)


def _system(row: GradeSystem) -> GradeSystemOut:
    return GradeSystemOut.model_validate(row, from_attributes=True)


def _system_of(session: Session, gym: UUID, system: UUID) -> GradeSystem:
    row = session.get(GradeSystem, system)
    if row is None or row.gym_id != gym:
        raise NotFoundError("not-there-grades")
    return row


def _refuse_taken(session: Session, gym: UUID, name: str) -> None:
    taken = select(GradeSystem.id).where(GradeSystem.gym_id == gym, GradeSystem.name == name)
    if session.scalar(taken) is not None:
        raise ConflictError("grades-name-taken", name=name)
