"""Publications for later: at a time, or when every wall of a zone has one.

A plan keeps what the setter confirmed. When it is due it is carried out as if they pressed the
button then; where that cannot be any more, the plan stays and says why.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from datetime import date, timedelta
from typing import Any, Final
from uuid import UUID
from zoneinfo import ZoneInfo

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo.core import WalltopoError
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.attempts.bounded import Attempts
from walltopo_gym.attempts.models import JobAttempt
from walltopo_gym.clock import now
from walltopo_gym.database.engine import Database
from walltopo_gym.errors import ConflictError
from walltopo_gym.gyms.models import Gym, Wall
from walltopo_gym.publishing.change import Entry, Placed, publish
from walltopo_gym.publishing.models import Plan
from walltopo_gym.scans.models import Scan

_LOG = logging.getLogger("walltopo_gym.publishing")
_HOLDER: Final = "publication"
_LEASE: Final = timedelta(minutes=1)  # a publication takes seconds
_DATES: Final = {"set_on", "strip_on"}


def rows_of(entries: Sequence[Entry]) -> list[dict[str, Any]]:
    """Entries as JSON keeps them."""
    return [
        {
            "number": entry.number,
            "route": None if entry.route is None else str(entry.route),
            "facts": {name: _plain(value) for name, value in entry.facts.items()},
        }
        for entry in entries
    ]


def _plain(value: object) -> object:
    return str(value) if isinstance(value, UUID | date) else value


def _facts(told: Mapping[str, Any]) -> dict[str, object]:
    """As they were before they were JSON."""
    read: dict[str, object] = dict(told)
    for name in _DATES & told.keys():
        read[name] = date.fromisoformat(told[name]) if told[name] else None
    if told.get("grade_system_id"):
        read["grade_system_id"] = UUID(told["grade_system_id"])
    return read


def publish_due(database: Database) -> int:
    """Carry out what is due; how many. Each zone, and each wall by itself, in one transaction."""
    attempts = Attempts(database, "publication", _set_aside, _LEASE)
    with database.reading() as session:
        groups = _due(session, attempts)
    done = 0
    for scans in groups:
        with database.writing() as session:
            numbers = [attempts.begin(session, scan, _HOLDER) for scan in scans]
        if not all(numbers):
            continue  # another worker is at it, or one of them was set aside
        try:
            with database.writing() as session:
                for scan in scans:
                    _carry_out(session, scan)
                    attempts.end(session, scan)
            done += len(scans)
        except WalltopoError as why:  # the gym has to decide: nothing is tried again
            _LOG.warning("planned publication of %s: %s", scans, why)
            _note(database, attempts, scans, why)
        except Exception as error:
            for scan in scans:
                attempts.fail(scan, error)
    return done


def _set_aside(session: Session, scan: UUID, why: str) -> None:
    plan = session.get(Plan, scan)
    if plan is not None:
        plan.error = f"the scan could not be published ({why})"[:500]


def _due(session: Session, attempts: Attempts) -> list[list[UUID]]:
    """Return the scans that are published together, by group."""
    waiting = session.execute(
        select(Plan.scan_id, Plan.at, Scan.wall_id, Wall.gym_id, Wall.zone)
        .join(Scan, Scan.id == Plan.scan_id)
        .join(Wall, Wall.id == Scan.wall_id)
        .outerjoin(JobAttempt, attempts.row_of(Plan.scan_id))
        .where(Plan.error == "", attempts.is_due())
        .order_by(Plan.created_at)
    ).all()
    groups = [[row.scan_id] for row in waiting if row.at is not None and row.at <= now()]
    zones: dict[tuple[UUID, str], dict[UUID, UUID]] = {}
    for row in waiting:
        if row.at is None:
            zones.setdefault((row.gym_id, row.zone), {})[row.scan_id] = row.wall_id
    for (gym, zone), planned in zones.items():
        walls = set(session.scalars(select(Wall.id).where(Wall.gym_id == gym, Wall.zone == zone)))
        if walls == set(planned.values()):
            groups.append(list(planned))
    return groups


def _carry_out(session: Session, scan: UUID) -> None:
    plan = session.get(Plan, scan, with_for_update=True)
    if plan is None:
        return  # another worker did it
    row = session.get_one(Scan, scan)
    wall = session.get_one(Wall, row.wall_id)
    if wall.published_scan_id != plan.over_id:
        raise ConflictError("another version was published meanwhile", "Look at it again.")
    zone = ZoneInfo(session.get_one(Gym, wall.gym_id).time_zone)
    entries = [_entry(told) for told in plan.entries]
    found = {int(number): Placed(**row) for number, row in plan.found.items()}
    publish(session, row, wall.revision, entries, found, now().astimezone(zone).date())
    log_change(session, "scan.publish", person=plan.made_by, gym=wall.gym_id, subject=str(scan),
               planned=True)  # fmt: skip
    session.delete(plan)


def _entry(told: Mapping[str, Any]) -> Entry:
    route = told["route"]
    return Entry(told["number"], None if route is None else UUID(route), _facts(told["facts"]))


def _note(
    database: Database, attempts: Attempts, scans: Sequence[UUID], why: WalltopoError
) -> None:  # fmt: skip
    with database.writing() as session:
        for scan in scans:
            attempts.end(session, scan)
            plan = session.get(Plan, scan)
            if plan is not None:
                plan.error = str(why)[:500]
