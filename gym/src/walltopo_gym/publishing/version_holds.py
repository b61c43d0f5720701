"""Holds of published versions of a wall, and which hold of a version is which of another.

Amendments keep the ids of holds. A new scan numbers its holds anew.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo.describe.matching.holds import match_holds
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Hold, Holds
from walltopo_gym.errors import RequestError
from walltopo_gym.scans.artifacts import download_files
from walltopo_gym.scans.models import Scan
from walltopo_gym.scans.service import State
from walltopo_gym.storage.files import FileStore
from walltopo_gym.walls.models import Wall


@dataclass(frozen=True)
class VersionHolds:
    """The holds of a version by id, and its units per metre."""

    by_id: Mapping[int, Hold]
    unit: float


def check_version(session: Session, wall: Wall, scan: UUID) -> None:
    """Refuse a version that the wall never published.

    Raises
    ------
    RequestError : it is no version of this wall.
    """
    row = session.get(Scan, scan)
    shown = (State.PUBLISHED, State.SUPERSEDED)
    if row is None or row.wall_id != wall.id or row.state not in shown:
        raise RequestError("hold-version-unknown")


def read_holds(store: FileStore, scan: UUID) -> VersionHolds:
    """Return the holds of a scan, published or not.

    Raises
    ------
    NotFoundError : the scan has not come so far, or its files are gone.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = ScanFolder(Path(name))
        download_files(store, scan, folder, folder.holds)
        found = Holds.load(folder.holds)
    return VersionHolds({hold.id: hold for hold in found.holds}, found.unit)


# Those of a published version never change.
version_holds = lru_cache(maxsize=64)(read_holds)


def origins(session: Session, wall: UUID) -> dict[UUID, UUID]:
    """Return for each version of a wall the scan that it amends, through all amendments."""
    return _first_scans(session, wall, lambda row: row.amends_id)


def frames(session: Session, wall: UUID) -> dict[UUID, UUID]:
    """Return for each scan of a wall the scan whose coordinates it has."""
    return _first_scans(session, wall, lambda row: row.amends_id or row.reference_id)


def _first_scans(
    session: Session, wall: UUID, before: Callable[[Scan], UUID | None]
) -> dict[UUID, UUID]:
    """Return for each scan of a wall the first one that is reached by going back."""
    rows = session.scalars(select(Scan).where(Scan.wall_id == wall))
    known = {row.id: before(row) for row in rows}

    def first(of: UUID) -> UUID:
        while (earlier := known.get(of)) is not None:
            of = earlier
        return of

    return {one: first(one) for one in known}


def same_mesh(session: Session, wall: UUID, scan: UUID) -> set[UUID]:
    """Return a version with its amendments and those that it amends: they number holds alike."""
    known = origins(session, wall)
    return {one for one, origin in known.items() if origin == known[scan]}


def current_holds(session: Session, store: FileStore, wall: Wall, scan: UUID) -> Mapping[int, int]:
    """Return the id in the wall's published version of each hold of `scan` that is still there."""
    current = wall.published_scan_id
    if current is None:
        return {}
    return holds_between(store, origins(session, wall.id), scan, current)


def holds_between(
    store: FileStore, known: Mapping[UUID, UUID], scan: UUID, other: UUID
) -> Mapping[int, int]:
    """Return the id in the version `other` of each hold of `scan` that is there, too.

    Parameters
    ----------
    known : the `origins` of the versions.
    """
    return _holds_between(store, scan, other, known[scan] == known[other])


@lru_cache(maxsize=256)
def _holds_between(store: FileStore, scan: UUID, other: UUID, same_ids: bool) -> Mapping[int, int]:
    old, new = version_holds(store, scan), version_holds(store, other)
    if same_ids:
        return {hold: hold for hold in old.by_id if hold in new.by_id}
    return match_holds(list(old.by_id.values()), list(new.by_id.values()), new.unit)
