"""Gyms, their members, invitations and grades."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, Literal, Self
from uuid import UUID

from fastapi import APIRouter
from pydantic import BaseModel, Field, model_validator
from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.actor import Scope
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.models import AuditEntry, Person
from walltopo_gym.api.fields import Body, Name, Secret, Slug, Text
from walltopo_gym.api.paging import Cursor, Page, Size, page_of
from walltopo_gym.api.rules import Access, AnyoneMay, SignedInMay, gym_rule
from walltopo_gym.api.services import Db, ServicesOf
from walltopo_gym.errors import ConflictError, ForbiddenError, NotFoundError
from walltopo_gym.gyms.grades import check_grades
from walltopo_gym.gyms.members import accept, add_member, change_role, invite, remove_member
from walltopo_gym.gyms.models import GradeSystem, Gym, Invitation, Membership
from walltopo_gym.gyms.opening import check_time_zone, open_gym
from walltopo_gym.gyms.roles import Role

__all__ = ["router"]

router = APIRouter(tags=["gyms"])

GuestMay = Annotated[Access, gym_rule(Role.GUEST, Scope.READ)]
MemberMay = Annotated[Access, gym_rule(Role.MEMBER, None)]
OwnerMay = Annotated[Access, gym_rule(Role.OWNER, Scope.MANAGE)]
VisitorMay = Annotated[Access, gym_rule(Role.GUEST, None)]

Visibility = Literal["public", "unlisted", "private"]
Joining = Literal["open", "invitation"]
GivenRole = Literal["member", "judge", "setter", "owner"]


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


class GymFacts(BaseModel):
    """A gym; `role` is the asker's in it."""

    id: UUID
    slug: str
    name: str
    place: str
    time_zone: str
    visibility: Visibility
    joining: Joining
    created_at: datetime
    role: Role = Role.GUEST


class Member(BaseModel):
    """Somebody in a gym."""

    id: UUID
    name: str
    role: Role
    created_at: datetime


class RoleChange(Body):
    role: GivenRole


class NewInvitation(Body):
    """An invitation: as what, for how long, for how many."""

    role: GivenRole = "member"
    days: int = Field(14, ge=1, le=365)
    uses: int = Field(1, ge=1, le=10_000)


class InvitationFacts(BaseModel):
    """An invitation without its secret."""

    id: UUID
    role: Role
    uses: int
    expires_at: datetime


class MadeInvitation(BaseModel):
    """An invitation just made: its link is told this once."""

    link: str
    secret: str


class Acceptance(Body):
    secret: Secret


class Grade(Body):
    """One grade; a circuit has a colour and a range in Font or V."""

    label: Name
    colour: str | None = Field(None, pattern=r"^#[0-9a-f]{6}$")
    low: str | None = Field(None, max_length=10)
    high: str | None = Field(None, max_length=10)


class NewGradeSystem(Body):
    """A grade system, from the easiest grade to the hardest."""

    name: Name
    kind: Literal["font", "v", "circuits", "own"]
    grades: list[Grade] = Field(min_length=1, max_length=60)

    @model_validator(mode="after")
    def _make_sense(self) -> Self:
        check_grades(
            self.kind,
            [grade.label for grade in self.grades],
            [(grade.low, grade.high) for grade in self.grades],
        )
        return self

    def rows(self) -> list[dict[str, Any]]:
        """As they are kept."""
        return [grade.model_dump(exclude_none=True) for grade in self.grades]


class GradeSystemFacts(BaseModel):
    """A gym's grade system."""

    id: UUID
    name: str
    kind: str
    grades: list[Grade]


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
    return Page(items=[_facts(row, Role.GUEST) for row in rows], next=following)


@router.get("/me/gyms")
def list_own_gyms(session: Db, actor: SignedInMay) -> list[GymFacts]:
    """The gyms that one belongs to."""
    rows = session.execute(
        select(Gym, Membership.role)
        .join(Membership, Membership.gym_id == Gym.id)
        .where(Membership.person_id == actor.known)
        .order_by(Gym.name)
    )
    return [_facts(gym, Role(role)) for gym, role in rows]


@router.post("/gyms", status_code=201)
def make_gym(body: NewGym, session: Db, services: ServicesOf, actor: SignedInMay) -> GymFacts:
    """Open a gym, as its owner."""
    if services.settings.new_gyms == "operators" and not actor.operator:
        raise ForbiddenError("only an operator opens gyms here", "Ask whoever runs this server.")
    facts = body.model_dump(include={"place", "time_zone", "visibility", "joining"})
    gym = open_gym(session, actor.known, body.name, body.slug, **facts)
    return _facts(gym, Role.OWNER)


@router.get("/gyms/{gym}")
def read_gym(access: GuestMay) -> GymFacts:
    """One gym."""
    return _facts(access.gym, access.role)


@router.patch("/gyms/{gym}")
def change_gym(body: GymChange, session: Db, access: OwnerMay) -> GymFacts:
    """Change what is said of a gym, and who sees it."""
    changes = body.model_dump(exclude_none=True)
    if "time_zone" in changes:
        check_time_zone(changes["time_zone"])
    gym = session.get_one(Gym, access.gym.id)
    for name, value in changes.items():
        setattr(gym, name, value)
    log_change(session, "gym.change", person=access.actor.known, gym=gym.id, subject=gym.slug,
               **changes)  # fmt: skip
    return _facts(gym, access.role)


@router.delete("/gyms/{gym}", status_code=204)
def close_gym(session: Db, access: Annotated[Access, gym_rule(Role.OWNER, None)]) -> None:
    """Close a gym for good, with its walls, scans and routes."""
    session.execute(delete(Gym).where(Gym.id == access.gym.id))
    log_change(session, "gym.delete", person=access.actor.known, gym=access.gym.id,
               subject=access.gym.slug)  # fmt: skip


@router.post("/gyms/{gym}/join")
def join_gym(session: Db, access: VisitorMay) -> GymFacts:
    """Become a member of a gym that lets everybody in."""
    person = access.actor.known
    if access.role == Role.GUEST and access.gym.joining != "open":
        raise ForbiddenError("one joins this gym by invitation", "Ask the gym for one.")
    role = add_member(session, access.gym.id, person, Role.MEMBER, person)
    return _facts(access.gym, role)


@router.delete("/gyms/{gym}/membership", status_code=204)
def leave_gym(session: Db, access: MemberMay) -> None:
    """Leave a gym."""
    person = access.actor.known
    remove_member(session, access.gym.id, person, person)


@router.get("/gyms/{gym}/members")
def list_members(session: Db, access: OwnerMay) -> list[Member]:
    """Who belongs to the gym."""
    rows = session.execute(
        select(Person.id, Person.name, Membership.role, Membership.created_at)
        .join(Membership, Membership.person_id == Person.id)
        .where(Membership.gym_id == access.gym.id)
        .order_by(Person.name, Person.id)
    )
    return [Member(id=row[0], name=row[1], role=Role(row[2]), created_at=row[3]) for row in rows]


@router.patch("/gyms/{gym}/members/{person}", status_code=204)
def change_member(person: UUID, body: RoleChange, session: Db, access: OwnerMay) -> None:
    """Give a member another role."""
    change_role(session, access.gym.id, person, Role(body.role), access.actor.known)


@router.delete("/gyms/{gym}/members/{person}", status_code=204)
def drop_member(person: UUID, session: Db, access: OwnerMay) -> None:
    """Let a member go."""
    remove_member(session, access.gym.id, person, access.actor.known)


@router.get("/gyms/{gym}/invitations")
def list_invitations(session: Db, access: OwnerMay) -> list[InvitationFacts]:
    """The invitations that are out."""
    rows = session.scalars(
        select(Invitation)
        .where(Invitation.gym_id == access.gym.id)
        .order_by(Invitation.created_at.desc())
    )
    return [InvitationFacts.model_validate(row, from_attributes=True) for row in rows]


@router.post("/gyms/{gym}/invitations", status_code=201)
def make_invitation(
    body: NewInvitation, session: Db, services: ServicesOf, access: OwnerMay
) -> MadeInvitation:
    """Make a link that lets whoever has it in."""
    secret = invite(
        session, access.gym.id, Role(body.role), body.days, body.uses, access.actor.known
    )
    link = f"{services.settings.link_base}/invitation#{secret}"
    return MadeInvitation(link=link, secret=secret)


@router.delete("/gyms/{gym}/invitations/{invitation}", status_code=204)
def drop_invitation(invitation: UUID, session: Db, access: OwnerMay) -> None:
    """Take an invitation back."""
    ended = delete(Invitation).where(
        Invitation.id == invitation, Invitation.gym_id == access.gym.id
    )
    if session.execute(ended.returning(Invitation.id)).one_or_none() is None:
        raise NotFoundError("no such invitation")
    log_change(session, "invitation.delete", person=access.actor.known, gym=access.gym.id,
               subject=str(invitation))  # fmt: skip


@router.post("/invitations/accept")
def accept_invitation(body: Acceptance, session: Db, actor: SignedInMay) -> GymFacts:
    """Use an invitation."""
    gym, role = accept(session, body.secret, actor.known)
    return _facts(gym, role)


@router.get("/gyms/{gym}/grade-systems")
def list_grade_systems(session: Db, access: GuestMay) -> list[GradeSystemFacts]:
    """How the gym grades its routes."""
    rows = session.scalars(
        select(GradeSystem)
        .where(GradeSystem.gym_id == access.gym.id)
        .order_by(GradeSystem.created_at, GradeSystem.id)
    )
    return [_system(row) for row in rows]


@router.post("/gyms/{gym}/grade-systems", status_code=201)
def make_grade_system(body: NewGradeSystem, session: Db, access: OwnerMay) -> GradeSystemFacts:
    """Add a grade system."""
    row = GradeSystem(gym_id=access.gym.id, name=body.name, kind=body.kind, grades=body.rows())
    _refuse_taken(session, access.gym.id, body.name)
    session.add(row)
    session.flush()
    log_change(session, "grades.create", person=access.actor.known, gym=access.gym.id,
               subject=body.name)  # fmt: skip
    return _system(row)


@router.put("/gyms/{gym}/grade-systems/{system}")
def change_grade_system(
    system: UUID, body: NewGradeSystem, session: Db, access: OwnerMay
) -> GradeSystemFacts:
    """Change a grade system."""
    row = _system_of(session, access.gym.id, system)
    if row.name != body.name:
        _refuse_taken(session, access.gym.id, body.name)
    row.name, row.kind, row.grades = body.name, body.kind, body.rows()
    log_change(session, "grades.change", person=access.actor.known, gym=access.gym.id,
               subject=body.name)  # fmt: skip
    return _system(row)


@router.delete("/gyms/{gym}/grade-systems/{system}", status_code=204)
def drop_grade_system(system: UUID, session: Db, access: OwnerMay) -> None:
    """Take a grade system away."""
    row = _system_of(session, access.gym.id, system)
    session.delete(row)
    log_change(session, "grades.delete", person=access.actor.known, gym=access.gym.id,
               subject=row.name)  # fmt: skip


@router.get("/gyms/{gym}/audit")
def list_changes(
    session: Db, access: OwnerMay, cursor: Cursor = None, size: Size = 50
) -> Page[AuditLine]:
    """Who changed what in the gym, the newest first."""
    wanted = select(AuditEntry).where(AuditEntry.gym_id == access.gym.id)
    rows, following = page_of(session, wanted, AuditEntry, cursor, size)
    lines = [AuditLine.model_validate(row, from_attributes=True) for row in rows]
    return Page(items=lines, next=following)


def _facts(gym: Gym, role: Role) -> GymFacts:
    facts = GymFacts.model_validate(gym, from_attributes=True)
    return facts.model_copy(update={"role": role})


def _system(row: GradeSystem) -> GradeSystemFacts:
    return GradeSystemFacts.model_validate(row, from_attributes=True)


def _system_of(session: Session, gym: UUID, system: UUID) -> GradeSystem:
    row = session.get(GradeSystem, system)
    if row is None or row.gym_id != gym:
        raise NotFoundError("no such grade system")
    return row


def _refuse_taken(session: Session, gym: UUID, name: str) -> None:
    taken = select(GradeSystem.id).where(GradeSystem.gym_id == gym, GradeSystem.name == name)
    if session.scalar(taken) is not None:
        raise ConflictError(f"there is a grade system {name!r} already")
