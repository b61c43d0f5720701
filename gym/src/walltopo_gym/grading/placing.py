"""Estimate the difficulty and the reach of a scan's routes: a job of some seconds.

It is queued when a scan comes to its review and when its edits are applied. A starting worker
queues it for each scan in review, published or former whose estimates are missing or of another
model. Requests read the table and run no network.
"""

from __future__ import annotations

import logging
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final
from uuid import UUID

import msgspec
from sqlalchemy import and_, delete, func, or_, select, update
from sqlalchemy.orm import Session

from walltopo.core import InputError
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Hold
from walltopo.scans.routes import Route
from walltopo_climb.grades.model import shipped_identity, shipped_model
from walltopo_climb.grades.of_scan import Graded, rate_routes
from walltopo_climb.movement.reach import Reached, reached_by_arms
from walltopo_climb.wall_files import read_wall
from walltopo_gym.database.engine import Database
from walltopo_gym.errors import NotFoundError
from walltopo_gym.events import ReviewChanged
from walltopo_gym.grading.models import PlacedRoute, ScanPlaces
from walltopo_gym.jobs.queue import Job, enqueue
from walltopo_gym.scans.artifacts import download_files
from walltopo_gym.scans.models import Scan, ScanEdits
from walltopo_gym.scans.service import State
from walltopo_gym.storage.files import FileStore
from walltopo_gym.walls.models import Wall

_LOG = logging.getLogger("walltopo_gym.grading")
PLACES: Final = Job("places", at_once=1, of_one_gym=1)  # a wall takes a processor for seconds
PLACED: Final = (State.REVIEW, State.PUBLISHED, State.SUPERSEDED)


def review_changed(session: Session, event: ReviewChanged) -> None:
    """Queue the estimates of a scan's routes."""
    enqueue(session, PLACES, str(event.scan), gym=event.gym)


def queue_missing(database: Database) -> None:
    """Queue each scan without estimates of this model and of its edits, and each in review without
    the reach, the newest first; each once, whatever number of workers start."""
    model = shipped_identity()
    shown = func.coalesce(ScanEdits.shown, 0)
    lacks_reach = and_(ScanPlaces.reach.is_(None), Scan.state == State.REVIEW)
    is_old = or_(
        ScanPlaces.scan_id.is_(None),
        ScanPlaces.model != model,
        ScanPlaces.shown != shown,
        lacks_reach,
    )
    missing = (
        select(Scan.id, shown, Wall.gym_id)
        .join(Wall, Wall.id == Scan.wall_id)
        .join(ScanPlaces, ScanPlaces.scan_id == Scan.id, isouter=True)
        .join(ScanEdits, ScanEdits.scan_id == Scan.id, isouter=True)
        .where(Scan.state.in_(PLACED), is_old)
        .order_by(Scan.created_at.desc())
    )
    with database.writing() as session:
        for scan, edits, gym in session.execute(missing).all():
            key = f"places-and-reach-{scan}-{model}-{edits}"
            enqueue(session, PLACES, str(scan), gym=gym, key=key)


@dataclass(frozen=True)
class _Wall:
    """The holds and routes of a scan, and scan units per metre."""

    holds: Sequence[Hold]
    routes: Sequence[Route]
    unit: float

    def rated(self) -> tuple[Graded, ...]:
        """Return the routes that an adult can climb, with their difficulty."""
        return rate_routes(self.routes, self.holds, self.unit, shipped_model())

    def reach(self) -> dict[str, list[Reached]]:
        """Return which heights reach the top of each route that is a climb, by its number."""
        found = {route.id: reached_by_arms(route, self.holds, self.unit) for route in self.routes}
        return {str(number): list(row) for number, row in found.items() if row is not None}


@dataclass(frozen=True)
class Placing:
    """The job that estimates the routes of scans."""

    database: Database
    store: FileStore

    def place(self, scan: str) -> None:
        """Estimate the routes of a scan; repeating it at any point is fine."""
        one = UUID(scan)
        with self.database.reading() as session:
            # Read before the files: an edit that comes between has it done once more.
            edits = session.get(ScanEdits, one)
            shown = 0 if edits is None else edits.shown
        wall = self._wall(one)
        found = () if wall is None else wall.rated()
        learnt = msgspec.to_builtins(shipped_model().learnt)
        row = ScanPlaces(
            scan_id=one, model=shipped_identity(), shown=shown, learnt=learnt, reach=None
        )
        with self.database.writing() as session:
            if session.get(Scan, one) is None:
                return
            session.execute(delete(PlacedRoute).where(PlacedRoute.scan_id == one))
            session.merge(row)
            session.flush()
            session.add_all(
                PlacedRoute(
                    scan_id=one, number=each.route.id, place=each.difficulty, known=each.known
                )
                for each in found
            )
        # Afterwards, as it takes longer: the setter sees the estimates meanwhile.
        reach = {} if wall is None else wall.reach()
        these = ScanPlaces.scan_id == one, ScanPlaces.shown == shown
        with self.database.writing() as session:
            session.execute(update(ScanPlaces).where(*these).values(reach=reach))

    def _wall(self, scan: UUID) -> _Wall | None:
        """Return the wall of a scan; None if its files are gone."""
        try:
            with tempfile.TemporaryDirectory() as name:
                folder = ScanFolder(Path(name))
                download_files(self.store, scan, folder, folder.holds, folder.routes)
                return _Wall(*read_wall(folder.root))
        except (NotFoundError, InputError) as error:
            _LOG.warning("scan %s: its routes are not placed (%s)", scan, error)
            return None
