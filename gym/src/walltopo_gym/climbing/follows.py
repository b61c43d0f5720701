"""Following people who allow it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from uuid import UUID

from sqlalchemy import Select, delete, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.models import Person, Profile
from walltopo_gym.accounts.people import Audience, profile_of
from walltopo_gym.climbing.kinds import TOPS
from walltopo_gym.climbing.models import Ascent, ClimbingSession, Follow
from walltopo_gym.database.engine import take_turn
from walltopo_gym.errors import NotFoundError, RequestError
from walltopo_gym.gyms.models import Gym, Membership
from walltopo_gym.publishing.models import Route

_MAX = 500
_SHOWN = (Audience.FOLLOWERS, Audience.GYM)


@dataclass(frozen=True)
class Known:
    """A follower or a followed person."""

    person_id: UUID
    name: str
    accepted: bool


@dataclass(frozen=True)
class Friend:
    """A followed person's best ascent of a route."""

    person_id: UUID
    name: str
    kind: str
    tries: int
    discipline: str
    climbed_at: datetime


def follow(session: Session, follower: UUID, followed: UUID) -> Follow:
    """Follow a person: at once if they show their ascents to their gyms, else by a request.

    Raises
    ------
    NotFoundError : no gym in common; RequestError : oneself, or too many.
    """
    if follower == followed:
        raise RequestError("follow-oneself")
    if not gyms_in_common(session, follower, followed):
        raise NotFoundError("not-there-person")
    take_turn(session, f"follows {follower}")
    row = session.get(Follow, (follower, followed))
    if row is None:
        if len(following(session, follower)) >= _MAX:
            raise RequestError("follow-most", "follow-drop-one", most=_MAX)
        is_open = profile_of(session, followed).show_ascents == Audience.GYM
        row = Follow(follower_id=follower, followed_id=followed, accepted=is_open)
        session.add(row)
        session.flush()
    return row


def accept_follow(session: Session, followed: UUID, follower: UUID) -> None:
    """Accept a request to follow.

    Raises
    ------
    NotFoundError : there is no such request.
    """
    row = session.get(Follow, (follower, followed))
    if row is None:
        raise NotFoundError("follow-not-requested")
    row.accepted = True


def remove_follow(session: Session, follower: UUID, followed: UUID) -> None:
    """Unfollow a person or remove a follower; repeating it is fine."""
    gone = delete(Follow).where(Follow.follower_id == follower, Follow.followed_id == followed)
    session.execute(gone)


def following(session: Session, person: UUID) -> list[Known]:
    """Return the followed people, and the requests that wait."""
    rows = select(Person.id, Person.name, Follow.accepted).join(
        Follow, Follow.followed_id == Person.id
    )
    mine = rows.where(Follow.follower_id == person).order_by(Person.name, Person.id)
    return [Known(*row) for row in session.execute(mine)]


def followers(session: Session, person: UUID) -> list[Known]:
    """Return followers and requests to follow, requests first."""
    rows = select(Person.id, Person.name, Follow.accepted).join(
        Follow, Follow.follower_id == Person.id
    )
    mine = rows.where(Follow.followed_id == person)
    ordered = mine.order_by(Follow.accepted, Person.name, Person.id)
    return [Known(*row) for row in session.execute(ordered)]


def is_let(session: Session, follower: UUID, followed: UUID) -> bool:
    """Return whether a follow is accepted."""
    row = session.get(Follow, (follower, followed))
    return row is not None and row.accepted


def followed_by(person: UUID) -> Select[UUID]:
    """Return the ids of the people whom a person follows."""
    return select(Follow.followed_id).where(Follow.follower_id == person, Follow.accepted.is_(True))


def feed(
    session: Session, gym: Gym, person: UUID, before: datetime | None, size: int
) -> Sequence[tuple[ClimbingSession, str]]:
    """Return sessions of followed people in a gym who show theirs, the latest first."""
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
    """Return the followed people who climbed a route, the best first."""
    columns = (
        Person.id,
        Person.name,
        Ascent.kind,
        Ascent.tries,
        Ascent.discipline,
        Ascent.climbed_at,
    )
    rows = session.execute(
        select(*columns)
        .join(Ascent, Ascent.person_id == Person.id)
        .where(
            Ascent.route_id == route.id,
            Ascent.kind.in_(TOPS),
            Ascent.taken_back_at.is_(None),
            Person.id.in_(_shown_to(person, gym)),
        )
        .order_by(Ascent.climbed_at, Ascent.id)
    )
    best: dict[UUID, Friend] = {}
    for friend in sorted(
        (Friend(*row) for row in rows), key=lambda friend: TOPS.index(friend.kind)
    ):
        best.setdefault(friend.person_id, friend)
    return list(best.values())


def gyms_in_common(session: Session, one: UUID, other: UUID) -> Sequence[Gym]:
    """Return the gyms of both people, by name."""
    mine, theirs = (
        select(Membership.gym_id).where(Membership.person_id == who) for who in (one, other)
    )
    both = select(Gym).where(Gym.id.in_(mine), Gym.id.in_(theirs))
    return session.scalars(both.order_by(Gym.name)).all()


def _shown_to(person: UUID, gym: Gym) -> Select[UUID]:
    """Return the followed members of a gym who show their ascents."""
    return (
        followed_by(person)
        .join(Profile, Profile.person_id == Follow.followed_id)
        .join(Membership, Membership.person_id == Follow.followed_id)
        .where(Profile.show_ascents.in_(_SHOWN), Membership.gym_id == gym.id)
    )
