"""The job that compares a published version with the scan before: a minute for a wall.

It is queued with the publication. Setters make new routes and strip old ones on purpose: only
changes of holds whose route stayed are stored.
"""

from __future__ import annotations

import tempfile
import threading
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo.core.files import read_json
from walltopo.scans.folder import ScanFolder
from walltopo_gym.database.engine import Database
from walltopo_gym.errors import NotFoundError
from walltopo_gym.events import HoldsChanged, WallPublished, publish_event
from walltopo_gym.hold_changes.models import HoldChange, HoldComparison
from walltopo_gym.jobs.queue import Failure, Job, enqueue
from walltopo_gym.publishing.models import Placement
from walltopo_gym.publishing.version_holds import frames, same_mesh
from walltopo_gym.scans.artifacts import download_surface
from walltopo_gym.scans.commands import run_command
from walltopo_gym.scans.models import Scan
from walltopo_gym.scans.service import State
from walltopo_gym.storage.files import FileStore
from walltopo_gym.walls.models import Wall

# It takes all processors for a minute; a worker that dies begins it again.
COMPARISONS: Final = Job("hold-comparisons", at_once=1, of_one_gym=1, restarts=3)
_LIMIT_S: Final = 3600.0
_KINDS: Final = {"turned": "turned", "moved": "moved", "went": "gone", "came": "new"}

_NO_ROUTE: Final[frozenset[UUID]] = frozenset()

Routes = Mapping[int, frozenset[UUID]]  # those of a hold, by its id


def wall_published(session: Session, event: WallPublished) -> None:
    """Queue the comparison of a version with the scan before, unless it was compared already."""
    same = same_mesh(session, event.wall, event.scan)
    known = select(HoldComparison.scan_id).where(HoldComparison.scan_id.in_(same))
    since = _scan_before(session, event.wall, event.scan, same)
    if since is not None and session.scalar(known) is None:
        row = HoldComparison(scan_id=event.scan, since_id=since.id, since=since.published_at)
        session.add(row)
        key = f"hold-comparison-{event.scan}"
        enqueue(session, COMPARISONS, str(event.scan), gym=event.gym, key=key)


def _scan_before(session: Session, wall: UUID, scan: UUID, same: set[UUID]) -> Scan | None:
    """Return the last version from earlier photos in the same coordinates; None without one.

    Parameters
    ----------
    same : versions that number holds as `scan` does.
    """
    own, frame_of = session.get_one(Scan, scan), frames(session, wall)
    former = select(Scan).where(
        Scan.wall_id == wall,
        Scan.state == State.SUPERSEDED,
        Scan.created_at < own.created_at,
        Scan.id.not_in(same),
    )
    rows = session.scalars(former.order_by(Scan.published_at.desc()))
    return next((row for row in rows if frame_of[row.id] == frame_of[scan]), None)


@dataclass(frozen=True)
class HoldComparisons:
    """The job that compares the holds of two versions."""

    database: Database
    store: FileStore
    stopping: threading.Event = field(default_factory=threading.Event)

    def compare(self, scan: str) -> None:
        """Compare a version and store its changes; repeating it at any point is fine."""
        one = UUID(scan)
        with self.database.reading() as session:
            row = session.get(HoldComparison, one)
            if row is None or row.since_id is None or row.compared is not None:
                return
            since = row.since_id
        changes, error = self._changes(since, one)
        with self.database.writing() as session:
            _store_result(session, one, changes, error)

    def _changes(self, since: UUID, scan: UUID) -> tuple[list[dict[str, Any]], str]:
        """Return the rows of `walltopo inventory`, or why there are none.

        Raises
        ------
        WorkerStopsError : the worker stops.
        """
        with tempfile.TemporaryDirectory() as name:
            folders = [ScanFolder(Path(name) / part) for part in ("since", "scan")]
            try:
                for version, folder in zip((since, scan), folders, strict=True):
                    download_surface(self.store, version, folder)
            except NotFoundError:
                return [], "the files of a version are not stored any more"
            out = Path(name) / "changes.json"
            old, new = (str(folder.root) for folder in folders)
            words = ["inventory", new, "--since", old, "--loose"]
            words += ["--format", "json", "--out", str(out)]
            error = run_command(words, _LIMIT_S, self.stopping)
            return ([], error) if error else (read_json(out)["rows"], "")


def record_failure(session: Session, failure: Failure, scan: str) -> None:
    """Write down why the comparison failed for the last time."""
    if failure.again_at is None:
        _store_result(session, UUID(scan), [], failure.shown)


def _store_result(session: Session, scan: UUID, rows: list[dict[str, Any]], error: str) -> None:
    """Store the result of a comparison.

    Parameters
    ----------
    rows : as `walltopo inventory --since` lists them. error : why there are none, else empty.
    """
    comparison = session.get(HoldComparison, scan, with_for_update=True)
    if comparison is None or comparison.compared is not None:  # deleted, or another try was faster
        return
    comparison.error = error[:500]
    if error or comparison.since_id is None:
        return
    comparison.compared = sum(
        row["old_id"] is not None and row["new_id"] is not None for row in rows
    )
    routes = _KeptRoutes.of(session, comparison.since_id, scan)
    changes = [_change_row(scan, row, routes) for row in rows if routes.have_unplanned(row)]
    if changes:
        session.add_all(changes)
        wall = session.get_one(Wall, session.get_one(Scan, scan).wall_id)
        publish_event(session, HoldsChanged(wall.gym_id, wall.id, scan, len(changes)))


@dataclass(frozen=True)
class _KeptRoutes:
    """The routes of the holds in both versions, and the routes that both have.

    Parameters
    ----------
    before, after : by the hold's id.
    """

    before: Routes
    after: Routes
    kept: frozenset[UUID]

    @classmethod
    def of(cls, session: Session, since: UUID, scan: UUID) -> _KeptRoutes:
        before, after = _routes_of(session, since), _routes_of(session, scan)
        kept = _NO_ROUTE.union(*before.values()) & _NO_ROUTE.union(*after.values())
        return cls(before, after, kept)

    def of_row(self, row: dict[str, Any]) -> tuple[frozenset[UUID], frozenset[UUID]]:
        """Return the routes of a row's hold before and after."""
        return (
            self.before.get(row["old_id"], _NO_ROUTE),
            self.after.get(row["new_id"], _NO_ROUTE),
        )

    def have_unplanned(self, row: dict[str, Any]) -> bool:
        """Return whether a row is a change that no new, changed or stripped route explains."""
        old, new = self.of_row(row)
        if row["what"] in ("turned", "moved"):
            return bool(old & new) or not (old or new)
        return row["what"] in ("went", "came") and bool((old | new) & self.kept)


def _change_row(scan: UUID, row: dict[str, Any], routes: _KeptRoutes) -> HoldChange:
    """Return a row as it is stored; of several routes, it names one that stayed."""
    old, new = routes.of_row(row)
    return HoldChange(
        scan_id=scan,
        hold=row["new_id"],
        route_id=min((new or old) & routes.kept, default=None),
        colour=row["colour"][:40],
        kind=_KINDS[row["what"]],
        turn_deg=row["turn_deg"],
        moved_m=row["moved_m"],
    )


def _routes_of(session: Session, scan: UUID) -> Routes:
    found: dict[int, set[UUID]] = defaultdict(set)
    for row in session.scalars(select(Placement).where(Placement.scan_id == scan)):
        for hold in row.holds:
            found[hold].add(row.route_id)
    return {hold: frozenset(routes) for hold, routes in found.items()}
