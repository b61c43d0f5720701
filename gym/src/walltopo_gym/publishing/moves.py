"""Suggested moves and reach of a published version: a job of some seconds.

It is queued with the publication. The moves become a public file of the version, `moves.json` as
`walltopo moves` writes it. They are computed once per version and never change afterwards.
"""

from __future__ import annotations

import logging
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo.core import InputError
from walltopo.scans.folder import ScanFolder
from walltopo.scans.moves import Moves, RouteMoves, moves_basis
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
                found, reach = _moves(folder, numbers)
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
                row.moves = _summary([each.route for each in found.routes])
                for placement in session.scalars(select(Placement).where(Placement.scan_id == one)):
                    placement.reach = reach.get(placement.number)


def record_failure(session: Session, failure: Failure, scan: str) -> None:
    """Mark the version as one without moves after the last failed try."""
    if failure.again_at is None:
        _store_failure(session, UUID(scan), failure.error)


def _store_failure(session: Session, scan: UUID, error: str) -> None:
    row = _locked_version(session, scan)
    if row is not None:
        row.moves = _summary([], error.partition("\n")[0] or "unknown")


def _summary(routes: list[int], error: str = "") -> dict[str, Any]:
    """Return the value of `Scan.moves`."""
    return {"routes": routes, "error": error}


def _locked_version(session: Session, scan: UUID) -> Scan | None:
    """Return the version, locked until the transaction ends, if it still has no moves."""
    row = session.scalar(select(Scan).where(Scan.id == scan).with_for_update())
    return row if _is_wanted(row) else None


def _is_wanted(row: Scan | None) -> bool:
    """Return whether a version is public and has no moves yet."""
    return row is not None and row.state in _PUBLIC and row.moves is None


def _moves(folder: ScanFolder, numbers: frozenset[int]) -> tuple[Moves, dict[int, list[float]]]:
    """Return the moves of those of these routes on which some body can leave the ground, and the
    heights that reach the top of each climb."""
    holds, routes, unit = read_wall(folder.root)
    rows, reach = [], {}
    for route in routes:
        if route.id in numbers:
            heights = reaching_heights(route, holds, unit)
            if heights is not None:
                reach[route.id] = list(heights)
            climbers = climber_rows(route, holds, unit, _BODIES)
            if any(climber.moves for climber in climbers):
                rows.append(RouteMoves(route.id, climbers))
    return Moves(unit=unit, made_for=moves_basis(holds, routes), routes=tuple(rows)), reach
