"""Who may not take part in a gym any more: no member, and none again until the ban ends."""

from __future__ import annotations

from uuid import UUID

from sqlalchemy.orm import Session

from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.models import Person
from walltopo_gym.errors import ConflictError, NotFoundError
from walltopo_gym.gyms.members import remove_member, role_of
from walltopo_gym.gyms.models import Ban
from walltopo_gym.gyms.roles import Role


def ban(session: Session, gym: UUID, person: UUID, reason: str, by: UUID) -> None:
    """Let somebody take part no more, member or not; again, for another reason.

    What they climbed stays theirs; their comments are shown to nobody (api/comments.py).

    Raises
    ------
    NotFoundError : no such person; ConflictError : oneself, or another owner.
    """
    if session.get(Person, person) is None:
        raise NotFoundError("no such person")
    role = role_of(session, gym, person)
    if role == Role.OWNER:
        raise ConflictError("an owner cannot be banned", "Give them another role first.")
    if role != Role.GUEST:
        remove_member(session, gym, person, by)
    session.merge(Ban(gym_id=gym, person_id=person, reason=reason))
    log_change(session, "member.ban", person=by, gym=gym, subject=str(person), reason=reason)


def end_ban(session: Session, gym: UUID, person: UUID, by: UUID) -> None:
    """Let somebody join again; they are no member by it.

    Raises
    ------
    NotFoundError : they are not banned.
    """
    row = session.get(Ban, (gym, person))
    if row is None:
        raise NotFoundError("this person is not banned")
    session.delete(row)
    log_change(session, "member.ban-end", person=by, gym=gym, subject=str(person))
