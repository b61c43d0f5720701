"""Find the messages that are due by the clock: the week's summary, an evening's new routes,
projects that will be stripped."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import date, datetime, time, timedelta
from functools import partial
from typing import Any, Final
from uuid import UUID

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from walltopo_gym.climbing.kinds import TOPS
from walltopo_gym.climbing.models import Ascent
from walltopo_gym.clock import now
from walltopo_gym.database.engine import Database
from walltopo_gym.gyms.days import today, zone_of
from walltopo_gym.gyms.models import Gym, Membership
from walltopo_gym.notifications.messages import (
    DIGEST,
    MAIL,
    Notice,
    Row,
    Shown,
    message_row,
    push_rows,
    recipient_preferences,
    store_messages,
    unstored_messages,
)
from walltopo_gym.notifications.models import Message, NotificationPreferences
from walltopo_gym.publishing.models import Route
from walltopo_gym.publishing.new_routes import new_routes
from walltopo_gym.publishing.versions import gym_routes
from walltopo_gym.scans.models import Scan
from walltopo_gym.walls.models import Wall
from walltopo_gym.words import Words, words_in

_LOG = logging.getLogger("walltopo_gym.notifications")
# The week's summary goes on Monday from eight by the gym's clock; a late worker catches up.
_DIGEST_AT: Final = time(8)
_DIGEST_LATE: Final = timedelta(days=2)
_WEEK: Final = 7
_SOON: Final = timedelta(days=3)
# One message for the walls of an evening: it waits until nothing more was published for a while.
_SETTLED: Final = timedelta(minutes=10)
_LATE: Final = timedelta(hours=12)
_KEPT: Final = timedelta(days=120)
_LINES: Final = 40


def store_due_messages(database: Database) -> int:
    """Store the messages that are due now; return how many are new."""
    members = select(Membership.gym_id).join(
        NotificationPreferences, NotificationPreferences.person_id == Membership.person_id
    )
    with database.reading() as session:
        gyms = session.scalars(select(Gym).where(Gym.id.in_(members))).all()
        new = unstored_messages(
            session, [row for gym in gyms for row in _of_gym_alone(session, gym)]
        )
    if not new:
        return 0
    with database.writing() as session:
        session.execute(delete(Message).where(Message.created_at < now() - _KEPT))
        return store_messages(session, new)


def _of_gym_alone(session: Session, gym: Gym) -> list[Row]:
    """Return a gym's messages; none on an error, so that other gyms do not wait."""
    try:
        with session.begin_nested():
            return [
                *_due_digests(session, gym),
                *_new_routes(session, gym),
                *_projects_that_go(session, gym),
            ]
    except Exception:
        _LOG.exception("gym %s: its messages cannot be made", gym.slug)
        return []


def _due_digests(session: Session, gym: Gym) -> Iterator[Row]:
    zone = zone_of(gym)
    local = now().astimezone(zone)
    monday = local.date() - timedelta(days=local.weekday())
    due = datetime.combine(monday, _DIGEST_AT, zone)
    if not due <= local < due + _DIGEST_LATE:
        return
    to = recipient_preferences(session, gym.id, DIGEST)
    if not to:
        return
    new = new_routes(session, gym, _WEEK + 1)
    walls = {wall.id: wall for wall in session.scalars(select(Wall).filter_by(gym_id=gym.id))}
    subject = f"{gym.id} {monday}"
    for preferences in to:
        goes = _projects_until(
            session, gym, preferences.person_id, monday + timedelta(days=2 * _WEEK)
        )
        week = _Week(new, goes, walls)
        if preferences.digest_by == "push":
            shown = partial(_digest_push, gym, week)
            notice = Notice(DIGEST, subject, f"{DIGEST} {gym.id}", DIGEST, shown)
            rows = push_rows(session, gym, notice, [preferences])
        else:
            body = _digest_mail(gym, week, words_in(preferences.language))
            rows = [message_row(gym, preferences.person_id, DIGEST, subject, MAIL, body)]
        # A week without news is noted too, and nothing is sent.
        yield from rows if new or goes else [row | {"body": {}, "sent_at": now()} for row in rows]


@dataclass(frozen=True)
class _Week:
    """The content of a digest: new routes, a person's projects that go soon, and the gym's walls by
    id."""

    new: list[Route]
    goes: list[Route]
    walls: dict[UUID, Wall]


def _digest_push(gym: Gym, week: _Week, words: Words) -> Shown:
    parts = [("push_new", week.new), ("push_goes", week.goes)]
    text = ". ".join(words.say(key, number=len(routes)) for key, routes in parts if routes)
    return Shown(words.say("digest", gym=gym.name), text, f"/g/{gym.slug}")


def _digest_mail(gym: Gym, week: _Week, words: Words) -> dict[str, Any]:
    lines = []
    if week.new:
        lines += [words.say("digest_lead", gym=gym.name), ""]
        for wall in week.walls.values():
            here = [route for route in week.new if route.wall_id == wall.id]
            lines += [f"{wall.name}: {len(here)}"] if here else []
            lines += [f"  {_route_label(route, words)}" for route in here[:_LINES]]
        lines.append("")
    if week.goes:
        lines += [words.say("digest_goes"), ""]
        for route in week.goes[:_LINES]:
            until = words.say("until", day=words.day(_day(route)))
            wall_name = week.walls[route.wall_id].name
            lines.append(f"  {_route_label(route, words)} ({wall_name}), {until}")
        lines.append("")
    return {"subject": words.say("digest", gym=gym.name), "lines": lines}


def _route_label(route: Route, words: Words) -> str:
    parts = (route.name or words.colour(route.colour), route.grade, route.setter)
    return ", ".join(filter(None, parts))


def _new_routes(session: Session, gym: Gym) -> Iterator[Row]:
    """Return messages about new routes, once the evening's last wall is published."""
    published = session.scalars(
        select(Scan.published_at)
        .join(Wall, Wall.id == Scan.wall_id)
        .where(Wall.gym_id == gym.id, Scan.published_at > now() - _LATE)
    ).all()
    moments = [at for at in published if at is not None]
    if not moments or max(moments) > now() - _SETTLED:
        return
    to = recipient_preferences(session, gym.id, "new_routes")
    if not to:
        return
    # Set by these publications, not named in one that only corrects.
    new = [
        route
        for route, _ in gym_routes(session, gym.id)
        if route.created_at >= min(moments) - _SETTLED
    ]
    if not new:
        return
    names = {wall.id: wall.name for wall in session.scalars(select(Wall).filter_by(gym_id=gym.id))}
    walls = ", ".join(dict.fromkeys(names[route.wall_id] for route in new))

    def shown(words: Words) -> Shown:
        title = f"{gym.name}: {words.say('push_new', number=len(new))}"
        return Shown(title, walls, f"/g/{gym.slug}")

    subject = f"{gym.id} {today(gym)}"
    yield from push_rows(
        session, gym, Notice("new_routes", subject, subject, "new_routes", shown), to
    )


def _projects_that_go(session: Session, gym: Gym) -> Iterator[Row]:
    to = recipient_preferences(session, gym.id, "soon")
    if not to:
        return
    names = {wall.id: wall.name for wall in session.scalars(select(Wall).filter_by(gym_id=gym.id))}
    for preferences in to:
        for route in _projects_until(session, gym, preferences.person_id, today(gym) + _SOON):
            subject = f"{route.id} {route.strip_on}"
            shown = partial(_stripping_message, gym, names[route.wall_id], route)
            notice = Notice("soon", subject, str(route.id), "soon", shown)
            yield from push_rows(session, gym, notice, [preferences])


def _stripping_message(gym: Gym, wall: str, route: Route, words: Words) -> Shown:
    """Return the message that a route will be stripped."""
    name = route.name or words.colour(route.colour)
    text = words.say("push_soon_text", route=name, wall=wall, day=words.day(_day(route)))
    return Shown(words.say("push_soon"), text, f"/g/{gym.slug}/w/{route.wall_id}/r/{route.id}")


def _projects_until(session: Session, gym: Gym, person: UUID, until: date) -> list[Route]:
    """Return a person's unfinished projects that will be stripped by a day."""
    mine = session.execute(
        select(Ascent.kind, Route)
        .join(Route, Route.id == Ascent.route_id)
        .join(Wall, Wall.id == Route.wall_id)
        .where(Ascent.person_id == person, Ascent.taken_back_at.is_(None))
        .where(Wall.gym_id == gym.id, Route.stripped_at.is_(None))
        .where(Route.strip_on >= today(gym), Route.strip_on <= until)
    ).all()
    done = {route.id for kind, route in mine if kind in TOPS}
    found = {route.id: route for kind, route in mine if kind == "project" and route.id not in done}
    return sorted(found.values(), key=_day)


def _day(route: Route) -> date:
    assert route.strip_on is not None
    return route.strip_on
