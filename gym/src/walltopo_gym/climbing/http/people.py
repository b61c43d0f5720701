"""Profiles, follows and leaderboards."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from datetime import datetime
from typing import Annotated, Literal
from uuid import UUID

from fastapi import APIRouter, Query
from pydantic import BaseModel, Field
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.access import SignedInMay
from walltopo_gym.accounts.actor import Scope
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.models import Profile
from walltopo_gym.accounts.people import Audience, Category, profile_of
from walltopo_gym.api.fields import Body, Digits, Moment, Text
from walltopo_gym.api.services import Db
from walltopo_gym.climbing.ascents import own_ascent
from walltopo_gym.climbing.boards import Age, BoardQuery, board, circuits, month_of
from walltopo_gym.climbing.follows import (
    accept_follow,
    feed,
    follow,
    followers,
    following,
    friends_on,
    remove_follow,
)
from walltopo_gym.climbing.http.sessions import SessionOut, session_out
from walltopo_gym.climbing.kinds import Kind
from walltopo_gym.climbing.models import Ascent
from walltopo_gym.climbing.people import MAX_PINS, view_person
from walltopo_gym.climbing.points import BEST, FLASH, ONSIGHT
from walltopo_gym.clock import now
from walltopo_gym.database.engine import take_turn
from walltopo_gym.errors import ConflictError, NotFoundError
from walltopo_gym.gyms.access import Access, gym_rule
from walltopo_gym.gyms.models import Gym
from walltopo_gym.gyms.roles import Role
from walltopo_gym.publishing.models import Route
from walltopo_gym.publishing.versions import route_of
from walltopo_gym.walls.disciplines import Discipline, counted_as
from walltopo_gym.walls.lookup import disciplines_of
from walltopo_gym.walls.models import Wall

router = APIRouter(tags=["profiles"])

Length = Annotated[int | None, Field(ge=50, le=280)]


class ProfileIn(Body):
    """The complete visibility settings. `on_boards`: boards list the person; `on_screens`: public
    boards do too, in the hall and on the gym's website.

    Body data is shown to the audience in `show_body`, and the app chooses the body of suggested
    moves by it.
    """

    on_boards: bool = False
    on_screens: bool = False
    category: Category = Category.UNSAID
    birth_year: int | None = Field(None, ge=1900, le=2100)
    show_ascents: Audience = Audience.NOBODY
    show_pins: Audience = Audience.NOBODY
    show_body: Audience = Audience.NOBODY
    height_cm: Length = None
    reach_cm: Length = None


class GymName(BaseModel):
    """A gym of both people."""

    slug: str
    name: str


class BodyOut(BaseModel):
    """Height and reach, fingertip to fingertip, in centimetres."""

    height_cm: int | None
    reach_cm: int | None


class SeenAscent(BaseModel):
    """An ascent without its private note, with its wall's id."""

    id: UUID
    route_id: UUID | None
    gym_name: str
    route_name: str
    grade: str
    kind: Kind
    tries: int
    discipline: Discipline
    climbed_at: datetime
    gym_slug: str | None = None
    wall_id: UUID | None = None


class PersonOut(BaseModel):
    """A person as the viewer may see them; hidden fields are null."""

    id: UUID
    name: str
    since: datetime
    gyms: list[GymName]
    ascents: list[SeenAscent] | None
    pins: list[SeenAscent] | None
    body: BodyOut | None


@router.get("/me/profile")
def read_profile(session: Db, actor: SignedInMay) -> ProfileIn:
    """Return one's own visibility settings."""
    return ProfileIn.model_validate(profile_of(session, actor.known), from_attributes=True)


@router.put("/me/profile")
def put_profile(body: ProfileIn, session: Db, actor: SignedInMay) -> ProfileIn:
    """Change one's own visibility settings."""
    session.merge(Profile(person_id=actor.known, changed_at=now(), **body.model_dump()))
    log_change(session, "person.profile", person=actor.known)
    return body


@router.get("/people/{person}")
def read_person(person: UUID, session: Db, actor: SignedInMay) -> PersonOut:
    """Return a person who shares a gym with the viewer; 404 for all others."""
    seen = view_person(session, actor.known, person)
    shown = seen.body
    body = None if shown is None else BodyOut.model_validate(shown, from_attributes=True)
    return PersonOut(
        id=seen.person.id,
        name=seen.person.name,
        since=seen.person.created_at,
        gyms=[GymName.model_validate(gym, from_attributes=True) for gym in seen.gyms],
        ascents=_seen_ascents(session, seen.ascents),
        pins=_seen_ascents(session, seen.pins),
        body=body,
    )


@router.put("/me/pins/{ascent}", status_code=204)
def pin_ascent(ascent: UUID, session: Db, actor: SignedInMay) -> None:
    """Pin an ascent to one's profile; repeating it is fine."""
    take_turn(session, f"pins {actor.known}")
    row = own_ascent(session, ascent, actor.known)
    count = select(func.count()).where(
        Ascent.person_id == actor.known, Ascent.pinned_at.is_not(None)
    )
    if row.pinned_at is None and (session.scalar(count) or 0) >= MAX_PINS:
        raise ConflictError("pins-most", "pins-take-off", most=MAX_PINS)
    row.pinned_at = row.pinned_at or now()


@router.delete("/me/pins/{ascent}", status_code=204)
def unpin_ascent(ascent: UUID, session: Db, actor: SignedInMay) -> None:
    """Unpin an ascent; repeating it is fine."""
    own_ascent(session, ascent, actor.known).pinned_at = None


def _seen_ascents(session: Session, rows: Sequence[Ascent] | None) -> list[SeenAscent] | None:
    if rows is None:
        return None
    walls = (
        select(Route.id, Wall.id, Gym.slug)
        .join(Wall, Wall.id == Route.wall_id)
        .join(Gym, Gym.id == Wall.gym_id)
        .where(Route.id.in_({row.route_id for row in rows}))
    )
    places = {route: (wall, slug) for route, wall, slug in session.execute(walls)}
    listed = []
    for row in rows:
        facts = SeenAscent.model_validate(row, from_attributes=True)
        if facts.route_id in places:
            facts.wall_id, facts.gym_slug = places[facts.route_id]
        listed.append(facts)
    return listed


follows_router = APIRouter(tags=["follows"])

ReaderMay = Annotated[Access, gym_rule(Role.MEMBER, Scope.READ)]


class KnownOut(BaseModel):
    """A follower or a followed person; `accepted` is false for a request."""

    person_id: UUID
    name: str
    accepted: bool


class Follows(BaseModel):
    """Followed people and followers; `feed`: whether the feed is on."""

    following: list[KnownOut]
    followers: list[KnownOut]
    feed: bool


class FollowState(BaseModel):
    """Whether the follow is accepted already."""

    accepted: bool


class FeedIn(Body):
    """Whether the feed is on."""

    on: bool


class FeedItem(SessionOut):
    """A session of a followed person."""

    name: str


class Feed(BaseModel):
    """Sessions, the latest first; empty if the feed is off."""

    on: bool
    items: list[FeedItem]


class FriendOut(BaseModel):
    """A person's best ascent of a route."""

    person_id: UUID
    name: str
    kind: Kind
    tries: int
    discipline: Discipline
    climbed_at: datetime


@follows_router.get("/me/follows")
def list_follows(session: Db, actor: SignedInMay) -> Follows:
    """Return followed people and followers."""
    ways = following(session, actor.known), followers(session, actor.known)
    ways_facts = [[KnownOut(**vars(known)) for known in way] for way in ways]
    is_on = profile_of(session, actor.known).feed
    return Follows(following=ways_facts[0], followers=ways_facts[1], feed=is_on)


@follows_router.put("/me/following/{person}")
def follow_person(person: UUID, session: Db, actor: SignedInMay) -> FollowState:
    """Follow a person of one's gyms; if their ascents are not open, send a request."""
    return FollowState(accepted=follow(session, actor.known, person).accepted)


@follows_router.delete("/me/following/{person}", status_code=204)
def unfollow_person(person: UUID, session: Db, actor: SignedInMay) -> None:
    """Unfollow a person; repeating it is fine."""
    remove_follow(session, actor.known, person)


@follows_router.put("/me/followers/{person}", status_code=204)
def accept_follower(person: UUID, session: Db, actor: SignedInMay) -> None:
    """Accept a request to follow."""
    accept_follow(session, actor.known, person)


@follows_router.delete("/me/followers/{person}", status_code=204)
def drop_follower(person: UUID, session: Db, actor: SignedInMay) -> None:
    """Remove a follower or decline a request, without a notice."""
    remove_follow(session, person, actor.known)


@follows_router.put("/me/feed", status_code=204)
def set_feed(body: FeedIn, session: Db, actor: SignedInMay) -> None:
    """Turn the feed on or off."""
    row = profile_of(session, actor.known)
    row.feed = body.on
    session.add(row)


@follows_router.get("/gyms/{gym}/feed")
def read_feed(
    session: Db,
    access: ReaderMay,
    before: Annotated[Moment | None, Query(description="begun before")] = None,
    size: Annotated[Digits, Query(ge=1, le=100)] = 30,
) -> Feed:
    """Return sessions of followed people in this gym."""
    me = access.actor.known
    if not profile_of(session, me).feed:
        return Feed(on=False, items=[])
    rows = feed(session, access.gym, me, before, size)
    items = [FeedItem(**dict(session_out(row, access.gym)), name=name) for row, name in rows]
    return Feed(on=True, items=items)


@follows_router.get("/gyms/{gym}/routes/{route}/friends")
def list_friends_here(route: UUID, session: Db, access: ReaderMay) -> list[FriendOut]:
    """Return the followed people who topped a route."""
    found = route_of(session, access.gym.id, route)
    friends_here = friends_on(session, access.gym, found, access.actor.known)
    return [FriendOut(**vars(friend)) for friend in friends_here]


boards_router = APIRouter(tags=["boards"])


class LineOut(BaseModel):
    """A place on a board; equal points are an equal rank (1, 2, 2, 4)."""

    rank: int
    person_id: UUID
    name: str
    points: int
    tops: int
    flashes: int


class CircuitOut(BaseModel):
    """A circuit with a board of its own."""

    label: str
    colour: str


class BoardOut(BaseModel):
    """Some lines of a board; `of` is their total number. `own` is the viewer's place, actual or
    hypothetical; `shown`: others see the viewer on boards. `disciplines`: those of the gym, each
    with a board of its own. `best`, `flash`, `onsight`: constants of the point rule."""

    period: str
    disciplines: list[Discipline]
    lines: list[LineOut]
    of: int
    own: LineOut | None
    shown: bool
    categories: bool
    circuits: list[CircuitOut]
    best: int
    flash: int
    onsight: int


@boards_router.get("/gyms/{gym}/board")
def read_board(
    session: Db,
    access: ReaderMay,
    period: Annotated[
        str,
        Query(
            pattern=r"^([0-9]{4}(-(0[1-9]|1[0-2]))?|all)?$",
            description='"2026-03", "2026" or "all"; empty: this month',
        ),
    ] = "",
    discipline: Discipline = Discipline.BOULDER,
    circuit: Text = "",
    category: Literal["", "women", "men", "other"] = "",
    age: Age = "",
    friends: bool = False,
    size: Annotated[Digits, Query(ge=1, le=200)] = 50,
    skip: Annotated[Digits, Query(ge=0, le=1_000_000)] = 0,
) -> BoardOut:
    """Return the board by points: the sum of the best ten routes of a period, of people who agreed
    to be listed."""
    gym = session.get_one(Gym, access.gym.id)
    if gym.boards == "off":
        raise NotFoundError("board-off")
    if gym.boards != "categories":
        category, age = "", ""
    me, at = access.actor.known, now()
    friends_of = me if friends else None
    query = BoardQuery(
        period or month_of(gym, at), circuit, category, age, friends_of, counted_as(discipline)
    )
    page = board(session, gym, query, me, at, size, skip)
    return BoardOut(
        period=query.period,
        disciplines=disciplines_of(session, gym.id),
        lines=[LineOut(**asdict(line)) for line in page.lines],
        of=page.of,
        own=None if page.own is None else LineOut(**asdict(page.own)),
        shown=profile_of(session, me).on_boards,
        categories=gym.boards == "categories",
        circuits=[CircuitOut(**circuit) for circuit in circuits(session, gym)],
        best=BEST,
        flash=FLASH,
        onsight=ONSIGHT,
    )
