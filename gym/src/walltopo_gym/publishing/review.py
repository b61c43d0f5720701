"""The review of a scan before its publication, with its regressions against the last version."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo.describe.matching.routes import RouteMatch, compare_routes
from walltopo.pipeline.stages.join import JOIN
from walltopo.scans import routes as found
from walltopo.scans.folder import ScanFolder
from walltopo.scans.joined import Joined
from walltopo.scans.manifest import Manifest
from walltopo_gym.publishing.lines import lines_of, probable_line
from walltopo_gym.publishing.models import Placement, Route
from walltopo_gym.publishing.version_holds import VersionHolds, read_holds
from walltopo_gym.scans.artifacts import download_files, read_joined, read_manifest
from walltopo_gym.scans.models import Scan
from walltopo_gym.storage.files import FileStore
from walltopo_gym.walls.models import RopeLine, Wall

# Below this share of the former value a warning appears. A reset changes holds, not the wall.
_MIN_AREA: Final = 0.8

_MIN_HOLDS: Final = 0.6

_MIN_PLACED: Final = 0.8


def regressions_against(before: Manifest | None, after: Manifest) -> list[str]:
    """Return regressions in words; empty without any.

    Parameters
    ----------
    before : of the published version, None for the first one.
    after : of the scan.
    """
    warnings = []
    photos, placed = (
        _stage_figure(after, "sparse", "photos"),
        _stage_figure(after, "sparse", "registered"),
    )
    if placed < _MIN_PLACED * photos:
        warnings.append(
            f"Only {placed:.0f} of {photos:.0f} photos could be placed: parts may be missing."
        )
    if before is None:
        return warnings
    areas = [_stage_figure(scan, "dense", "area") for scan in (before, after)]
    if areas[1] < _MIN_AREA * areas[0]:
        warnings.append(
            f"The wall has {areas[1]:.0f} m², the published version {areas[0]:.0f} m²: "
            "routes beyond its edge would count as stripped."
        )
    holds = [_stage_figure(scan, "classify", "holds") for scan in (before, after)]
    if holds[1] < _MIN_HOLDS * holds[0]:
        warnings.append(
            f"{holds[1]:.0f} holds were found, {holds[0]:.0f} in the published version."
        )
    return warnings


def _stage_figure(scan: Manifest, stage: str, name: str) -> float:
    """Return a figure of the whole wall: of a partial rescan that of its stage `join`, if any."""
    for record in (scan.stages.get(JOIN.name), scan.stages.get(stage)):
        if record is not None and name in record.metrics:
            return float(record.metrics[name])
    return 0.0


@dataclass(frozen=True)
class Review:
    """The lines to confirm, the scan's routes by number, the ropes' lines on which they probably
    hang, the wall's revision, the regressions, and what a partial rescan replaced."""

    lines: list[RouteMatch[UUID]]
    routes: dict[int, found.Route]
    ropes: dict[int, UUID]
    revision: int
    warnings: list[str]
    joined: Joined | None


def found_routes(store: FileStore, scan: UUID) -> dict[int, found.Route]:
    """Return the routes of a scan by number."""
    with tempfile.TemporaryDirectory() as name:
        folder = ScanFolder(Path(name))
        download_files(store, scan, folder, folder.routes)
        return {route.id: route for route in found.Routes.load(folder.routes).routes}


def review(session: Session, store: FileStore, scan: Scan) -> Review:
    """Compare a scan with the published version."""
    wall = session.get_one(Wall, scan.wall_id)
    routes = found_routes(store, scan.id)
    new = {number: route.holds for number, route in routes.items()}
    before = wall.published_scan_id
    after = read_manifest(store, scan.id)
    # An amendment has the files of its original.
    joined = read_joined(store, scan.id) if scan.part else None
    warnings = regressions_against(None if before is None else read_manifest(store, before), after)
    if scan.part and scan.reference_id != before:
        warnings.append(
            "Another version was published since this scan began: where nothing was photographed, "
            "its changes are missing here. Scan the photos again."
        )
    if before is None:
        lines: list[RouteMatch[UUID]] = compare_routes({}, (), new, ())
        # Without a version no line has a place in the scan's frame.
        return Review(lines, routes, {}, wall.revision, warnings, joined)
    current = session.scalars(
        select(Placement)
        .join(Route, Route.id == Placement.route_id)
        .where(Placement.scan_id == before, Route.stripped_at.is_(None))
        .order_by(Placement.number)
    )
    old = {placement.route_id: placement.holds for placement in current}
    there, here = read_holds(store, before), read_holds(store, scan.id)
    lines = compare_routes(
        old, tuple(there.by_id.values()), new, tuple(here.by_id.values()), here.unit
    )
    ropes = _probable_ropes(lines_of(session, wall.id), routes, here)
    return Review(lines, routes, ropes, wall.revision, warnings, joined)


def _probable_ropes(
    lines: Sequence[RopeLine], routes: Mapping[int, found.Route], holds: VersionHolds
) -> dict[int, UUID]:
    """Return the lines on which routes probably hang, by the routes' numbers."""
    places = {
        number: [holds.by_id[hold].position for hold in route.holds if hold in holds.by_id]
        for number, route in routes.items()
    }
    found_lines = {number: probable_line(lines, these) for number, these in places.items()}
    return {number: line.id for number, line in found_lines.items() if line is not None}
