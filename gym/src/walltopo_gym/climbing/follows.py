"""Following: whose sessions one likes to see, with their leave."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from uuid import UUID

from sqlalchemy import Select, delete, select
from sqlalchemy.orm import Session

from walltopo.core import InputError
from walltopo_gym.accounts.models import Person, Profile
from walltopo_gym.accounts.profiles import Audience, profile_of
from walltopo_gym.climbing.counted_models import ClimbingSession
from walltopo_gym.climbing.models import Ascent, Follow
from walltopo_gym.errors import NotFoundError
from walltopo_gym.gyms.models import Gym, Membership
from walltopo_gym.publishing.models import Route

_MOST = 500
_SHOWN = (Audience.FOLLOWERS, Audience.GYM)


@dataclass(frozen=True)
class Known:
    """Somebody at the other end of a follow."""

    person_id: UUID
    name: str
    accepted: bool


@dataclass(frozen=True)
class Friend:
    """What somebody whom one follows did on a route, their best."""

    person_id: UUID
    name: str
    kind: str
    tries: int
    climbed_at: datetime


def follow(session: Session, follower: UUID, followed: UUID) -> Follow:
    """Follow somebody; at once where they show their ascents to their gyms, else they are asked.

    Raises
    ------
    NotFoundError : no gym in common; InputError : oneself, or too many.
    """
    if follower == followed:
        raise InputError("nobody follows themselves")
    if not gyms_in_common(session, follower, followed):
        raise NotFoundError("no such person")
    row = session.get(Follow, (follower, followed))
    if row is None:
        if len(following(session, follower)) >= _MOST:
            raise InputError(f"nobody follows more than {_MOST}", "Let somebody go first.")
        is_open = profile_of(session, followed).show_ascents == Audience.GYM
        row = Follow(follower_id=follower, followed_id=followed, accepted=is_open)
        session.add(row)
        session.flush()
    return row


def accept(session: Session, followed: UUID, follower: UUID) -> None:
    """Let somebody follow who asked.

    Raises
    ------
    NotFoundError : they did not ask.
    """
    row = session.get(Follow, (follower, followed))
    if row is None:
        raise NotFoundError("they did not ask")
    row.accepted = True


def drop(session: Session, follower: UUID, followed: UUID) -> None:
    """Follow no more, or be followed no more; again, too."""
    gone = delete(Follow).where(Follow.follower_id == follower, Follow.followed_id == followed)
    session.execute(gone)


def following(session: Session, person: UUID) -> list[Known]:
    """Whom one follows or asked to."""
    rows = select(Person.id, Person.name, Follow.accepted).join(
        Follow, Follow.followed_id == Person.id
    )
    mine = rows.where(Follow.follower_id == person).order_by(Person.name, Person.id)
    return [Known(*row) for row in session.execute(mine)]


def followers(session: Session, person: UUID) -> list[Known]:
    """Who follows one or asks to; who asks first."""
    rows = select(Person.id, Person.name, Follow.accepted).join(
        Follow, Follow.follower_id == Person.id
    )
    mine = rows.where(Follow.followed_id == person)
    ordered = mine.order_by(Follow.accepted, Person.name, Person.id)
    return [Known(*row) for row in session.execute(ordered)]


def is_let(session: Session, follower: UUID, followed: UUID) -> bool:
    """Whether somebody was let follow."""
    row = session.get(Follow, (follower, followed))
    return row is not None and row.accepted


def followed_by(person: UUID) -> Select[UUID]:
    """Ids of those whom a person was let follow."""
    return select(Follow.followed_id).where(Follow.follower_id == person, Follow.accepted.is_(True))


def feed(
    session: Session, gym: Gym, person: UUID, before: datetime | None, size: int
) -> Sequence[tuple[ClimbingSession, str]]:
    """Sessions in a gym of those whom one follows and who show theirs, the last first."""
    theirs = (
        select(ClimbingSession, Person.name)
        .join(Person, Person.id == ClimbingSession.person_id)
        .where(
            ClimbingSession.gym_id == gym.id,
            ClimbingSession.ascents > 0,
            ClimbingSession.person_id.in_(_shown_to(person, gym)),
        )
    )
    if before is not None:
        theirs = theirs.where(ClimbingSession.began_at < before)
    ordered = theirs.order_by(ClimbingSession.began_at.desc(), ClimbingSession.id).limit(size)
    return session.execute(ordered).all()


def friends_on(session: Session, gym: Gym, route: Route, person: UUID) -> list[Friend]:
    """Who of those whom one follows did a route, and how; who flashed it first."""
    rows = session.execute(
        select(Person.id, Person.name, Ascent.kind, Ascent.tries, Ascent.climbed_at)
        .join(Ascent, Ascent.person_id == Person.id)
        .where(
            Ascent.route_id == route.id,
            Ascent.kind.in_(("flash", "top")),
            Ascent.taken_back_at.is_(None),
            Person.id.in_(_shown_to(person, gym)),
        )
        .order_by(Ascent.kind, Ascent.climbed_at, Ascent.id)
    )
    best: dict[UUID, Friend] = {}
    for row in rows:
        best.setdefault(row[0], Friend(*row))
    return list(best.values())


def gyms_in_common(session: Session, one: UUID, other: UUID) -> Sequence[Gym]:
    """The gyms that both belong to, by name."""
    mine, theirs = (
        select(Membership.gym_id).where(Membership.person_id == who) for who in (one, other)
    )
    both = select(Gym).where(Gym.id.in_(mine), Gym.id.in_(theirs))
    return session.scalars(both.order_by(Gym.name)).all()


def _shown_to(person: UUID, gym: Gym) -> Select[UUID]:
    """Members of a gym whom one was let follow, and who show their ascents."""
    return (
        followed_by(person)
        .join(Profile, Profile.person_id == Follow.followed_id)
        .join(Membership, Membership.person_id == Follow.followed_id)
        .where(Profile.show_ascents.in_(_SHOWN), Membership.gym_id == gym.id)
    )
