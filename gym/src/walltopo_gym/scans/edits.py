"""The edit log of a scan in the database; a save is stored before it is acknowledged."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any
from uuid import UUID

import msgspec
from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo.scans.document import parse
from walltopo.scans.edits import EditLog
from walltopo_gym.errors import ConflictError
from walltopo_gym.scans.models import Scan, ScanEdits
from walltopo_gym.scans.queues import routes_changed
from walltopo_gym.scans.service import check_in_review


@dataclass(frozen=True)
class SavedLog:
    """A log, the number of its save, and the number of the save that the scan's files show."""

    log: EditLog
    revision: int
    shown: int

    @property
    def is_pending(self) -> bool:
        """Return whether the files are older than the log."""
        return self.revision != self.shown


def read_log(session: Session, scan: UUID) -> SavedLog:
    """Return the log of a scan; an empty one before any edit."""
    row = session.get(ScanEdits, scan)
    if row is None:
        return SavedLog(EditLog(), 0, 0)
    return SavedLog(parse(row.log, EditLog, "the saved edits"), row.revision, row.shown)


def save_log(session: Session, scan: UUID, log: EditLog, revision: int) -> int:
    """Save a log that was based on a revision; return its own revision.

    Raises
    ------
    ConflictError : other edits were saved since, or the scan is not in review any more.
    """
    _locked_scan(session, scan)
    row = session.get(ScanEdits, scan)
    if revision != (0 if row is None else row.revision):
        raise ConflictError("edits-others", "edits-reload")
    values = msgspec.to_builtins(log)
    if row is None:
        session.add(ScanEdits(scan_id=scan, revision=1, shown=0, log=values))
        return 1
    row.revision, row.log = revision + 1, values
    return row.revision


def mark_shown(session: Session, scan: UUID, revision: int, files: Mapping[str, Any]) -> None:
    """Record the files of a revision; no effect if the scan has left review or is gone."""
    try:
        row = _locked_scan(session, scan)
    except ConflictError:
        return
    session.get_one(ScanEdits, scan).shown = revision
    row.files = dict(files)
    routes_changed(session, scan)


def check_carried_out(session: Session, scan: UUID) -> None:
    """Refuse to publish a scan whose files do not show the saved edits.

    Raises
    ------
    ConflictError : they do not.
    """
    _locked_scan(session, scan)
    if read_log(session, scan).is_pending:
        raise ConflictError("edits-carried-out", "takes-seconds")


def results_version(session: Session, scan: Scan) -> tuple[int, int]:
    """Return which results the scan's files are: its run, and the edits that they show."""
    edits = session.get(ScanEdits, scan.id, populate_existing=True)
    return scan.run, 0 if edits is None else edits.shown


def _locked_scan(session: Session, scan: UUID) -> Scan:
    """Return the scan's row, locked until the transaction ends, so that saves and publications are
    serial."""
    row = session.scalar(select(Scan).where(Scan.id == scan).with_for_update())
    check_in_review("gone" if row is None else row.state)
    assert row is not None
    return row
