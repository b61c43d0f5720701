"""What a setter is shown of a scan before it is published."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo.describe.matching.routes import Line, compare
from walltopo.scans import routes as found
from walltopo.scans.attributes import Attributes, Hold
from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Manifest
from walltopo_gym.gyms.models import Wall
from walltopo_gym.publishing.models import Placement, Route
from walltopo_gym.publishing.worse import worse_than
from walltopo_gym.scans.models import Scan
from walltopo_gym.scans.shelf import take_files
from walltopo_gym.storage.files import FileStore


@dataclass(frozen=True)
class Review:
    """The lines to confirm, the routes of the scan by number, the wall's revision, and where the
    scan is worse than the last one."""

    lines: list[Line[UUID]]
    routes: dict[int, found.Route]
    revision: int
    warnings: list[str]


def found_routes(store: FileStore, scan: UUID) -> dict[int, found.Route]:
    """The routes of a scan by their numbers."""
    with tempfile.TemporaryDirectory() as name:
        folder = ScanFolder(Path(name))
        take_files(store, scan, folder, "routes")
        return {route.id: route for route in found.Routes.load(folder.routes).routes}


def review(session: Session, store: FileStore, scan: Scan) -> Review:
    """Compare a scan with what hangs."""
    wall = session.get_one(Wall, scan.wall_id)
    routes = found_routes(store, scan.id)
    new = {number: route.holds for number, route in routes.items()}
    before = wall.published_scan_id
    warnings = worse_than(
        None if before is None else _manifest(store, before), _manifest(store, scan.id)
    )
    if before is None:
        lines: list[Line[UUID]] = compare({}, (), new, ())
        return Review(lines, routes, wall.revision, warnings)
    hanging = session.scalars(
        select(Placement)
        .join(Route, Route.id == Placement.route_id)
        .where(Placement.scan_id == before, Route.stripped_at.is_(None))
        .order_by(Placement.number)
    )
    old = {placement.route_id: placement.holds for placement in hanging}
    old_holds, _ = _holds(store, before)
    new_holds, unit = _holds(store, scan.id)
    lines = compare(old, old_holds, new, new_holds, unit)
    return Review(lines, routes, wall.revision, warnings)


def _manifest(store: FileStore, scan: UUID) -> Manifest:
    with tempfile.TemporaryDirectory() as name:
        folder = ScanFolder(Path(name))
        take_files(store, scan, folder, "manifest")
        return Manifest.load(folder.manifest)


def _holds(store: FileStore, scan: UUID) -> tuple[tuple[Hold, ...], float]:
    """The holds of a scan, and its units a metre."""
    with tempfile.TemporaryDirectory() as name:
        folder = ScanFolder(Path(name))
        take_files(store, scan, folder, "attributes")
        found = Attributes.load(folder.attributes)
    return found.instances, found.unit
