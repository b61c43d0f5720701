"""Who belongs to a gym, and how one comes to."""

from __future__ import annotations

from datetime import timedelta
from uuid import UUID

from sqlalchemy import func, select, update
from sqlalchemy.orm import Session

from walltopo.core import InputError
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.secrets import hash_of, new_secret
from walltopo_gym.clock import now
from walltopo_gym.errors import ConflictError, ForbiddenError, NotFoundError
from walltopo_gym.gyms.models import Ban, Gym, Invitation, Membership
from walltopo_gym.gyms.roles import Role


def role_of(session: Session, gym: UUID, person: UUID | None) -> Role:
    """What somebody is in a gym."""
    if person is None:
        return Role.GUEST
    membership = session.get(Membership, (gym, person))
    return Role.GUEST if membership is None else Role(membership.role)


def add_member(session: Session, gym: UUID, person: UUID, role: Role, by: UUID) -> Role:
    """Make somebody a member; a role that they have already is never lessened by it.

    Raises
    ------
    ForbiddenError : the gym has banned them.
    """
    check_not_banned(session, gym, person)
    present = session.get(Membership, (gym, person))
    if present is not None:
        if Role(present.role).covers(role):
            return Role(present.role)
        present.role = role
    else:
        session.add(Membership(gym_id=gym, person_id=person, role=role))
    log_change(session, "member.add", person=by, gym=gym, subject=str(person), role=role)
    return role


def check_not_banned(session: Session, gym: UUID, person: UUID) -> None:
    """Refuse who may take part in this gym no more.

    Raises
    ------
    ForbiddenError : they are banned.
    """
    if session.get(Ban, (gym, person)) is not None:
        raise ForbiddenError(
            "this gym has excluded you",
            "Ask the gym. What you climbed stays yours: it comes out under your own data.",
        )


def change_role(session: Session, gym: UUID, person: UUID, role: Role, by: UUID) -> None:
    """Give a member another role.

    Raises
    ------
    NotFoundError : no member; ConflictError : the gym would be left without an owner.
    """
    membership = _member(session, gym, person)
    if membership.role == Role.OWNER and role != Role.OWNER:
        _keep_an_owner(session, gym)
    membership.role = role
    log_change(session, "member.role", person=by, gym=gym, subject=str(person), role=role)


def remove_member(session: Session, gym: UUID, person: UUID, by: UUID) -> None:
    """Let a member go.

    Raises
    ------
    NotFoundError : no member; ConflictError : the gym would be left without an owner.
    """
    membership = _member(session, gym, person)
    if membership.role == Role.OWNER:
        _keep_an_owner(session, gym)
    session.delete(membership)
    log_change(session, "member.remove", person=by, gym=gym, subject=str(person))


def invite(session: Session, gym: UUID, role: Role, days: int, uses: int, by: UUID) -> str:
    """The secret of a new invitation."""
    secret, kept = new_secret()
    expires = now() + timedelta(days=days)
    row = Invitation(gym_id=gym, role=role, token_hash=kept, expires_at=expires, uses=uses)
    session.add(row)
    session.flush()
    log_change(session, "invitation.create", person=by, gym=gym, subject=str(row.id), role=role)
    return secret


def invitation(session: Session, secret: str) -> Invitation:
    """What a link invites to.

    Raises
    ------
    InputError : there is no such invitation, it is too old or used up.
    """
    found = session.scalar(
        select(Invitation).where(
            Invitation.token_hash == hash_of(secret),
            Invitation.expires_at > now(),
            Invitation.uses > 0,
        )
    )
    if found is None:
        raise InputError("this invitation is used up or too old", "Ask the gym for a new one.")
    return found


def accept(session: Session, secret: str, person: UUID) -> tuple[Gym, Role]:
    """Use an invitation: the gym, and what the person is in it now.

    Raises
    ------
    InputError : as in `invitation`; two that come for its last use get one of them in.
    """
    found = invitation(session, secret)
    used = session.execute(
        update(Invitation)
        .where(Invitation.id == found.id, Invitation.uses > 0)
        .values(uses=Invitation.uses - 1)
        .returning(Invitation.id)
    )
    if used.one_or_none() is None:
        raise InputError("this invitation is used up", "Ask the gym for a new one.")
    role = add_member(session, found.gym_id, person, Role(found.role), person)
    gym = session.get_one(Gym, found.gym_id)
    return gym, role


def _member(session: Session, gym: UUID, person: UUID) -> Membership:
    membership = session.get(Membership, (gym, person))
    if membership is None:
        raise NotFoundError("no member of this gym")
    return membership


def _keep_an_owner(session: Session, gym: UUID) -> None:
    # The gym's row is locked, so that two owners cannot leave at the same moment.
    session.execute(select(Gym.id).where(Gym.id == gym).with_for_update())
    owners = select(func.count()).select_from(Membership).where(
        Membership.gym_id == gym, Membership.role == Role.OWNER
    )  # fmt: skip
    if (session.scalar(owners) or 0) <= 1:
        raise ConflictError("a gym needs an owner", "Make somebody else an owner first.")
