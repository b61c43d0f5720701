"""The operator's view of accounts, and what an operator may do with one."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any
from uuid import UUID

from sqlalchemy import Select, func, or_, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts import second_factor
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.models import Person, SecondFactor, SignIn
from walltopo_gym.accounts.people import normalise_email, sign_out_everywhere
from walltopo_gym.clock import now
from walltopo_gym.errors import ForbiddenError, NotFoundError, RequestError
from walltopo_gym.gyms.models import Gym, Membership
from walltopo_gym.operating.own_data import all_of, delete_account


def users_named(text: str) -> Select[Person]:
    """Return the accounts whose name or address contains a text; all of them for an empty one."""
    found = select(Person)
    if not text:
        return found
    return found.where(
        or_(
            Person.name.icontains(text, autoescape=True),
            Person.email.icontains(text, autoescape=True),
        )
    )


@dataclass(frozen=True)
class UserRole:
    """A role in a gym; `gym` is its slug."""

    gym: str
    role: str


@dataclass(frozen=True)
class UserFacts:
    """Facts beside the row of an account.

    Parameters
    ----------
    browsers : in which the person is signed in.
    """

    second_factor: bool
    browsers: int
    gyms: tuple[UserRole, ...]


def facts_of(session: Session, people: Iterable[UUID]) -> Mapping[UUID, UserFacts]:
    """Return the facts of each of these accounts."""
    ids = list(people)
    factors = set(
        session.scalars(
            select(SecondFactor.person_id).where(
                SecondFactor.person_id.in_(ids), SecondFactor.confirmed_at.is_not(None)
            )
        )
    )
    counted = (
        select(SignIn.person_id, func.count())
        .where(SignIn.person_id.in_(ids), SignIn.expires_at > now())
        .group_by(SignIn.person_id)
    )
    browsers = {row[0]: row[1] for row in session.execute(counted)}
    roles: defaultdict[UUID, list[UserRole]] = defaultdict(list)
    members = (
        select(Membership.person_id, Gym.slug, Membership.role)
        .join(Gym, Gym.id == Membership.gym_id)
        .where(Membership.person_id.in_(ids))
    )
    for person, slug, role in session.execute(members.order_by(Gym.slug)):
        roles[person].append(UserRole(slug, role))
    return {
        person: UserFacts(person in factors, browsers.get(person, 0), tuple(roles[person]))
        for person in ids
    }


def user_of(session: Session, person: UUID) -> Person:
    """Return an account, locked until the transaction ends.

    Raises
    ------
    NotFoundError : there is no such account.
    """
    row = session.scalar(select(Person).where(Person.id == person).with_for_update())
    if row is None:
        raise NotFoundError("not-there-user")
    return row


def lock_user(session: Session, person: UUID, by: UUID | None) -> Person:
    """Lock an account: its sign-ins end, and nobody can sign in or use its tokens. Its data stays.

    Parameters
    ----------
    by : the operator; None: by command.

    Raises
    ------
    ForbiddenError : it is the operator's own; NotFoundError : there is no such account.
    """
    _check_other(person, by)
    row = user_of(session, person)
    row.locked_at = row.locked_at or now()
    sign_out_everywhere(session, person)
    log_change(session, "user.lock", person=by, subject=str(person))
    return row


def unlock_user(session: Session, person: UUID, by: UUID | None) -> Person:
    """Let the owner of a locked account sign in again.

    Parameters
    ----------
    by : the operator; None: by command.

    Raises
    ------
    NotFoundError : there is no such account.
    """
    row = user_of(session, person)
    row.locked_at = None
    log_change(session, "user.unlock", person=by, subject=str(person))
    return row


def sign_out_user(session: Session, person: UUID, by: UUID | None) -> Person:
    """End all sign-ins of an account.

    Parameters
    ----------
    by : the operator; None: by command.

    Raises
    ------
    NotFoundError : there is no such account.
    """
    row = user_of(session, person)
    sign_out_everywhere(session, person)
    log_change(session, "user.sign-out", person=by, subject=str(person))
    return row


def reset_second_factor(session: Session, person: UUID, by: UUID | None) -> Person:
    """Turn the second factor of an account off.

    Parameters
    ----------
    by : the operator; None: by command.

    Raises
    ------
    NotFoundError : there is no such account.
    """
    row = user_of(session, person)
    second_factor.turn_off(session, person, by=by)
    return row


def export_user(session: Session, person: UUID, by: UUID | None) -> dict[str, Any]:
    """Return all data of an account, as its owner gets it.

    Parameters
    ----------
    by : the operator; None: by command.

    Raises
    ------
    NotFoundError : there is no such account.
    """
    user_of(session, person)
    log_change(session, "user.export", person=by, subject=str(person))
    return all_of(session, person)


def delete_user(session: Session, person: UUID, email: str, by: UUID | None) -> None:
    """Delete an account with all of its data.

    Parameters
    ----------
    email : its address, typed for confirmation; by : the operator, None: by command.

    Raises
    ------
    ForbiddenError : it is the operator's own; NotFoundError : there is no such account.
    RequestError : the address is another one; ConflictError : a gym would lose its last owner.
    """
    _check_other(person, by)
    if normalise_email(email) != user_of(session, person).email:
        raise RequestError("user-other-email")
    delete_account(session, person, by=by)


def _check_other(person: UUID, by: UUID | None) -> None:
    if person == by:
        raise ForbiddenError("operator-self")
