"""Membership of a gym: roles, invitations, bans."""

from __future__ import annotations

from datetime import timedelta
from uuid import UUID

from sqlalchemy import func, select, update
from sqlalchemy.orm import Session

from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.models import Person
from walltopo_gym.accounts.secrets import hash_of, new_secret
from walltopo_gym.clock import now
from walltopo_gym.errors import ConflictError, ForbiddenError, NotFoundError, RequestError
from walltopo_gym.gyms.models import Ban, Gym, Invitation, Membership
from walltopo_gym.gyms.roles import Role


def role_of(session: Session, gym: UUID, person: UUID | None) -> Role:
    """Return a person's role in a gym."""
    if person is None:
        return Role.GUEST
    membership = session.get(Membership, (gym, person))
    return Role.GUEST if membership is None else Role(membership.role)


def add_member(session: Session, gym: UUID, person: UUID, role: Role, by: UUID) -> Role:
    """Make a person a member. It never lowers an existing role.

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
    """Refuse a banned person.

    Raises
    ------
    ForbiddenError : they are banned.
    """
    if session.get(Ban, (gym, person)) is not None:
        raise ForbiddenError("banned", "banned-hint")


def change_role(session: Session, gym: UUID, person: UUID, role: Role, by: UUID) -> None:
    """Change a member's role.

    Raises
    ------
    NotFoundError : no member; ConflictError : the gym would be left without an owner.
    """
    membership = _membership_of(session, gym, person)
    if membership.role == Role.OWNER and role != Role.OWNER:
        _keep_an_owner(session, gym)
    membership.role = role
    log_change(session, "member.role", person=by, gym=gym, subject=str(person), role=role)


def remove_member(session: Session, gym: UUID, person: UUID, by: UUID) -> None:
    """Remove a member.

    Raises
    ------
    NotFoundError : no member; ConflictError : the gym would be left without an owner.
    """
    membership = _membership_of(session, gym, person)
    if membership.role == Role.OWNER:
        _keep_an_owner(session, gym)
    session.delete(membership)
    log_change(session, "member.remove", person=by, gym=gym, subject=str(person))


def invite(session: Session, gym: UUID, role: Role, days: int, uses: int, by: UUID) -> str:
    """Create an invitation and return its secret."""
    secret, kept = new_secret()
    expires = now() + timedelta(days=days)
    row = Invitation(gym_id=gym, role=role, token_hash=kept, expires_at=expires, uses=uses)
    session.add(row)
    session.flush()
    log_change(session, "invitation.create", person=by, gym=gym, subject=str(row.id), role=role)
    return secret


def invitation(session: Session, secret: str) -> Invitation:
    """Return the invitation of a link.

    Raises
    ------
    RequestError : the invitation does not exist, has expired or is used up.
    """
    found = session.scalar(
        select(Invitation).where(
            Invitation.token_hash == hash_of(secret),
            Invitation.expires_at > now(),
            Invitation.uses > 0,
        )
    )
    if found is None:
        raise RequestError("invitation-old", "ask-the-gym-new")
    return found


def use_invitation(session: Session, secret: str, person: UUID) -> tuple[Gym, Role]:
    """Use an invitation and return the gym and the person's role.

    Raises
    ------
    RequestError : as in `invitation`; of two requests for the last use, one gets this.
    """
    found = invitation(session, secret)
    used = session.execute(
        update(Invitation)
        .where(Invitation.id == found.id, Invitation.uses > 0)
        .values(uses=Invitation.uses - 1)
        .returning(Invitation.id)
    )
    if used.one_or_none() is None:
        raise RequestError("invitation-used", "ask-the-gym-new")
    role = add_member(session, found.gym_id, person, Role(found.role), person)
    gym = session.get_one(Gym, found.gym_id)
    return gym, role


def _membership_of(session: Session, gym: UUID, person: UUID) -> Membership:
    membership = session.get(Membership, (gym, person))
    if membership is None:
        raise NotFoundError("not-there-member")
    return membership


def _keep_an_owner(session: Session, gym: UUID) -> None:
    # The gym's row is locked, so that two owners cannot leave at the same moment.
    session.execute(select(Gym.id).where(Gym.id == gym).with_for_update())
    owners = (
        select(func.count())
        .select_from(Membership)
        .where(Membership.gym_id == gym, Membership.role == Role.OWNER)
    )
    if (session.scalar(owners) or 0) <= 1:
        raise ConflictError("gym-needs-owner", "another-owner-first")


def ban_from_gym(session: Session, gym: UUID, person: UUID, reason: str, by: UUID) -> None:
    """Ban a person, member or not; repeating it updates the reason.

    Their ascents stay theirs; their comments are hidden (climbing/http/opinions.py).

    Raises
    ------
    NotFoundError : no such person; ConflictError : oneself, or another owner.
    """
    if session.get(Person, person) is None:
        raise NotFoundError("not-there-person")
    role = role_of(session, gym, person)
    if role == Role.OWNER:
        raise ConflictError("ban-owner", "ban-owner-hint")
    if role != Role.GUEST:
        remove_member(session, gym, person, by)
    session.merge(Ban(gym_id=gym, person_id=person, reason=reason))
    log_change(session, "member.ban", person=by, gym=gym, subject=str(person))


def end_ban(session: Session, gym: UUID, person: UUID, by: UUID) -> None:
    """Lift a ban; it does not restore the membership.

    Raises
    ------
    NotFoundError : they are not banned.
    """
    row = session.get(Ban, (gym, person))
    if row is None:
        raise NotFoundError("ban-none")
    session.delete(row)
    log_change(session, "member.ban-end", person=by, gym=gym, subject=str(person))
