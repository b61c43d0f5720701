"""Members of a gym, and the invitations by which one becomes one."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal
from uuid import UUID

from fastapi import APIRouter
from pydantic import BaseModel, Field
from sqlalchemy import delete, select

from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.models import Person
from walltopo_gym.api.fields import Body, Secret
from walltopo_gym.api.gyms import GymFacts, gym_facts
from walltopo_gym.api.rules import Access, OwnerMay, SignedInMay, gym_rule
from walltopo_gym.api.services import Db, ServicesOf
from walltopo_gym.errors import ForbiddenError, NotFoundError
from walltopo_gym.gyms.members import accept, add_member, change_role, invite, remove_member
from walltopo_gym.gyms.models import Invitation, Membership
from walltopo_gym.gyms.roles import Role

__all__ = ["router"]

router = APIRouter(tags=["members"])

# One's own belonging: a matter of a person, not of a program.
MemberMay = Annotated[Access, gym_rule(Role.MEMBER, None)]
VisitorMay = Annotated[Access, gym_rule(Role.GUEST, None)]

GivenRole = Literal["member", "judge", "setter", "owner"]


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


@router.post("/gyms/{gym}/join")
def join_gym(session: Db, access: VisitorMay) -> GymFacts:
    """Become a member of a gym that lets everybody in."""
    person = access.actor.known
    if access.role == Role.GUEST and access.gym.joining != "open":
        raise ForbiddenError("one joins this gym by invitation", "Ask the gym for one.")
    role = add_member(session, access.gym.id, person, Role.MEMBER, person)
    return gym_facts(access.gym, role)


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
    return gym_facts(gym, role)
