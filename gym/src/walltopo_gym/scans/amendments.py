"""Amendments: versions of a published wall with the same mesh and photos, to be edited."""

from __future__ import annotations

from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.audit import log_change
from walltopo_gym.database.engine import Database
from walltopo_gym.errors import NotFoundError
from walltopo_gym.scans.artifacts import MOVES_FILE
from walltopo_gym.scans.models import Scan, ScanEdits
from walltopo_gym.scans.queues import routes_changed
from walltopo_gym.scans.service import State
from walltopo_gym.storage.files import FileStore
from walltopo_gym.walls.models import Wall


def amend(database: Database, store: FileStore, wall: UUID, person: UUID) -> UUID:
    """Return the amendment of a wall's published version that is in review; create it if needed.

    The row exists before its files, so that no purge takes them for unreferenced. An amendment that
    a killed server left without files is completed by the next request.

    Raises
    ------
    NotFoundError : no version of the wall is published.
    """
    with database.writing() as session:
        row = _open_amendment(session, wall) or _begin_amendment(session, wall, person)
    if row.state == State.UPLOADING:
        for kind in ("scans", "pictures"):
            store.copy_below(f"{kind}/{row.amends_id}/", f"{kind}/{row.id}/")
        with database.writing() as session:
            found = session.get_one(Scan, row.id, with_for_update=True)
            if found.state == State.UPLOADING:  # else another request has completed it meanwhile
                found.state = State.REVIEW
                routes_changed(session, row.id)
    return row.id


def _open_amendment(session: Session, wall: UUID) -> Scan | None:
    amended = select(Wall.published_scan_id).where(Wall.id == wall).scalar_subquery()
    unfinished = Scan.state.in_((State.UPLOADING, State.REVIEW))
    return session.scalar(select(Scan).where(Scan.amends_id == amended, unfinished))


def _begin_amendment(session: Session, wall: UUID, person: UUID) -> Scan:
    """Create and log a scan that continues the edit log of the published one."""
    amended = session.get_one(Wall, wall)
    published = amended.published_scan_id
    if published is None:
        raise NotFoundError("nothing-published")
    before = session.get_one(Scan, published)
    # An amendment gets its own moves when it is published.
    files = {path: file for path, file in before.files.items() if path != MOVES_FILE}
    row = Scan(
        wall_id=wall,
        made_by=person,
        state=State.UPLOADING,
        reference_id=published,
        amends_id=published,
        files=files,
        scale=before.scale,
    )
    session.add(row)
    session.flush()
    log_change(session, "scan.amend", person=person, gym=amended.gym_id, subject=str(row.id))
    edits = session.get(ScanEdits, published)
    if edits is not None:
        session.add(
            ScanEdits(scan_id=row.id, revision=edits.revision, shown=edits.shown, log=edits.log)
        )
    return row
