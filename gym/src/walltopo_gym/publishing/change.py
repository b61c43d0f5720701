"""The change over: one transaction, in which everything of a publication happens, or nothing.

The wall's `revision` is what a setter saw when they decided. Who comes second, with what is no
longer so, is told; the row's own update decides who that is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from datetime import date
from typing import Any
from uuid import UUID

from sqlalchemy import select, update
from sqlalchemy.orm import Session

from walltopo.core import InputError
from walltopo.scans.routes import Route as FoundRoute
from walltopo_gym.clock import now
from walltopo_gym.errors import ConflictError
from walltopo_gym.gyms.models import GradeSystem, Wall
from walltopo_gym.publishing.models import Placement, Route
from walltopo_gym.publishing.past import keep_as_was
from walltopo_gym.scans.models import Scan
from walltopo_gym.scans.states import State, check_in_review, move
from walltopo_gym.webhooks.events import note


@dataclass(frozen=True)
class Entry:
    """What a setter says of a route of the new scan.

    Parameters
    ----------
    number : in the scan.
    route : the route that it is; None for a new one.
    facts : columns of `Route`; for one that hangs already what shall be otherwise.
    """

    number: int
    route: UUID | None
    facts: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True)
class Placed:
    """What the scan knows of a route: columns of `Placement`."""

    holds: list[int]
    steepness_deg: float | None = None
    hold_types: dict[str, int] = field(default_factory=dict)

    @classmethod
    def of(cls, route: FoundRoute) -> Placed:
        """Of a row of `routes.json`."""
        return cls(list(route.holds), route.steepness_deg, dict(route.holds_by_type))

    @property
    def row(self) -> dict[str, Any]:
        """As JSON keeps it; `Placed(**row)` is it again."""
        return asdict(self)


def publish(
    session: Session, scan: Scan, expected: int, entries: Sequence[Entry],
    found: Mapping[int, Placed], today: date,
) -> None:  # fmt: skip
    """Let a scan in review be the wall.

    Routes that hang and that no entry names are stripped. Numbers that no entry names are holds of
    no route.

    Parameters
    ----------
    expected : the wall's revision that the entries were made for.
    found : the scan's routes by number; today : in the gym's time zone.

    Raises
    ------
    ConflictError : the wall was changed meanwhile, or the scan is not in review.
    InputError : an entry names a number or a route that is not there, or one twice.
    """
    check_in_review(scan.state)
    _take_wall(session, scan, expected)
    hanging = {route.id: route for route in _hanging(session, scan.wall_id)}
    _check(entries, hanging, found)
    for entry in entries:
        route = hanging.get(entry.route) if entry.route is not None else None
        if route is None:
            route = Route(wall_id=scan.wall_id, set_on=today)
            session.add(route)
        for name, value in entry.facts.items():
            setattr(route, name, value)
        session.flush()
        placed = found[entry.number].row
        session.add(Placement(scan_id=scan.id, number=entry.number, route_id=route.id, **placed))
    staying = {entry.route for entry in entries}
    for route in hanging.values():
        if route.id not in staying:
            route.stripped_at = now()
    _tell(session, scan)


def put_back(session: Session, scan: Scan, expected: int) -> None:
    """Let a former version be the wall again, with the routes that it had.

    Raises
    ------
    ConflictError : the wall was changed meanwhile, or the scan was never published.
    """
    if scan.state != State.SUPERSEDED:
        raise ConflictError(f"the scan is {scan.state}, no former version")
    _take_wall(session, scan, expected)
    placed = select(Placement.route_id).where(Placement.scan_id == scan.id)
    stripped = update(Route).where(Route.wall_id == scan.wall_id, Route.stripped_at.is_(None))
    session.execute(stripped.where(Route.id.not_in(placed)).values(stripped_at=now()))
    session.execute(update(Route).where(Route.id.in_(placed)).values(stripped_at=None))
    _tell(session, scan)


def strip(session: Session, route: Route) -> None:
    """Take a route off the wall, without a new scan; what was climbed on it stays.

    Raises
    ------
    ConflictError : it hangs no more.
    """
    gone = update(Route).where(Route.id == route.id, Route.stripped_at.is_(None))
    if session.execute(gone.values(stripped_at=now()).returning(Route.id)).one_or_none() is None:
        raise ConflictError("this route hangs no more")
    gym = session.get_one(Wall, route.wall_id).gym_id
    note(session, gym, "route.stripped", wall=str(route.wall_id), route=str(route.id))


def check_grade(session: Session, gym: UUID, system: UUID | None, grade: str) -> None:
    """Refuse a grade that the gym does not have.

    Raises
    ------
    InputError : no such system, or no such grade in it.
    """
    if system is None:
        if grade:
            raise InputError("a grade needs its grade system")
        return
    row = session.get(GradeSystem, system)
    if row is None or row.gym_id != gym:
        raise InputError("no such grade system")
    labels = [known["label"] for known in row.grades]
    if grade and grade not in labels:
        raise InputError(f"{row.name} has no grade {grade!r}", f"It has {', '.join(labels)}.")


def _take_wall(session: Session, scan: Scan, expected: int) -> None:
    """Make the scan the wall's published one, if nobody changed the wall since `expected`."""
    before = session.scalar(select(Wall.published_scan_id).where(Wall.id == scan.wall_id))
    taken = (
        update(Wall)
        .where(Wall.id == scan.wall_id, Wall.revision == expected)
        .values(published_scan_id=scan.id, revision=expected + 1)
        .returning(Wall.id)
    )
    if session.execute(taken).one_or_none() is None:
        raise ConflictError("the wall was changed meanwhile", "Look at it again.")
    if before is not None:
        keep_as_was(session, before)
        move(session, before, State.SUPERSEDED)
    move(session, scan.id, State.PUBLISHED)
    session.execute(update(Scan).where(Scan.id == scan.id).values(published_at=now()))


def _tell(session: Session, scan: Scan) -> None:
    gym = session.get_one(Wall, scan.wall_id).gym_id
    note(session, gym, "wall.published", wall=str(scan.wall_id), scan=str(scan.id))


def _hanging(session: Session, wall: UUID) -> Sequence[Route]:
    return session.scalars(
        select(Route).where(Route.wall_id == wall, Route.stripped_at.is_(None))
    ).all()


def _check(
    entries: Sequence[Entry], hanging: Mapping[UUID, Route], found: Mapping[int, Placed]
) -> None:
    numbers = [entry.number for entry in entries]
    named = [entry.route for entry in entries if entry.route is not None]
    unknown = [number for number in numbers if number not in found]
    if unknown:
        raise InputError(f"the scan has no route {unknown[0]}")
    if len(set(numbers)) < len(numbers) or len(set(named)) < len(named):
        raise InputError("a route is named twice")
    if any(route not in hanging for route in named):
        raise InputError("an entry names a route that does not hang on this wall")
