"""Messages about events, stored in the transactions in which they happen."""

from __future__ import annotations

from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.events import (
    CompetitionBegins,
    HoldReportDone,
    HoldReported,
    HoldsChanged,
    InspectionDue,
    RoutesToForerun,
)
from walltopo_gym.gyms.days import zone_of
from walltopo_gym.gyms.models import Gym, Membership
from walltopo_gym.gyms.roles import Role
from walltopo_gym.notifications.messages import Notice, Shown, notify
from walltopo_gym.publishing.models import Route
from walltopo_gym.walls.models import Wall
from walltopo_gym.words import Words


def hold_reported(session: Session, event: HoldReported) -> None:
    """Tell the setters, but not the one who reported it."""
    gym, wall = session.get_one(Gym, event.gym), session.get_one(Wall, event.wall)

    def shown(words: Words) -> Shown:
        path = f"/g/{gym.slug}/w/{wall.id}/holds"
        return Shown(words.say("push_hold"), _hold_text(session, words, event), path)

    notice = Notice("hold_reported", str(event.report), str(event.report), "hold_reports", shown)
    notify(session, gym, notice, _setters_of(session, gym) - {event.person})


def holds_changed(session: Session, event: HoldsChanged) -> None:
    """Tell the setters."""
    gym, wall = session.get_one(Gym, event.gym), session.get_one(Wall, event.wall)

    def shown(words: Words) -> Shown:
        text = words.say("push_hold_changes_text", wall=wall.name, number=str(event.count))
        path = f"/g/{gym.slug}/w/{wall.id}/holds"
        return Shown(words.say("push_hold_changes"), text, path)

    notice = Notice("holds_changed", str(event.scan), str(event.wall), "hold_reports", shown)
    notify(session, gym, notice, _setters_of(session, gym))


def hold_report_done(session: Session, event: HoldReportDone) -> None:
    """Tell the climber who reported it."""
    if event.person is None:
        return
    gym = session.get_one(Gym, event.gym)

    def shown(words: Words) -> Shown:
        path = f"/g/{gym.slug}/w/{event.wall}"
        return Shown(words.say("push_hold_done"), _hold_text(session, words, event), path)

    notice = Notice("hold_done", str(event.report), str(event.report), "hold_reports", shown)
    notify(session, gym, notice, {event.person})


def routes_to_forerun(session: Session, event: RoutesToForerun) -> None:
    """Tell the forerunners."""
    gym, wall = session.get_one(Gym, event.gym), session.get_one(Wall, event.wall)

    def shown(words: Words) -> Shown:
        text = f"{gym.name}, {wall.name}, {words.day(event.day)}"
        return Shown(words.say("push_forerun"), text, f"/g/{gym.slug}/desk/{event.plan}/forerun")

    notice = Notice("forerun", str(event.plan), str(event.plan), "forerun", shown)
    notify(session, gym, notice, event.forerunners)


def competition_begins(session: Session, event: CompetitionBegins) -> None:
    """Tell those who entered."""
    gym = session.get_one(Gym, event.gym)
    at = event.at.astimezone(zone_of(gym))

    def shown(words: Words) -> Shown:
        title = words.say("push_competition", name=event.name)
        text = f"{gym.name}, {words.day(at.date())}, {at:%H:%M %Z}"
        return Shown(title, text, f"/g/{gym.slug}/competitions/{event.competition}")

    subject = f"{event.competition} {at.date()}"
    notice = Notice("begins", subject, str(event.competition), "competitions", shown)
    notify(session, gym, notice, event.entered)


def inspection_due(session: Session, event: InspectionDue) -> None:
    """Tell the setters, once for each day on which walls became due."""
    gym = session.get_one(Gym, event.gym)

    def shown(words: Words) -> Shown:
        level = words.say(f"inspection_{event.level}")
        title = words.say("push_inspection", level=level)
        return Shown(title, f"{gym.name}: {', '.join(event.walls)}", f"/g/{gym.slug}/inspections")

    subject = f"{gym.id} {event.level} {event.on}"
    tag = f"{gym.id} {event.level}"
    notice = Notice("inspection", subject, tag, "inspections", shown)
    notify(session, gym, notice, _setters_of(session, gym))


def _setters_of(session: Session, gym: Gym) -> set[UUID]:
    setters = select(Membership.person_id).where(
        Membership.gym_id == gym.id, Membership.role.in_((Role.SETTER, Role.OWNER))
    )
    return set(session.scalars(setters))


def _hold_text(session: Session, words: Words, event: HoldReported) -> str:
    wall = session.get_one(Wall, event.wall)
    route = None if event.route is None else session.get(Route, event.route)
    name = "" if route is None else route.name
    what = words.say(f"hold_{event.kind}")
    parts = (what, name or words.colour(event.colour), wall.name, event.note)
    return ", ".join(filter(None, parts))
