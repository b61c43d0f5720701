"""Whom one follows, who follows one, and what the former climbed."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated
from uuid import UUID

from fastapi import APIRouter, Query
from pydantic import BaseModel

from walltopo_gym.accounts.actor import Scope
from walltopo_gym.accounts.profiles import profile_of
from walltopo_gym.api.climbing_sessions import SessionFacts, session_facts
from walltopo_gym.api.fields import Body, Moment
from walltopo_gym.api.routes import route_of
from walltopo_gym.api.rules import Access, SignedInMay, gym_rule
from walltopo_gym.api.services import Db
from walltopo_gym.climbing.follows import (
    accept,
    drop,
    feed,
    follow,
    followers,
    following,
    friends_on,
)
from walltopo_gym.gyms.roles import Role

router = APIRouter(tags=["follows"])

ReaderMay = Annotated[Access, gym_rule(Role.MEMBER, Scope.READ)]


class KnownFacts(BaseModel):
    """Somebody whom one follows or who follows one; not `accepted`: it is only asked for."""

    person_id: UUID
    name: str
    accepted: bool


class Follows(BaseModel):
    """Both ways; `feed`: one likes to see what those climb whom one follows."""

    following: list[KnownFacts]
    followers: list[KnownFacts]
    feed: bool


class FollowState(BaseModel):
    """Whether one was let follow already."""

    accepted: bool


class FeedWish(Body):
    """Whether one likes to see a feed."""

    on: bool


class FeedItem(SessionFacts):
    """A session of somebody whom one follows."""

    name: str


class Feed(BaseModel):
    """The last first; nothing where one has turned it off."""

    on: bool
    items: list[FeedItem]


class FriendFacts(BaseModel):
    """Somebody's best ascent of a route."""

    person_id: UUID
    name: str
    kind: str
    tries: int
    climbed_at: datetime


@router.get("/me/follows")
def list_follows(session: Db, actor: SignedInMay) -> Follows:
    """Whom one follows, and who follows one."""
    ways = following(session, actor.known), followers(session, actor.known)
    told = [[KnownFacts(**vars(known)) for known in way] for way in ways]
    is_on = profile_of(session, actor.known).feed
    return Follows(following=told[0], followers=told[1], feed=is_on)


@router.put("/me/following/{person}")
def follow_person(person: UUID, session: Db, actor: SignedInMay) -> FollowState:
    """Follow somebody of a gym of one's own; where they have not opened it they are asked."""
    return FollowState(accepted=follow(session, actor.known, person).accepted)


@router.delete("/me/following/{person}", status_code=204)
def unfollow_person(person: UUID, session: Db, actor: SignedInMay) -> None:
    """Follow somebody no more; again, too."""
    drop(session, actor.known, person)


@router.put("/me/followers/{person}", status_code=204)
def accept_follower(person: UUID, session: Db, actor: SignedInMay) -> None:
    """Let somebody follow who asked."""
    accept(session, actor.known, person)


@router.delete("/me/followers/{person}", status_code=204)
def drop_follower(person: UUID, session: Db, actor: SignedInMay) -> None:
    """Let somebody follow no more, or not at all; they are not told."""
    drop(session, person, actor.known)


@router.put("/me/feed", status_code=204)
def set_feed(body: FeedWish, session: Db, actor: SignedInMay) -> None:
    """Turn the feed on or off."""
    row = profile_of(session, actor.known)
    row.feed = body.on
    session.add(row)


@router.get("/gyms/{gym}/feed")
def read_feed(
    session: Db, access: ReaderMay,
    before: Annotated[Moment | None, Query(description="begun before")] = None,
    size: Annotated[int, Query(ge=1, le=100)] = 30,
) -> Feed:  # fmt: skip
    """What those climbed in this gym whom one follows."""
    me = access.actor.known
    if not profile_of(session, me).feed:
        return Feed(on=False, items=[])
    rows = feed(session, access.gym, me, before, size)
    items = [FeedItem(**dict(session_facts(row, access.gym)), name=name) for row, name in rows]
    return Feed(on=True, items=items)


@router.get("/gyms/{gym}/routes/{route}/friends")
def list_friends_here(route: UUID, session: Db, access: ReaderMay) -> list[FriendFacts]:
    """Who of those whom one follows topped a route."""
    found = route_of(session, access, route)
    told = friends_on(session, access.gym, found, access.actor.known)
    return [FriendFacts(**vars(friend)) for friend in told]
