"""Publications for later: at a time, or when every wall of a zone has one.

A plan keeps what the setter confirmed. When it is due it is carried out as if they pressed the
button then; where that cannot be any more, the plan stays and says why.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from datetime import date
from typing import Any, Final
from uuid import UUID
from zoneinfo import ZoneInfo

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo.core import WalltopoError
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.clock import now
from walltopo_gym.database.engine import Database
from walltopo_gym.errors import ConflictError
from walltopo_gym.gyms.models import Gym, Wall
from walltopo_gym.publishing.change import Entry, Placed, publish
from walltopo_gym.publishing.models import Plan
from walltopo_gym.scans.models import Scan

__all__ = ["publish_due", "rows_of"]

_LOG = logging.getLogger("walltopo_gym.publishing")
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
    with database.reading() as session:
        groups = [[plan.scan_id for plan in group] for group in _due(session)]
    done = 0
    for scans in groups:
        try:
            with database.writing() as session:
                for scan in scans:
                    _carry_out(session, scan)
            done += len(scans)
        except WalltopoError as why:
            _LOG.warning("planned publication of %s: %s", scans, why)
            _note(database, scans, why)
    return done


def _due(session: Session) -> list[list[Plan]]:
    waiting = session.execute(
        select(Plan, Wall.gym_id, Wall.zone)
        .join(Scan, Scan.id == Plan.scan_id)
        .join(Wall, Wall.id == Scan.wall_id)
        .where(Plan.error == "")
        .order_by(Plan.created_at)
    ).all()
    groups = [[plan] for plan, _, _ in waiting if plan.at is not None and plan.at <= now()]
    zones: dict[tuple[UUID, str], list[Plan]] = {}
    for plan, gym, zone in waiting:
        if plan.at is None:
            zones.setdefault((gym, zone), []).append(plan)
    for (gym, zone), plans in zones.items():
        walls = set(session.scalars(select(Wall.id).where(Wall.gym_id == gym, Wall.zone == zone)))
        planned = select(Scan.wall_id).where(Scan.id.in_([plan.scan_id for plan in plans]))
        if walls == set(session.scalars(planned)):
            groups.append(plans)
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


def _note(database: Database, scans: Sequence[UUID], why: WalltopoError) -> None:
    with database.writing() as session:
        for scan in scans:
            plan = session.get(Plan, scan)
            if plan is not None:
                plan.error = str(why)[:500]
