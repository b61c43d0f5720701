"""What is to be told to whom: noted as messages, each once, whoever looks and how often.

A message's person, kind, subject and way are unique in its table: two workers that note the same
thing at the same moment note it once.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from datetime import date, datetime, time, timedelta
from typing import Any, Final
from uuid import UUID, uuid4

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from walltopo_gym.climbing.counting import zone_of
from walltopo_gym.climbing.models import Ascent
from walltopo_gym.clock import now
from walltopo_gym.competitions.models import Competition, Entry
from walltopo_gym.database.engine import Database
from walltopo_gym.gyms.models import Gym, Membership, Wall
from walltopo_gym.hall.fresh import fresh, today
from walltopo_gym.hall.models import Message, PushAddress, Wishes
from walltopo_gym.hall.words import Words, words_in
from walltopo_gym.publishing.hanging import gym_routes
from walltopo_gym.publishing.models import Route
from walltopo_gym.scans.models import Scan

_LOG = logging.getLogger("walltopo_gym.hall")
DIGEST: Final = "digest"
_MAIL: Final = "mail"
# The week's mail goes on Monday from eight by the gym's clock; a worker that was away catches up.
_DIGEST_AT: Final = time(8)
_DIGEST_LATE: Final = timedelta(days=2)
_WEEK: Final = 7
_SOON: Final = timedelta(days=3)
# Of the walls of an evening one message: it waits until nothing more was published for a while.
_SETTLED: Final = timedelta(minutes=10)
_LATE: Final = timedelta(hours=12)
_BEGINS: Final = timedelta(hours=24)
_KEPT: Final = timedelta(days=120)
_LINES: Final = 40


def note_all(database: Database) -> int:
    """Note what is to be told now; how many messages are new."""
    asked = select(Membership.gym_id).join(Wishes, Wishes.person_id == Membership.person_id)
    with database.reading() as session:
        gyms = session.scalars(select(Gym).where(Gym.id.in_(asked))).all()
        rows = [row for gym in gyms for row in _of_gym_alone(session, gym)]
        there = select(Message.person_id, Message.kind, Message.subject, Message.target)
        subjects = {row["subject"] for row in rows}
        known = {tuple(row) for row in session.execute(there.where(Message.subject.in_(subjects)))}
    wanted = {(r["person_id"], r["kind"], r["subject"], r["target"]): r for r in rows}
    new = [row for key, row in wanted.items() if key not in known]
    if new:
        with database.writing() as session:
            session.execute(delete(Message).where(Message.created_at < now() - _KEPT))
            for row in new:
                session.execute(_once(database, row))
    return len(new)


def _once(database: Database, row: dict[str, Any]) -> Any:
    """An insertion that does nothing where another worker was first."""
    if database.is_sqlite:
        from sqlalchemy.dialects.sqlite import insert as here
    else:
        from sqlalchemy.dialects.postgresql import insert as here  # type: ignore[assignment]
    return here(Message).values(**row).on_conflict_do_nothing()


def _of_gym_alone(session: Session, gym: Gym) -> list[dict[str, Any]]:
    """Return a gym's messages; where they cannot be made, none: other gyms do not wait for it."""
    try:
        with session.begin_nested():
            return list(_of_gym(session, gym))
    except Exception:
        _LOG.exception("gym %s: its messages cannot be made", gym.slug)
        return []


def _of_gym(session: Session, gym: Gym) -> Iterator[dict[str, Any]]:
    rows = session.scalars(
        select(Wishes)
        .join(Membership, Membership.person_id == Wishes.person_id)
        .where(Membership.gym_id == gym.id)
    ).all()
    if not rows:
        return
    yield from _digests(session, gym, [wishes for wishes in rows if wishes.digest])
    browsers: dict[UUID, list[UUID]] = {}
    people = [wishes.person_id for wishes in rows]
    for address in session.scalars(select(PushAddress).where(PushAddress.person_id.in_(people))):
        browsers.setdefault(address.person_id, []).append(address.id)
    told = [wishes for wishes in rows if wishes.person_id in browsers]
    occasions = (
        *_fresh(session, gym, told), *_soon(session, gym, told), *_begins(session, gym, told),
    )  # fmt: skip
    for wishes, kind, subject, body in occasions:
        for browser in browsers[wishes.person_id]:
            yield _row(gym, wishes.person_id, kind, subject, str(browser), body)


Told = tuple[Wishes, str, str, dict[str, Any]]


def _digests(session: Session, gym: Gym, asked: list[Wishes]) -> Iterator[dict[str, Any]]:
    zone = zone_of(gym)
    local = now().astimezone(zone)
    monday = local.date() - timedelta(days=local.weekday())
    due = datetime.combine(monday, _DIGEST_AT, zone)
    if not asked or not due <= local < due + _DIGEST_LATE:
        return
    new = fresh(session, gym, _WEEK + 1)
    walls = {wall.id: wall for wall in session.scalars(select(Wall).filter_by(gym_id=gym.id))}
    for wishes in asked:
        words = words_in(wishes.language)
        goes = _projects(session, gym, wishes.person_id, monday + timedelta(days=2 * _WEEK))
        body: dict[str, Any] = {}
        if new or goes:
            lines = _letter(gym, words, new, goes, walls)
            body = {"subject": words.say("digest", gym=gym.name), "lines": lines}
        # A week without news is noted too, and nothing is sent.
        row = _row(gym, wishes.person_id, DIGEST, f"{gym.id} {monday}", _MAIL, body)
        yield row if body else row | {"sent_at": now()}


def _letter(
    gym: Gym, words: Words, new: list[Route], goes: list[Route], walls: dict[UUID, Wall]
) -> list[str]:
    lines = []
    if new:
        lines += [words.say("digest_lead", gym=gym.name), ""]
        for wall in walls.values():
            here = [route for route in new if route.wall_id == wall.id]
            lines += [f"{wall.name}: {len(here)}"] if here else []
            lines += [f"  {_named(route, words)}" for route in here[:_LINES]]
        lines.append("")
    if goes:
        lines += [words.say("digest_goes"), ""]
        for route in goes[:_LINES]:
            until = words.say("until", day=words.day(_day(route)))
            lines.append(f"  {_named(route, words)} ({walls[route.wall_id].name}), {until}")
        lines.append("")
    return lines


def _named(route: Route, words: Words) -> str:
    told = (route.name or words.colour(route.colour), route.grade, route.setter)
    return ", ".join(filter(None, told))


def _fresh(session: Session, gym: Gym, asked: list[Wishes]) -> Iterator[Told]:
    """New routes, when the evening's last wall stands."""
    published = session.scalars(
        select(Scan.published_at)
        .join(Wall, Wall.id == Scan.wall_id)
        .where(Wall.gym_id == gym.id, Scan.published_at > now() - _LATE)
    ).all()
    moments = [at for at in published if at is not None]
    asked = [wishes for wishes in asked if wishes.fresh]
    if not asked or not moments or max(moments) > now() - _SETTLED:
        return
    # Set by these publications, not named in one that only corrects.
    new = [route for route, _ in gym_routes(session, gym.id)
           if route.created_at >= min(moments) - _SETTLED]  # fmt: skip
    if not new:
        return
    names = {wall.id: wall.name for wall in session.scalars(select(Wall).filter_by(gym_id=gym.id))}
    walls = ", ".join(dict.fromkeys(names[route.wall_id] for route in new))
    for wishes in asked:
        words = words_in(wishes.language)
        title = f"{gym.name}: {words.say('push_new', number=len(new))}"
        subject = f"{gym.id} {today(gym)}"
        yield wishes, "fresh", subject, _shown(title, walls, f"/g/{gym.slug}", subject)


def _soon(session: Session, gym: Gym, asked: list[Wishes]) -> Iterator[Told]:
    names = {wall.id: wall.name for wall in session.scalars(select(Wall).filter_by(gym_id=gym.id))}
    for wishes in asked:
        if not wishes.soon:
            continue
        words = words_in(wishes.language)
        for route in _projects(session, gym, wishes.person_id, today(gym) + _SOON):
            text = words.say("push_soon_text", route=route.name or words.colour(route.colour),
                             wall=names[route.wall_id], day=words.day(_day(route)))  # fmt: skip
            path = f"/g/{gym.slug}/w/{route.wall_id}/r/{route.id}"
            body = _shown(words.say("push_soon"), text, path, str(route.id))
            yield wishes, "soon", f"{route.id} {route.strip_on}", body


def _begins(session: Session, gym: Gym, asked: list[Wishes]) -> Iterator[Told]:
    """Competitions that begin within hours."""
    entered = session.execute(
        select(Competition, Entry.person_id)
        .join(Entry, Entry.competition_id == Competition.id)
        .where(Competition.gym_id == gym.id, Competition.state != "draft")
        .where(Competition.starts_at > now(), Competition.starts_at < now() + _BEGINS)
        .where(Entry.withdrawn.is_(False), Entry.person_id.is_not(None))
    ).all()
    for wishes in asked:
        words = words_in(wishes.language)
        for competition, person in entered:
            if not wishes.competitions or person != wishes.person_id:
                continue
            assert competition.starts_at is not None
            at = competition.starts_at.astimezone(zone_of(gym))
            text = f"{gym.name}, {words.day(at.date())}, {at:%H:%M}"
            path = f"/g/{gym.slug}/competitions/{competition.id}"
            title = words.say("push_competition", name=competition.name)
            subject = f"{competition.id} {at.date()}"
            yield wishes, "begins", subject, _shown(title, text, path, str(competition.id))


def _projects(session: Session, gym: Gym, person: UUID, until: date) -> list[Route]:
    """What somebody works on and has not done, that goes by a day."""
    mine = session.execute(
        select(Ascent.kind, Route)
        .join(Route, Route.id == Ascent.route_id)
        .join(Wall, Wall.id == Route.wall_id)
        .where(Ascent.person_id == person, Ascent.taken_back_at.is_(None))
        .where(Wall.gym_id == gym.id, Route.stripped_at.is_(None))
        .where(Route.strip_on >= today(gym), Route.strip_on <= until)
    ).all()
    done = {route.id for kind, route in mine if kind in ("flash", "top")}
    found = {route.id: route for kind, route in mine if kind == "project" and route.id not in done}
    return sorted(found.values(), key=_day)


def _day(route: Route) -> date:
    assert route.strip_on is not None
    return route.strip_on


def _shown(title: str, text: str, path: str, tag: str) -> dict[str, Any]:
    return {"title": title, "text": text[:300], "path": path, "tag": tag}


def _row(
    gym: Gym, person: UUID, kind: str, subject: str, target: str, body: dict[str, Any]
) -> dict[str, Any]:
    at = now()
    return {
        "id": uuid4(), "created_at": at, "person_id": person, "gym_id": gym.id, "kind": kind,
        "subject": subject, "target": target, "body": body, "next_at": at, "tries": 0,
        "sent_at": None, "error": "",
    }  # fmt: skip
