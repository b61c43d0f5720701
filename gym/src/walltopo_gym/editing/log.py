"""The log of a scan's edits in the database, where a save is kept before it is acknowledged."""

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
from walltopo_gym.editing.models import ScanEdits
from walltopo_gym.errors import ConflictError
from walltopo_gym.scans.models import Scan
from walltopo_gym.scans.states import check_in_review


@dataclass(frozen=True)
class SavedLog:
    """A log, the number of its save, and that of the save that the scan's files show."""

    log: EditLog
    revision: int
    shown: int

    @property
    def is_pending(self) -> bool:
        """Whether the files are older than the log."""
        return self.revision != self.shown


def read_log(session: Session, scan: UUID) -> SavedLog:
    """The log of a scan; an empty one where nobody has edited it."""
    row = session.get(ScanEdits, scan)
    if row is None:
        return SavedLog(EditLog(), 0, 0)
    return SavedLog(parse(row.log, EditLog, "the saved edits"), row.revision, row.shown)


def save_log(session: Session, scan: UUID, log: EditLog, revision: int) -> int:
    """Keep a log that was made on a revision; its own revision.

    Raises
    ------
    ConflictError : other edits were saved since, or the scan is not in review any more.
    """
    _taken(session, scan)
    row = session.get(ScanEdits, scan)
    if revision != (0 if row is None else row.revision):
        raise ConflictError(
            "other edits were saved since this page read them; nothing was changed",
            "Reload to go on from those: what was done here since is then gone.",
        )
    values = msgspec.to_builtins(log)
    if row is None:
        session.add(ScanEdits(scan_id=scan, revision=1, shown=0, log=values))
        return 1
    row.revision, row.log = revision + 1, values
    return row.revision


def mark_shown(session: Session, scan: UUID, revision: int, files: Mapping[str, Any]) -> None:
    """Let these files be the scan's; not where it is not in review any more, or gone."""
    try:
        row = _taken(session, scan)
    except ConflictError:
        return
    session.get_one(ScanEdits, scan).shown = revision
    row.files = dict(files)


def check_carried_out(session: Session, scan: UUID) -> None:
    """Refuse to publish a scan whose files do not show what was saved.

    Raises
    ------
    ConflictError : so it is.
    """
    _taken(session, scan)
    if read_log(session, scan).is_pending:
        raise ConflictError("the last edits are still being carried out", "It takes some seconds.")


def _taken(session: Session, scan: UUID) -> Scan:
    """The scan's row, held until the transaction ends: saving and publishing go one by one."""
    row = session.scalar(select(Scan).where(Scan.id == scan).with_for_update())
    check_in_review("gone" if row is None else row.state)
    assert row is not None
    return row
