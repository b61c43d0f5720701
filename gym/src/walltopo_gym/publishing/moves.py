"""Suggested moves of a published version, and the facts that climbers search by: a job of some
seconds.

It is queued with the publication. The moves become a public file of the version, `moves.json` as
`walltopo moves` writes it. They are computed once per version and never change afterwards.
"""

from __future__ import annotations

import logging
import math
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo.core import InputError
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Hold
from walltopo.scans.moves import Moves, RouteMoves, moves_basis
from walltopo.scans.routes import Route
from walltopo_climb.grades.of_scan import climb_route
from walltopo_climb.movement.body import BODIES
from walltopo_climb.movement.reach import reaching_heights
from walltopo_climb.movement.rows import climber_rows
from walltopo_climb.wall_files import read_wall
from walltopo_gym.database.engine import Database
from walltopo_gym.errors import NotFoundError
from walltopo_gym.jobs.queue import Failure
from walltopo_gym.publishing.models import Placement
from walltopo_gym.scans.artifacts import MOVES_FILE, download_files, store_public_file
from walltopo_gym.scans.models import Scan
from walltopo_gym.scans.queues import queue_moves
from walltopo_gym.scans.service import State
from walltopo_gym.storage.files import FileStore

_LOG = logging.getLogger("walltopo_gym.publishing")
_PUBLIC: Final = (State.PUBLISHED, State.SUPERSEDED)
# Heights and arm spans of the movement model: 1.55, 1.75 and 1.90 m (`walltopo_climb.movement`).
_BODIES: Final = {name: BODIES[name] for name in ("short", "adult", "tall")}
_LATER: Final = 2  # priority of versions that were published before this program


def queue_missing(database: Database) -> None:
    """Queue each published version without moves, the newest first; each once, whatever number of
    workers start."""
    missing = (
        select(Scan.id)
        .where(Scan.state.in_(_PUBLIC), Scan.moves.is_(None))
        .order_by(Scan.published_at.desc())
    )
    with database.writing() as session:
        for scan in session.scalars(missing).all():
            queue_moves(session, scan, _LATER)


@dataclass(frozen=True)
class SuggestedMoves:
    """The job that computes the moves of published versions."""

    database: Database
    store: FileStore

    def suggest(self, scan: str) -> None:
        """Compute and store the moves of a version; repeating it at any point is fine."""
        one = UUID(scan)
        with self.database.reading() as session:
            if not _is_wanted(session.get(Scan, one)):
                return
            placed = select(Placement.number).where(Placement.scan_id == one)
            numbers = frozenset(session.scalars(placed))
        try:
            with tempfile.TemporaryDirectory() as name:
                folder = ScanFolder(Path(name))
                download_files(self.store, one, folder, folder.holds, folder.routes)
                found, facts = _possible_moves(folder, numbers)
                found.save(folder.moves)
                file = store_public_file(self.store, folder.moves)
        except (NotFoundError, InputError) as error:  # another try would find the same files
            _LOG.warning("scan %s: no moves (%s)", scan, error)
            with self.database.writing() as session:
                _store_failure(session, one, str(error))
            return
        with self.database.writing() as session:
            row = _locked_version(session, one)
            if row is not None:
                row.files = {**row.files, MOVES_FILE: file}
                row.moves = _moves_summary([each.route for each in found.routes])
                for placement in session.scalars(select(Placement).where(Placement.scan_id == one)):
                    for name, value in facts.get(placement.number, {}).items():
                        setattr(placement, name, value)


def record_failure(session: Session, failure: Failure, scan: str) -> None:
    """Mark the version as one without moves after the last failed try."""
    if failure.again_at is None:
        _store_failure(session, UUID(scan), failure.error)


def _store_failure(session: Session, scan: UUID, error: str) -> None:
    row = _locked_version(session, scan)
    if row is not None:
        row.moves = _moves_summary([], error.partition("\n")[0] or "unknown")


def _moves_summary(routes: list[int], error: str = "") -> dict[str, Any]:
    """Return the value of `Scan.moves`."""
    return {"routes": routes, "error": error}


def _locked_version(session: Session, scan: UUID) -> Scan | None:
    """Return the version, locked until the transaction ends, if it still has no moves."""
    row = session.scalar(select(Scan).where(Scan.id == scan).with_for_update())
    return row if _is_wanted(row) else None


def _is_wanted(row: Scan | None) -> bool:
    """Return whether a version is public and has no moves yet."""
    return row is not None and row.state in _PUBLIC and row.moves is None


def _possible_moves(
    folder: ScanFolder, numbers: frozenset[int]
) -> tuple[Moves, dict[int, dict[str, Any]]]:
    """Return the moves of those of these routes on which some body can leave the ground, and the
    facts of each route by its number."""
    holds, routes, unit = read_wall(folder.root)
    rows, facts = [], {}
    for route in routes:
        if route.id in numbers:
            facts[route.id] = _placement_columns(route, holds, unit)
            climbers = climber_rows(route, holds, unit, _BODIES)
            if any(climber.moves for climber in climbers):
                rows.append(RouteMoves(route.id, climbers))
    return Moves(unit=unit, made_for=moves_basis(holds, routes), routes=tuple(rows)), facts


def _placement_columns(route: Route, holds: Sequence[Hold], unit: float) -> dict[str, Any]:
    """Return columns of `Placement` by name."""
    heights = reaching_heights(route, holds, unit)
    climbed = climb_route(route, holds, unit)
    ups = [hold.position[2] for hold in holds if hold.id in set(route.holds)]
    names = ("reach", "longest_reach", "height_m", "features")
    facts: dict[str, Any] = dict.fromkeys(names)
    if heights is not None:
        facts["reach"] = list(heights)
        facts["longest_reach"] = [round(reach, 2) for reach in heights.values()]
    if ups:
        facts["height_m"] = round((max(ups) - min(ups)) / unit, 2)
    if climbed is not None and climbed.moves.reached:
        values = climbed.features.tolist()
        facts["features"] = [None if math.isnan(value) else value for value in values]
    return facts
