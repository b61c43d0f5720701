"""Find the messages that are due and store each once, however many workers look.

Person, kind, subject and channel of a message are unique in its table, so two workers that find the
same message at the same moment store it once.
"""

from __future__ import annotations

import logging
from collections.abc import Collection, Iterator, Sequence
from datetime import date, datetime, time, timedelta
from typing import Any, Final
from uuid import UUID, uuid4

from sqlalchemy import ColumnElement, delete, select
from sqlalchemy.orm import Session

from walltopo_gym.climbing.counting import zone_of
from walltopo_gym.climbing.models import Ascent
from walltopo_gym.clock import now
from walltopo_gym.competitions.models import Competition, Entry
from walltopo_gym.database.engine import Database
from walltopo_gym.gyms.models import Gym, Membership
from walltopo_gym.gyms.roles import Role
from walltopo_gym.hall.models import Message, NotificationPreferences, PushAddress
from walltopo_gym.hall.new_routes import new_routes, today
from walltopo_gym.hall.words import Words, words_in
from walltopo_gym.hold_reports.models import HoldReport
from walltopo_gym.jobs.queue import Job, enqueue
from walltopo_gym.publishing.models import Route
from walltopo_gym.publishing.versions import gym_routes
from walltopo_gym.reset_plans.service import Part, ResetState, people_of, plans_of
from walltopo_gym.scans.models import Scan
from walltopo_gym.settings import Feature
from walltopo_gym.walls.models import Wall

_LOG = logging.getLogger("walltopo_gym.hall")
DIGEST: Final = "digest"
_WAITS: Final = (60, 600, 3600, 14400, 43200)
MAILS: Final = Job("mails", at_once=16, of_one_gym=8, waits=_WAITS)
PUSHES: Final = Job("pushes", waits=_WAITS)
_MAIL: Final = "mail"
# The week's mail goes on Monday from eight by the gym's clock; a worker that was away catches up.
_DIGEST_AT: Final = time(8)
_DIGEST_LATE: Final = timedelta(days=2)
_WEEK: Final = 7
_SOON: Final = timedelta(days=3)
# One message for the walls of an evening: it waits until nothing more was published for a while.
_SETTLED: Final = timedelta(minutes=10)
_LATE: Final = timedelta(hours=12)
_BEGINS: Final = timedelta(hours=24)
_KEPT: Final = timedelta(days=120)
_LINES: Final = 40


def note_all(database: Database, features: Collection[Feature]) -> int:
    """Store the messages that are due now; return how many are new."""
    members = select(Membership.gym_id).join(
        NotificationPreferences, NotificationPreferences.person_id == Membership.person_id
    )
    with database.reading() as session:
        gyms = session.scalars(select(Gym).where(Gym.id.in_(members))).all()
        rows = [
            row for gym in gyms if "hall" in gym.features(features)
            for row in _of_gym_alone(session, gym, gym.features(features))
        ]  # fmt: skip
        there = select(Message.person_id, Message.kind, Message.subject, Message.target)
        subjects = {row["subject"] for row in rows}
        known = {tuple(row) for row in session.execute(there.where(Message.subject.in_(subjects)))}
    wanted = {(r["person_id"], r["kind"], r["subject"], r["target"]): r for r in rows}
    new = [row for key, row in wanted.items() if key not in known]
    if new:
        with database.writing() as session:
            session.execute(delete(Message).where(Message.created_at < now() - _KEPT))
            for row in new:
                # Another worker may have been first.
                once = database.insert(Message).values(**row).on_conflict_do_nothing()
                is_first = session.scalar(once.returning(Message.id)) is not None
                if is_first and row["sent_at"] is None:
                    job = MAILS if row["kind"] == DIGEST else PUSHES
                    enqueue(session, job, str(row["id"]), gym=row["gym_id"])
    return len(new)


def _of_gym_alone(
    session: Session, gym: Gym, features: Collection[Feature]
) -> list[dict[str, Any]]:
    """Return a gym's messages; none on an error, so that other gyms do not wait."""
    try:
        with session.begin_nested():
            return list(_of_gym(session, gym, features))
    except Exception:
        _LOG.exception("gym %s: its messages cannot be made", gym.slug)
        return []


def _of_gym(session: Session, gym: Gym, features: Collection[Feature]) -> Iterator[dict[str, Any]]:
    rows = session.scalars(
        select(NotificationPreferences)
        .join(Membership, Membership.person_id == NotificationPreferences.person_id)
        .where(Membership.gym_id == gym.id)
    ).all()
    if not rows:
        return
    yield from _digests(session, gym, [preferences for preferences in rows if preferences.digest])
    browsers: dict[UUID, list[UUID]] = {}
    people = [preferences.person_id for preferences in rows]
    for address in session.scalars(select(PushAddress).where(PushAddress.person_id.in_(people))):
        browsers.setdefault(address.person_id, []).append(address.id)
    recipients = [preferences for preferences in rows if preferences.person_id in browsers]
    notices = (
        *_new_routes(session, gym, recipients), *_soon(session, gym, recipients),
        *_holds_reported(session, gym, recipients), *_holds_done(session, gym, recipients),
        *_routes_to_forerun(session, gym, recipients),
        *(_begins(session, gym, recipients) if "competitions" in features else ()),
    )  # fmt: skip
    for preferences, kind, subject, body in notices:
        for browser in browsers[preferences.person_id]:
            yield _row(gym, preferences.person_id, kind, subject, str(browser), body)


Notice = tuple[NotificationPreferences, str, str, dict[str, Any]]


def _digests(
    session: Session, gym: Gym, wanting: list[NotificationPreferences]
) -> Iterator[dict[str, Any]]:
    zone = zone_of(gym)
    local = now().astimezone(zone)
    monday = local.date() - timedelta(days=local.weekday())
    due = datetime.combine(monday, _DIGEST_AT, zone)
    if not wanting or not due <= local < due + _DIGEST_LATE:
        return
    new = new_routes(session, gym, _WEEK + 1)
    walls = {wall.id: wall for wall in session.scalars(select(Wall).filter_by(gym_id=gym.id))}
    for preferences in wanting:
        words = words_in(preferences.language)
        goes = _projects(session, gym, preferences.person_id, monday + timedelta(days=2 * _WEEK))
        body: dict[str, Any] = {}
        if new or goes:
            lines = _digest_lines(gym, words, new, goes, walls)
            body = {"subject": words.say("digest", gym=gym.name), "lines": lines}
        # A week without news is noted too, and nothing is sent.
        row = _row(gym, preferences.person_id, DIGEST, f"{gym.id} {monday}", _MAIL, body)
        yield row if body else row | {"sent_at": now()}


def _digest_lines(
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
    parts = (route.name or words.colour(route.colour), route.grade, route.setter)
    return ", ".join(filter(None, parts))


def _new_routes(
    session: Session, gym: Gym, wanting: list[NotificationPreferences]
) -> Iterator[Notice]:
    """Return messages about new routes, once the evening's last wall is published."""
    published = session.scalars(
        select(Scan.published_at)
        .join(Wall, Wall.id == Scan.wall_id)
        .where(Wall.gym_id == gym.id, Scan.published_at > now() - _LATE)
    ).all()
    moments = [at for at in published if at is not None]
    wanting = [preferences for preferences in wanting if preferences.new_routes]
    if not wanting or not moments or max(moments) > now() - _SETTLED:
        return
    # Set by these publications, not named in one that only corrects.
    new = [route for route, _ in gym_routes(session, gym.id)
           if route.created_at >= min(moments) - _SETTLED]  # fmt: skip
    if not new:
        return
    names = {wall.id: wall.name for wall in session.scalars(select(Wall).filter_by(gym_id=gym.id))}
    walls = ", ".join(dict.fromkeys(names[route.wall_id] for route in new))
    for preferences in wanting:
        words = words_in(preferences.language)
        title = f"{gym.name}: {words.say('push_new', number=len(new))}"
        subject = f"{gym.id} {today(gym)}"
        yield preferences, "new_routes", subject, _shown(title, walls, f"/g/{gym.slug}", subject)


def _soon(session: Session, gym: Gym, wanting: list[NotificationPreferences]) -> Iterator[Notice]:
    names = {wall.id: wall.name for wall in session.scalars(select(Wall).filter_by(gym_id=gym.id))}
    for preferences in wanting:
        if not preferences.soon:
            continue
        words = words_in(preferences.language)
        for route in _projects(session, gym, preferences.person_id, today(gym) + _SOON):
            text = words.say("push_soon_text", route=route.name or words.colour(route.colour),
                             wall=names[route.wall_id], day=words.day(_day(route)))  # fmt: skip
            path = f"/g/{gym.slug}/w/{route.wall_id}/r/{route.id}"
            body = _shown(words.say("push_soon"), text, path, str(route.id))
            yield preferences, "soon", f"{route.id} {route.strip_on}", body


def _begins(session: Session, gym: Gym, wanting: list[NotificationPreferences]) -> Iterator[Notice]:
    """Return messages about competitions that begin within hours."""
    entered = session.execute(
        select(Competition, Entry.person_id)
        .join(Entry, Entry.competition_id == Competition.id)
        .where(Competition.gym_id == gym.id, Competition.state != "draft")
        .where(Competition.starts_at > now(), Competition.starts_at < now() + _BEGINS)
        .where(Entry.withdrawn.is_(False), Entry.person_id.is_not(None))
    ).all()
    for preferences in wanting:
        words = words_in(preferences.language)
        for competition, person in entered:
            if not preferences.competitions or person != preferences.person_id:
                continue
            assert competition.starts_at is not None
            at = competition.starts_at.astimezone(zone_of(gym))
            text = f"{gym.name}, {words.day(at.date())}, {at:%H:%M %Z}"
            path = f"/g/{gym.slug}/competitions/{competition.id}"
            title = words.say("push_competition", name=competition.name)
            subject = f"{competition.id} {at.date()}"
            yield preferences, "begins", subject, _shown(title, text, path, str(competition.id))


def _routes_to_forerun(
    session: Session, gym: Gym, wanting: list[NotificationPreferences]
) -> Iterator[Notice]:
    """Return messages to the forerunners of open plans whose routes are set."""
    wanting = [preferences for preferences in wanting if preferences.forerun]
    plans = plans_of(session, gym) if wanting else []
    ready = [one for one in plans if one.state == ResetState.SET]
    named = {
        (row.plan_id, row.person_id)
        for row in people_of(session, [one.plan.id for one in ready])
        if row.part == Part.FORERUNNER
    }
    for one in ready:
        for preferences in wanting:
            if (one.plan.id, preferences.person_id) not in named:
                continue
            words = words_in(preferences.language)
            text = f"{gym.name}, {one.wall.name}, {words.day(one.plan.day)}"
            path = f"/g/{gym.slug}/desk/{one.plan.id}/forerun"
            body = _shown(words.say("push_forerun"), text, path, str(one.plan.id))
            yield preferences, "forerun", str(one.plan.id), body


def _holds_reported(
    session: Session, gym: Gym, wanting: list[NotificationPreferences]
) -> Iterator[Notice]:
    """Return messages to setters about new hold reports that are open."""
    wanting = [preferences for preferences in wanting if preferences.hold_reports]
    setters = set(session.scalars(select(Membership.person_id).where(
        Membership.gym_id == gym.id, Membership.role.in_((Role.SETTER, Role.OWNER))
    ))) if wanting else set()  # fmt: skip
    recent = HoldReport.done_at.is_(None), HoldReport.created_at > now() - _LATE
    for report, wall, route in _reports(session, gym, *recent) if setters else ():
        for preferences in wanting:
            if preferences.person_id not in setters or preferences.person_id == report.person_id:
                continue
            words = words_in(preferences.language)
            text = _hold_text(words, report, wall, route)
            path = f"/g/{gym.slug}/w/{wall.id}/holds"
            body = _shown(words.say("push_hold"), text, path, str(report.id))
            yield preferences, "hold_reported", str(report.id), body


def _holds_done(
    session: Session, gym: Gym, wanting: list[NotificationPreferences]
) -> Iterator[Notice]:
    """Return messages to climbers whose hold reports are done."""
    mine = {each.person_id: each for each in wanting if each.hold_reports}
    done = HoldReport.done_at > now() - _LATE, HoldReport.person_id.in_(list(mine))
    for report, wall, route in _reports(session, gym, *done) if mine else ():
        assert report.person_id is not None
        preferences = mine[report.person_id]
        words = words_in(preferences.language)
        text = _hold_text(words, report, wall, route)
        path = f"/g/{gym.slug}/w/{wall.id}"
        body = _shown(words.say("push_hold_done"), text, path, str(report.id))
        yield preferences, "hold_done", str(report.id), body


def _reports(
    session: Session, gym: Gym, *where: ColumnElement[bool]
) -> Sequence[tuple[HoldReport, Wall, Route | None]]:
    rows = (
        select(HoldReport, Wall, Route)
        .join(Wall, Wall.id == HoldReport.wall_id)
        .outerjoin(Route, Route.id == HoldReport.route_id)
        .where(Wall.gym_id == gym.id, *where)
    )
    return [(report, wall, route) for report, wall, route in session.execute(rows)]


def _hold_text(words: Words, report: HoldReport, wall: Wall, route: Route | None) -> str:
    name = words.colour(report.colour) if route is None else route.name
    what = words.say(f"hold_{report.kind}")
    parts = (what, name or words.colour(report.colour), wall.name, report.note)
    return ", ".join(filter(None, parts))


def _projects(session: Session, gym: Gym, person: UUID, until: date) -> list[Route]:
    """Return a person's unfinished projects that will be stripped by a day."""
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
        "subject": subject, "target": target, "body": body, "sent_at": None, "error": "",
    }  # fmt: skip
