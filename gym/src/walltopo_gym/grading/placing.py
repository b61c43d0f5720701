"""Where the grade model puts the routes of each scan: a durable job of some seconds.

A scan in review, published or former whose places are missing, of another model, or older than its
last edits is handed to DBOS, newest first: so walls from before there were places get theirs, and
all do again when the model changes. What is asked of the server reads the table and no network.
"""

from __future__ import annotations

import logging
import tempfile
import threading
from pathlib import Path
from typing import Final
from uuid import UUID

import msgspec
from dbos import DBOS, SetWorkflowID
from sqlalchemy import String, cast, delete, func, literal, or_, select

from walltopo.core import InputError
from walltopo.scans.folder import ScanFolder
from walltopo_climb.grades.model import shipped_identity, shipped_model
from walltopo_climb.grades.of_scan import Graded, place_routes
from walltopo_climb.wall_files import read_wall
from walltopo_gym.attempts.bounded import MAX_TRIES, Attempts
from walltopo_gym.attempts.models import JobAttempt
from walltopo_gym.database.engine import Database
from walltopo_gym.editing.models import ScanEdits
from walltopo_gym.errors import NotFoundError
from walltopo_gym.grading.models import PlacedRoute, ScanPlaces
from walltopo_gym.scans.models import Scan
from walltopo_gym.scans.shelf import take_files
from walltopo_gym.scans.states import State
from walltopo_gym.storage.files import FileStore

_LOG = logging.getLogger("walltopo_gym.grading")
QUEUE: Final = "places"
PLACED: Final = (State.REVIEW, State.PUBLISHED, State.SUPERSEDED)
_AT_ONCE: Final = 20

_placing: Placing | None = None


class Placing:
    """Hands scans without places to DBOS, and places their routes."""

    def __init__(self, database: Database, store: FileStore) -> None:
        global _placing
        self._database, self._store = database, store
        self._attempts = Attempts(database, "places")
        self._turn = threading.Lock()  # a wall takes a processor for seconds
        _placing = self

    def begin_missing(self) -> None:
        """Hand what is missing to DBOS."""
        for scan, name in self.claim():
            with SetWorkflowID(name):
                DBOS.enqueue_workflow(QUEUE, _place_scan, str(scan))

    def claim(self) -> list[tuple[UUID, str]]:
        """Begin a try of what is missing; return each scan with a name of its try."""
        model = shipped_identity()
        shown = func.coalesce(ScanEdits.shown, 0)
        is_old = or_(
            ScanPlaces.scan_id.is_(None), ScanPlaces.model != model, ScanPlaces.shown != shown
        )
        version = literal(f"{model}-") + cast(shown, String)
        missing = (
            select(Scan.id, version)
            .join(ScanPlaces, ScanPlaces.scan_id == Scan.id, isouter=True)
            .join(ScanEdits, ScanEdits.scan_id == Scan.id, isouter=True)
            .outerjoin(JobAttempt, self._attempts.row_of(Scan.id, version))
            .where(Scan.state.in_(PLACED), is_old, self._attempts.is_due())
            .order_by(Scan.created_at.desc())
        )
        with self._database.reading() as session:
            free = _AT_ONCE - self._attempts.held(session)
            rows = session.execute(missing.limit(max(0, free))).all()
        if not rows:
            return []
        begun = []
        with self._database.writing() as session:
            for scan, told in rows:
                number = self._attempts.begin(session, scan, QUEUE, told)
                if number:
                    begun.append((scan, f"places-{scan}-{told}-{number}"))
        return begun

    def try_once(self, scan: UUID) -> None:
        """Place the routes of a scan, and keep why where that fails."""
        with self._attempts.trying(scan):
            self.place(scan)
            with self._database.writing() as session:
                self._attempts.end(session, scan)

    def place(self, scan: UUID) -> None:
        """Place the routes of a scan; may be done again at any point."""
        with self._database.reading() as session:
            # Read before the files: an edit that comes between has it done once more.
            edits = session.get(ScanEdits, scan)
            shown = 0 if edits is None else edits.shown
        with self._turn:
            found = self._found(scan)
        learnt = msgspec.to_builtins(shipped_model().learnt)
        row = ScanPlaces(scan_id=scan, model=shipped_identity(), shown=shown, learnt=learnt)
        with self._database.writing() as session:
            if session.get(Scan, scan) is None:
                return
            session.execute(delete(PlacedRoute).where(PlacedRoute.scan_id == scan))
            session.merge(row)
            session.flush()
            session.add_all(
                PlacedRoute(scan_id=scan, number=one.route.id, place=one.place, known=one.known)
                for one in found
            )

    def _found(self, scan: UUID) -> tuple[Graded, ...]:
        """The routes of a scan that an adult gets up; none where its files are gone."""
        try:
            with tempfile.TemporaryDirectory() as name:
                folder = ScanFolder(Path(name))
                take_files(self._store, scan, folder, "holds", "routes")
                holds, routes, unit = read_wall(folder.root)
        except (NotFoundError, InputError) as error:
            _LOG.warning("scan %s: its routes are not placed (%s)", scan, error)
            return ()
        return place_routes(routes, holds, unit, shipped_model())


@DBOS.workflow(name="places", max_recovery_attempts=MAX_TRIES)
def _place_scan(scan: str) -> None:
    DBOS.run_step({"name": "place"}, _place, scan)


def _place(scan: str) -> None:
    assert _placing is not None, "the worker has not begun"
    _placing.try_once(UUID(scan))
