"""Planned publications: at a time, or when every wall of a zone has one.

A plan keeps the confirmed table. When it is due, it is published as by the button; if that is
impossible by then, the plan stays with the reason.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from datetime import date
from typing import Any, Final
from uuid import UUID
from zoneinfo import ZoneInfo

from sqlalchemy import select, update
from sqlalchemy.orm import Session

from walltopo.core import WalltopoError
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.clock import now
from walltopo_gym.database.engine import Database
from walltopo_gym.errors import ConflictError
from walltopo_gym.gyms.models import Gym
from walltopo_gym.jobs.queue import Failure
from walltopo_gym.publishing.models import Plan
from walltopo_gym.publishing.service import Entry, Placed, publish
from walltopo_gym.scans.models import Scan
from walltopo_gym.walls.models import Wall

_LOG = logging.getLogger("walltopo_gym.publishing")
_DATES: Final = {"set_on", "strip_on"}


def rows_of(entries: Sequence[Entry]) -> list[dict[str, Any]]:
    """Return entries as JSON values."""
    return [
        {
            "number": entry.number,
            "route": None if entry.route is None else str(entry.route),
            "facts": {name: _json_value(value) for name, value in entry.facts.items()},
        }
        for entry in entries
    ]


def _json_value(value: object) -> object:
    return str(value) if isinstance(value, UUID | date) else value


def _facts_of_json(kept: Mapping[str, Any]) -> dict[str, object]:
    """Return facts from their JSON values."""
    read: dict[str, object] = dict(kept)
    for name in _DATES & kept.keys():
        read[name] = date.fromisoformat(kept[name]) if kept[name] else None
    for name in ("grade_system_id", "line_id"):
        if kept.get(name):
            read[name] = UUID(kept[name])
    return read


def check_unplanned(session: Session, scan: UUID) -> None:
    """Refuse to change a planned scan, because a plan names routes and holds as confirmed.

    Raises
    ------
    ConflictError : a publication of the scan is planned.
    """
    if session.get(Plan, scan) is not None:
        raise ConflictError("plan-first", "plan-take-back")


def publish_due(database: Database, gym: UUID) -> None:
    """Publish what is due in a gym: each zone, and each single wall, in one transaction.

    Raises
    ------
    Exception : one of them failed and may be retried; the others are done.
    """
    with database.reading() as session:
        groups = _due_scans(session, gym)
    failure: Exception | None = None
    for scans in groups:
        try:
            with database.writing() as session:
                for scan in scans:
                    _carry_out(session, scan)
        except WalltopoError as why:  # the gym has to decide: nothing is tried again
            _LOG.warning("planned publication of %s: %s", scans, why)
            with database.writing() as session:
                _store_error(session, scans, str(why))
        except Exception as error:
            failure = error
    if failure is not None:
        raise failure


def record_failure(session: Session, failure: Failure, gym: str) -> None:
    """Write the reason of a final failure into the gym's plans that are due."""
    if failure.again_at is None:
        for scans in _due_scans(session, UUID(gym)):
            _store_error(session, scans, f"the scan could not be published ({failure.shown})")


def _store_error(session: Session, scans: Sequence[UUID], why: str) -> None:
    change = update(Plan).where(Plan.scan_id.in_(scans))
    session.execute(change.values(error=why[:500]))


def _due_scans(session: Session, gym: UUID) -> list[list[UUID]]:
    """Return the scans that are due, in groups that are published together."""
    waiting = session.execute(
        select(Plan.scan_id, Plan.at, Scan.wall_id, Wall.zone)
        .join(Scan, Scan.id == Plan.scan_id)
        .join(Wall, Wall.id == Scan.wall_id)
        .where(Wall.gym_id == gym, Plan.error == "")
        .order_by(Plan.created_at)
    ).all()
    groups = [[row.scan_id] for row in waiting if row.at is not None and row.at <= now()]
    zones: dict[str, dict[UUID, UUID]] = {}
    for row in waiting:
        if row.at is None:
            zones.setdefault(row.zone, {})[row.scan_id] = row.wall_id
    for zone, planned in zones.items():
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
        raise ConflictError("version-published", "look-at-it-again")
    zone = ZoneInfo(session.get_one(Gym, wall.gym_id).time_zone)
    entries = [_entry_from_json(kept) for kept in plan.entries]
    found = {int(number): Placed(**row) for number, row in plan.found.items()}
    publish(session, row, wall.revision, entries, found, now().astimezone(zone).date())
    log_change(
        session,
        "scan.publish",
        person=plan.made_by,
        gym=wall.gym_id,
        subject=str(scan),
        planned=True,
    )
    session.delete(plan)


def _entry_from_json(kept: Mapping[str, Any]) -> Entry:
    route = kept["route"]
    return Entry(
        kept["number"], None if route is None else UUID(route), _facts_of_json(kept["facts"])
    )
