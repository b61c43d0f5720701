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
from walltopo_gym.api.fields import Body, Secret, Text
from walltopo_gym.api.gyms import GymFacts, gym_facts
from walltopo_gym.api.rules import Access, OwnerMay, SignedInMay, gym_rule
from walltopo_gym.api.services import Db, ServicesOf
from walltopo_gym.climbing.people import took_part
from walltopo_gym.errors import ForbiddenError, NotFoundError
from walltopo_gym.gyms.bans import ban, end_ban
from walltopo_gym.gyms.members import accept, add_member, change_role, invite, remove_member
from walltopo_gym.gyms.models import Ban, Invitation, Membership
from walltopo_gym.gyms.roles import Role

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


class NewBan(Body):
    """Why; for the gym's own memory."""

    reason: Text = Field("", max_length=200)


class BanFacts(BaseModel):
    """Somebody whom the gym has excluded."""

    id: UUID
    name: str
    reason: str
    created_at: datetime


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


@router.get("/gyms/{gym}/bans")
def list_bans(session: Db, access: OwnerMay) -> list[BanFacts]:
    """Whom the gym has excluded, the last one first."""
    rows = session.execute(
        select(Person.id, Person.name, Ban.reason, Ban.created_at)
        .join(Ban, Ban.person_id == Person.id)
        .where(Ban.gym_id == access.gym.id)
        .order_by(Ban.created_at.desc(), Person.id)
    )
    return [BanFacts(id=row[0], name=row[1], reason=row[2], created_at=row[3]) for row in rows]


@router.put("/gyms/{gym}/bans/{person}", status_code=204)
def ban_person(person: UUID, body: NewBan, session: Db, access: OwnerMay) -> None:
    """Let somebody take part in the gym no more: no member, no new ascents, no comments."""
    if not took_part(session, access.gym.id, person):
        raise NotFoundError("this person has never taken part in this gym")
    ban(session, access.gym.id, person, body.reason, access.actor.known)


@router.delete("/gyms/{gym}/bans/{person}", status_code=204)
def drop_ban(person: UUID, session: Db, access: OwnerMay) -> None:
    """Let somebody join again."""
    end_ban(session, access.gym.id, person, access.actor.known)


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
