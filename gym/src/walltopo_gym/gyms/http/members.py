"""Members, bans and invitations; signing up with an invitation."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal
from uuid import UUID

from fastapi import APIRouter, BackgroundTasks, Request
from pydantic import BaseModel, EmailStr, Field
from sqlalchemy import delete, select

from walltopo_gym.accounts.access import BrowserMay, SignedInMay
from walltopo_gym.accounts.limits import count_mail
from walltopo_gym.accounts.mails import mail_link
from walltopo_gym.accounts.models import Person
from walltopo_gym.accounts.people import normalise_email
from walltopo_gym.api.fields import Body, Note, Secret
from walltopo_gym.api.paging import Cursor, Page, Size, page_by
from walltopo_gym.api.services import Db, ServicesOf, network_of
from walltopo_gym.errors import ForbiddenError, NotFoundError
from walltopo_gym.events import TookPart, collect_answers
from walltopo_gym.gyms.access import Access, OwnerMay, gym_rule
from walltopo_gym.gyms.http.gyms import GymOut, gym_out
from walltopo_gym.gyms.members import (
    add_member,
    ban_from_gym,
    change_role,
    end_ban,
    invitation,
    invite,
    remove_member,
    use_invitation,
)
from walltopo_gym.gyms.models import Ban, Invitation, Membership
from walltopo_gym.gyms.roles import Role
from walltopo_gym.languages import Language

router = APIRouter(tags=["members"])
sign_up_router = APIRouter(tags=["accounts"])

# One's own belonging: a matter of a person, not of a program.
MemberMay = Annotated[Access, gym_rule(Role.MEMBER, None)]
VisitorMay = Annotated[Access, gym_rule(Role.GUEST, None)]

GivenRole = Literal["member", "judge", "setter", "owner"]


class Member(BaseModel):
    """A member of a gym."""

    id: UUID
    name: str
    role: Role
    created_at: datetime


class RoleChange(Body):
    role: GivenRole


class NewBan(Body):
    """The reason of a ban, for the gym alone."""

    reason: Note = Field("", max_length=200)


class BanOut(BaseModel):
    """A banned person."""

    id: UUID
    name: str
    reason: str
    created_at: datetime


class NewInvitation(Body):
    """The role, lifetime and number of uses of an invitation."""

    role: GivenRole = "member"
    days: int = Field(14, ge=1, le=365)
    uses: int = Field(1, ge=1, le=10_000)


class InvitationOut(BaseModel):
    """An invitation without its secret."""

    id: UUID
    role: Role
    uses: int
    expires_at: datetime


class MadeInvitation(BaseModel):
    """A new invitation; its link is shown once."""

    link: str
    secret: str


class Acceptance(Body):
    secret: Secret


@router.post("/gyms/{gym}/join")
def join_gym(session: Db, access: VisitorMay) -> GymOut:
    """Become a member of an open gym."""
    person = access.actor.known
    if access.role == Role.GUEST and access.gym.joining != "open":
        raise ForbiddenError("join-by-invitation", "ask-the-gym")
    role = add_member(session, access.gym.id, person, Role.MEMBER, person)
    return gym_out(access.gym, role)


@router.delete("/gyms/{gym}/membership", status_code=204)
def leave_gym(session: Db, access: MemberMay) -> None:
    """Leave a gym."""
    person = access.actor.known
    remove_member(session, access.gym.id, person, person)


@router.get("/gyms/{gym}/members")
def list_members(
    session: Db, access: OwnerMay, cursor: Cursor = None, size: Size = 50
) -> Page[Member]:
    """Return the members of the gym, the newest first."""
    order = Membership.created_at, Membership.person_id
    rows = (
        select(Person.name, Membership.role, *order)
        .join(Person, Person.id == Membership.person_id)
        .where(Membership.gym_id == access.gym.id)
    )
    found, following = page_by(session, rows, order, cursor, size)
    items = [
        Member(id=person, name=name, role=Role(role), created_at=since)
        for name, role, since, person in found
    ]
    return Page(items=items, next=following)


@router.patch("/gyms/{gym}/members/{person}", status_code=204)
def change_member(person: UUID, body: RoleChange, session: Db, access: OwnerMay) -> None:
    """Change a member's role."""
    change_role(session, access.gym.id, person, Role(body.role), access.actor.known)


@router.delete("/gyms/{gym}/members/{person}", status_code=204)
def drop_member(person: UUID, session: Db, access: OwnerMay) -> None:
    """Remove a member."""
    remove_member(session, access.gym.id, person, access.actor.known)


@router.get("/gyms/{gym}/bans")
def list_bans(session: Db, access: OwnerMay) -> list[BanOut]:
    """Return the banned people, the latest first."""
    rows = session.execute(
        select(Person.id, Person.name, Ban.reason, Ban.created_at)
        .join(Ban, Ban.person_id == Person.id)
        .where(Ban.gym_id == access.gym.id)
        .order_by(Ban.created_at.desc(), Person.id)
    )
    return [BanOut(id=row[0], name=row[1], reason=row[2], created_at=row[3]) for row in rows]


@router.put("/gyms/{gym}/bans/{person}", status_code=204)
def ban_person(person: UUID, body: NewBan, session: Db, access: OwnerMay) -> None:
    """Ban a person: no membership, no new ascents, no comments."""
    if True not in collect_answers(session, TookPart(access.gym.id, person)):
        raise NotFoundError("ban-stranger")
    ban_from_gym(session, access.gym.id, person, body.reason, access.actor.known)


@router.delete("/gyms/{gym}/bans/{person}", status_code=204)
def drop_ban(person: UUID, session: Db, access: OwnerMay) -> None:
    """Lift a ban."""
    end_ban(session, access.gym.id, person, access.actor.known)


@router.get("/gyms/{gym}/invitations")
def list_invitations(session: Db, access: OwnerMay) -> list[InvitationOut]:
    """Return the valid invitations."""
    rows = session.scalars(
        select(Invitation)
        .where(Invitation.gym_id == access.gym.id)
        .order_by(Invitation.created_at.desc())
    )
    return [InvitationOut.model_validate(row, from_attributes=True) for row in rows]


@router.post("/gyms/{gym}/invitations", status_code=201)
def make_invitation(
    body: NewInvitation, session: Db, services: ServicesOf, access: OwnerMay
) -> MadeInvitation:
    """Create an invitation link."""
    secret = invite(
        session, access.gym.id, Role(body.role), body.days, body.uses, access.actor.known
    )
    link = f"{services.settings.link_base}/invitation#{secret}"
    return MadeInvitation(link=link, secret=secret)


@router.delete("/gyms/{gym}/invitations/{invitation}", status_code=204)
def drop_invitation(invitation: UUID, session: Db, access: OwnerMay) -> None:
    """Revoke an invitation."""
    ended = delete(Invitation).where(
        Invitation.id == invitation, Invitation.gym_id == access.gym.id
    )
    if session.execute(ended.returning(Invitation.id)).one_or_none() is None:
        raise NotFoundError("not-there-invitation")
    access.log_change(
        session,
        "invitation.delete",
        subject=str(invitation),
    )


@router.post("/invitations/accept")
def accept_invitation(body: Acceptance, session: Db, actor: SignedInMay) -> GymOut:
    """Use an invitation."""
    gym, role = use_invitation(session, body.secret, actor.known)
    return gym_out(gym, role)


class SignUp(Body):
    """A request for an account; `invitation` if the server requires one."""

    email: EmailStr
    invitation: Secret | None = None
    language: Language = "en"


@sign_up_router.post("/sign-up", status_code=202)
def request_account(
    body: SignUp, request: Request, services: ServicesOf, later: BackgroundTasks, actor: BrowserMay
) -> None:
    """Mail a link for creating an account. The response is the same for every address."""
    email = normalise_email(body.email)
    with services.database.writing() as session:
        if services.settings.sign_up == "invitation":
            if body.invitation is None:
                raise ForbiddenError("sign-up-by-invitation", "ask-your-gym")
            invitation(session, body.invitation)
        count_mail(session, "sign-up", email, network_of(request), known=None)
    later.add_task(mail_link, services, "sign-up", email, body.language)
