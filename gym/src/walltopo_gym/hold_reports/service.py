"""Store hold reports, and list the holds to check.

A report follows its hold through amendments, which keep the ids of holds. A new scan numbers its
holds anew: the report keeps its version then, and stays open until its route is stripped.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from enum import StrEnum
from typing import Final
from uuid import UUID

from sqlalchemy import Select, select
from sqlalchemy.orm import Session

from walltopo.scans.holds import Hold
from walltopo_gym.accounts.limits import count_hold_report
from walltopo_gym.accounts.people import lock_person
from walltopo_gym.clock import now
from walltopo_gym.errors import ConflictError, NotFoundError, RequestError
from walltopo_gym.events import HoldReportDone, HoldReported, publish_event
from walltopo_gym.hold_reports.models import HoldReport
from walltopo_gym.publishing.models import Placement, Route
from walltopo_gym.publishing.version_holds import check_version, origins, same_mesh
from walltopo_gym.walls.models import Wall

_DONE_SHOWN: Final = timedelta(days=30)


class Kind(StrEnum):
    """Faults of a hold."""

    SPINS = "spins"
    BROKEN = "broken"
    SHARP = "sharp"
    DIRTY = "dirty"


@dataclass(frozen=True)
class Fault:
    """A climber's words about a hold, or about a hold of a route (`hold` is None).

    Parameters
    ----------
    scan : the version of the wall in which `hold` is the hold's id.
    """

    scan: UUID
    hold: int | None
    route: UUID | None
    kind: Kind
    note: str


@dataclass(frozen=True)
class OpenReport:
    """A report with its wall and route.

    Parameters
    ----------
    origin : the version whose hold ids it uses, which its amendments keep.
    is_current : the published version uses these hold ids, too.
    """

    report: HoldReport
    route: Route | None
    wall: Wall
    origin: UUID
    is_current: bool

    @property
    def current_hold(self) -> int | None:
        """Return the hold's id in the published version; None if it is not known there."""
        return self.report.hold if self.is_current else None

    @property
    def of(self) -> tuple[UUID, UUID | None, UUID | None, int | None]:
        """Return what all reports of the same hold have in common."""
        if self.report.hold is None:
            return self.wall.id, None, self.report.route_id, None
        return self.wall.id, self.origin, None, self.report.hold


def store_report(
    session: Session,
    report: UUID,
    person: UUID,
    wall: Wall,
    fault: Fault,
    holds: Mapping[int, Hold],
) -> tuple[HoldReport, bool]:
    """Store a report; return it and whether it is new.

    A second open report of the same person, hold and kind is answered with the first.

    Parameters
    ----------
    holds : of the version that the report names.

    Raises
    ------
    RequestError : the version has no such hold or route; ConflictError : the id belongs to another
        person or wall; TooManyError : the person's limit of a day is reached.
    """
    # One person's reports come one after the other, so that two copies at once are one.
    lock_person(session, person)
    known = session.get(HoldReport, report)
    if known is not None:
        if known.person_id != person or known.wall_id != wall.id:
            raise ConflictError("id-taken", "id-another")
        return known, False
    check_version(session, wall, fault.scan)
    route, colour = _route_and_colour(session, fault, holds)
    row = HoldReport(
        id=report,
        wall_id=wall.id,
        scan_id=fault.scan,
        hold=fault.hold,
        person_id=person,
        route_id=None if route is None else route.id,
        colour=colour,
        kind=fault.kind,
        note=fault.note,
    )
    first = _same_of(session, row)
    if first is not None:
        return first, False
    count_hold_report(session, person)
    session.add(row)
    session.flush()
    publish_event(session, _report_event(HoldReported, wall.gym_id, row))
    return row, True


def _route_and_colour(
    session: Session, fault: Fault, holds: Mapping[int, Hold]
) -> tuple[Route | None, str]:
    placed = session.execute(
        select(Placement, Route)
        .join(Route, Route.id == Placement.route_id)
        .where(Placement.scan_id == fault.scan)
    ).all()
    if fault.hold is None:
        for _, route in placed:
            if route.id == fault.route:
                return route, route.colour
        raise RequestError("hold-or-route")
    hold = holds.get(fault.hold)
    if hold is None:
        raise RequestError("hold-unknown")
    colour = hold.colour[:40]
    on = [route for placement, route in placed if fault.hold in placement.holds]
    return (on[0], colour or on[0].colour) if on else (None, colour)


def _same_of(session: Session, row: HoldReport) -> HoldReport | None:
    """Return the person's open report of the same hold and kind."""
    mine = select(HoldReport).where(
        HoldReport.person_id == row.person_id,
        HoldReport.wall_id == row.wall_id,
        HoldReport.kind == row.kind,
        HoldReport.done_at.is_(None),
    )
    same = (
        HoldReport.route_id == row.route_id
        if row.hold is None
        else HoldReport.scan_id.in_(same_mesh(session, row.wall_id, row.scan_id))
    )
    hold = HoldReport.hold.is_(None) if row.hold is None else HoldReport.hold == row.hold
    return session.scalar(mine.where(same, hold).order_by(HoldReport.created_at).limit(1))


def reports_of(
    session: Session, gym: UUID, wall: UUID | None = None, *, done: bool = False
) -> list[OpenReport]:
    """Return the reports on holds that are on the walls, the earliest first.

    Parameters
    ----------
    wall : of this wall alone; done : those of the last 30 days that are done, instead of open ones.
    """
    rows: Select[HoldReport, Route | None, Wall] = (
        select(HoldReport, Route, Wall)
        .join(Wall, Wall.id == HoldReport.wall_id)
        .outerjoin(Route, Route.id == HoldReport.route_id)
        .where(Wall.gym_id == gym)
    )
    if done:
        rows = rows.where(HoldReport.done_at > now() - _DONE_SHOWN)
    else:
        rows = rows.where(HoldReport.done_at.is_(None))
    if wall is not None:
        rows = rows.where(Wall.id == wall)
    found = session.execute(rows.order_by(HoldReport.created_at, HoldReport.id)).all()
    known_of = {wall.id: origins(session, wall.id) for wall in {wall for _, _, wall in found}}
    known = [_open_report(*row, known_of[row[2].id]) for row in found]
    return [one for one in known if _is_there(one)]


def _open_report(
    report: HoldReport, route: Route | None, wall: Wall, origin_of: Mapping[UUID, UUID]
) -> OpenReport:
    origin = origin_of[report.scan_id]
    current = wall.published_scan_id
    is_current = current is not None and origin_of[current] == origin
    return OpenReport(report, route, wall, origin, is_current)


def _is_there(one: OpenReport) -> bool:
    """Return whether the hold is still on the wall, as far as that is known."""
    return one.is_current if one.route is None else one.route.stripped_at is None


def mark_done(session: Session, gym: UUID, report: HoldReport, *, done: bool) -> None:
    """Close the open reports of a report's hold, or open those again that were closed with it."""
    at = report.done_at
    if done == (at is not None):
        return
    of = HoldReport.wall_id == report.wall_id, HoldReport.hold == report.hold
    if report.hold is None:
        of = HoldReport.route_id == report.route_id, HoldReport.hold.is_(None)
    rows: Sequence[HoldReport] = session.scalars(
        select(HoldReport).where(
            *of, HoldReport.done_at.is_(None) if done else HoldReport.done_at == at
        )
    ).all()
    same = same_mesh(session, report.wall_id, report.scan_id)
    closed: datetime | None = now() if done else None
    for row in rows:
        if row.hold is None or row.scan_id in same:
            row.done_at = closed
            if done:
                publish_event(session, _report_event(HoldReportDone, gym, row))


def close_reports_before(
    session: Session, gym: UUID, wall: UUID, place: tuple[UUID, int], at: datetime
) -> list[HoldReport]:
    """Close the open reports of a hold that were made until a moment; return them.

    Parameters
    ----------
    place : a version of the wall, and the hold's id in it.
    """
    scan, hold = place
    rows = session.scalars(
        select(HoldReport)
        .where(HoldReport.wall_id == wall, HoldReport.hold == hold)
        .where(HoldReport.scan_id.in_(same_mesh(session, wall, scan)))
        .where(HoldReport.done_at.is_(None), HoldReport.created_at <= at)
        .order_by(HoldReport.created_at, HoldReport.id)
        .with_for_update()  # two marks at once close a report once
    ).all()
    closed = now()
    for row in rows:
        row.done_at = closed
        publish_event(session, _report_event(HoldReportDone, gym, row))
    return list(rows)


def _report_event(kind: type[HoldReported], gym: UUID, row: HoldReport) -> HoldReported:
    """Return the event of a report."""
    return kind(
        gym, row.wall_id, row.id, row.person_id, row.route_id, row.kind, row.colour, row.note
    )


def report_of(session: Session, gym: UUID, report: UUID) -> HoldReport:
    """Return a report of this gym, locked for a change.

    Raises
    ------
    NotFoundError : this gym has no such report.
    """
    mine = select(HoldReport).join(Wall, Wall.id == HoldReport.wall_id)
    row = session.scalar(mine.where(HoldReport.id == report, Wall.gym_id == gym))
    if row is None:
        raise NotFoundError("not-there-report")
    # The lock lets the second of two setters see the decision of the first.
    session.execute(select(Wall.id).where(Wall.id == row.wall_id).with_for_update())
    session.refresh(row)
    return row
