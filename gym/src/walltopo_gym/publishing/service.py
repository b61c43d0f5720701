"""Publication in one transaction.

The wall's `revision` is the state that a setter decided on. The second of two setters is refused;
the update of the row decides which one that is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from datetime import date
from typing import Any
from uuid import UUID

from sqlalchemy import select, update
from sqlalchemy.orm import Session

from walltopo.scans.routes import Route as FoundRoute
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.clock import now
from walltopo_gym.errors import ConflictError, RequestError
from walltopo_gym.events import RouteRestored, RouteStripped, WallPublished, publish_event
from walltopo_gym.gyms.grade_labels import own_label
from walltopo_gym.gyms.models import GradeSystem
from walltopo_gym.publishing.lines import check_line
from walltopo_gym.publishing.models import Placement, Route
from walltopo_gym.publishing.versions import store_route_facts, unplaced_routes
from walltopo_gym.scans.models import Scan
from walltopo_gym.scans.queues import queue_moves
from walltopo_gym.scans.service import State, change_state, check_in_review
from walltopo_gym.walls.models import Wall


@dataclass(frozen=True)
class Entry:
    """A setter's decision about a route of the new scan.

    Parameters
    ----------
    number : in the scan.
    route : the existing route; None for a new one.
    facts : columns of `Route`; for an existing route only the changes.
    """

    number: int
    route: UUID | None
    facts: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True)
class Placed:
    """A route as the scan measured it: columns of `Placement`."""

    holds: list[int]
    steepness_deg: float | None = None
    hold_types: dict[str, int] = field(default_factory=dict)

    @classmethod
    def of(cls, route: FoundRoute) -> Placed:
        """Return it from a row of `routes.json`."""
        return cls(list(route.holds), route.steepness_deg, dict(route.holds_by_type))

    @property
    def row(self) -> dict[str, Any]:
        """Return it as JSON values; `Placed(**row)` is the inverse."""
        return asdict(self)


def publish(
    session: Session,
    scan: Scan,
    expected: int,
    entries: Sequence[Entry],
    found: Mapping[int, Placed],
    today: date,
) -> None:
    """Publish a scan in review.

    Current routes that no entry names are stripped, except those that were added by hand and were
    not in the former version. Numbers that no entry names are holds without a route.

    Parameters
    ----------
    expected : the wall's revision that the entries were made for.
    found : the scan's routes by number; today : in the gym's time zone.

    Raises
    ------
    ConflictError : the wall was changed meanwhile, the scan is not in review, or it amends a
        version that is no longer published.
    RequestError : an entry names a missing number or route, or one twice.
    """
    check_in_review(scan.state)
    _check_amended(session, scan)
    staying = {route.id for route in unplaced_routes(session, session.get_one(Wall, scan.wall_id))}
    _take_wall(session, scan, expected)
    current = check_entries(session, scan, entries, found)
    for entry in entries:
        route = current.get(entry.route) if entry.route is not None else None
        if route is None:
            route = Route(wall_id=scan.wall_id, set_on=today)
            session.add(route)
        check_line(session, scan.wall_id, entry.facts)
        for name, value in entry.facts.items():
            setattr(route, name, value)
        session.flush()
        placed = found[entry.number].row
        session.add(Placement(scan_id=scan.id, number=entry.number, route_id=route.id, **placed))
    staying |= {entry.route for entry in entries if entry.route is not None}
    for route in current.values():
        if route.id not in staying:
            route.stripped_at = now()
    _announce_version(session, scan)


def check_entries(
    session: Session, scan: Scan, entries: Sequence[Entry], found: Mapping[int, Placed]
) -> dict[UUID, Route]:
    """Return the current routes of the scan's wall, by id.

    Raises
    ------
    RequestError : an entry names a missing number or route, or one twice.
    """
    current = {route.id: route for route in _current_routes(session, scan.wall_id)}
    numbers = [entry.number for entry in entries]
    named = [entry.route for entry in entries if entry.route is not None]
    unknown = [number for number in numbers if number not in found]
    if unknown:
        raise RequestError("scan-no-route", number=unknown[0])
    if len(set(numbers)) < len(numbers) or len(set(named)) < len(named):
        raise RequestError("route-twice")
    if any(route not in current for route in named):
        raise RequestError("entry-not-current")
    return current


def roll_back(session: Session, scan: Scan, expected: int) -> None:
    """Roll back to a former version with its routes.

    Raises
    ------
    ConflictError : the wall was changed meanwhile, or the scan was never published.
    """
    if scan.state != State.SUPERSEDED:
        raise ConflictError("not-former-version", state=scan.state)
    _take_wall(session, scan, expected)
    placed = select(Placement.route_id).where(Placement.scan_id == scan.id)
    stripped = update(Route).where(Route.wall_id == scan.wall_id, Route.stripped_at.is_(None))
    # Routes that were added by hand do not depend on the version that is rolled back.
    gone = stripped.where(Route.id.not_in(placed), Route.by_hand.is_(False))
    session.execute(gone.values(stripped_at=now()))
    session.execute(update(Route).where(Route.id.in_(placed)).values(stripped_at=None))
    _announce_version(session, scan)


def strip_without_scan(session: Session, route: Route) -> None:
    """Strip a route without a new scan; its ascents stay.

    Raises
    ------
    ConflictError : it is stripped already.
    """
    gone = update(Route).where(Route.id == route.id, Route.stripped_at.is_(None))
    if session.execute(gone.values(stripped_at=now()).returning(Route.id)).one_or_none() is None:
        raise ConflictError("route-gone")
    gym = session.get_one(Wall, route.wall_id).gym_id
    publish_event(session, RouteStripped(gym, route.wall_id, route.id))


def undo_stripping(session: Session, route: Route) -> None:
    """Undo the stripping of a route that is in the published version, or that no scan ever placed.

    Raises
    ------
    ConflictError : the route is current, or only a former version shows it.
    """
    placed = select(Placement.scan_id).where(Placement.route_id == route.id)
    scans = set(session.scalars(placed))
    if scans and session.get_one(Wall, route.wall_id).published_scan_id not in scans:
        raise ConflictError("route-in-former-version", "restore-the-version")
    back = update(Route).where(Route.id == route.id, Route.stripped_at.is_not(None))
    if session.execute(back.values(stripped_at=None).returning(Route.id)).one_or_none() is None:
        raise ConflictError("route-current")
    gym = session.get_one(Wall, route.wall_id).gym_id
    publish_event(session, RouteRestored(gym, route.wall_id, route.id))


def change_facts(
    session: Session, gym: UUID, route: Route, facts: Mapping[str, object], by: UUID
) -> None:
    """Change facts of a route (columns of `Route`), and log it.

    Raises
    ------
    RequestError : as in `grade_of` and `check_line`.
    """
    check_line(session, route.wall_id, facts)
    for name, value in facts.items():
        setattr(route, name, value)
    session.flush()
    session.expire(route, ["line"])
    route.grade = grade_of(session, gym, route.grade_system_id, route.grade)
    touch_wall(session, route.wall_id)
    log_change(session, "route.change", person=by, gym=gym, subject=str(route.id))


def touch_wall(session: Session, wall: UUID) -> None:
    """Note a change of a wall's routes: its tag changes, and older drafts are refused."""
    session.get_one(Wall, wall, with_for_update=True).revision += 1


def grade_of(session: Session, gym: UUID, system: UUID | None, grade: str) -> str:
    """Return the gym's label of a grade as somebody wrote it: "6a" is 6A.

    Raises
    ------
    RequestError : no such system, or no such grade in it.
    """
    if system is None:
        if grade:
            raise RequestError("grade-needs-system")
        return ""
    row = session.get(GradeSystem, system)
    if row is None or row.gym_id != gym:
        raise RequestError("not-there-grades")
    label = own_label(row.kind, row.labels, grade) if grade else ""
    if label is None:
        known = ", ".join(row.labels)
        raise RequestError(
            "grade-unknown", "grade-known", system=row.name, grade=grade, grades=known
        )
    return label


def _check_amended(session: Session, scan: Scan) -> None:
    """Refuse an amendment of a former version: it would roll the wall back unnoticed."""
    current = session.get_one(Wall, scan.wall_id).published_scan_id
    if scan.amends_id is not None and scan.amends_id != current:
        raise ConflictError("amendment-outdated", "amendment-again")


def _take_wall(session: Session, scan: Scan, expected: int) -> None:
    """Make the scan the published one if nobody changed the wall since `expected`."""
    before = session.scalar(select(Wall.published_scan_id).where(Wall.id == scan.wall_id))
    taken = (
        update(Wall)
        .where(Wall.id == scan.wall_id, Wall.revision == expected)
        .values(published_scan_id=scan.id, revision=expected + 1)
        .returning(Wall.id)
    )
    if session.execute(taken).one_or_none() is None:
        raise ConflictError("wall-changed", "look-at-it-again")
    if before is not None:
        store_route_facts(session, before)
        change_state(session, before, State.SUPERSEDED)
    change_state(session, scan.id, State.PUBLISHED)
    session.execute(update(Scan).where(Scan.id == scan.id).values(published_at=now()))


def _announce_version(session: Session, scan: Scan) -> None:
    gym = session.get_one(Wall, scan.wall_id).gym_id
    publish_event(session, WallPublished(gym, scan.wall_id, scan.id))
    queue_moves(session, scan.id)


def _current_routes(session: Session, wall: UUID) -> Sequence[Route]:
    return session.scalars(
        select(Route).where(Route.wall_id == wall, Route.stripped_at.is_(None))
    ).all()
