"""A distance that a setter measured on a scan's wall gives the scan its metres."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any
from uuid import UUID

import numpy as np
from sqlalchemy.orm import Session

from walltopo.core import View
from walltopo.scans.colmap_model import read_views
from walltopo_gym.errors import ConflictError, RequestError
from walltopo_gym.scans.artifacts import download_sparse
from walltopo_gym.scans.models import Scan, ScanEdits
from walltopo_gym.scans.service import State, begin_run, check_in_review
from walltopo_gym.storage.files import FileStore

if TYPE_CHECKING:
    from walltopo.scans.scale import Point

_MIN_PHOTOS_PER_POINT = 2


def check_scalable(scan: Scan) -> None:
    """Refuse to scale a scan that is not in review, or that another version gives its metres.

    Raises
    ------
    ConflictError : it is one of these.
    """
    check_in_review(scan.state)
    if scan.reference_id is not None or scan.amends_id is not None:
        raise ConflictError("scale-of-reference")


def mark_points(
    store: FileStore, scan: UUID, points: tuple[Point, Point]
) -> dict[str, dict[str, tuple[float, float]]]:
    """Return the pixels of two points of a scan's wall, by point ("a", "b") and photo.

    Parameters
    ----------
    points : in the scan's own frame.

    Raises
    ------
    RequestError : fewer than two photos show one of the points, or both are the same.
    """
    from walltopo.reconstruct.scale.known_distance import mark_point

    if points[0] == points[1]:
        raise RequestError("points-the-same")
    with tempfile.TemporaryDirectory() as name:
        views: list[View] = read_views(download_sparse(store, scan, Path(name)))
    marked = {
        letter: mark_point(np.array(point), views)
        for letter, point in zip("ab", points, strict=True)
    }
    if min(len(marks) for marks in marked.values()) < _MIN_PHOTOS_PER_POINT:
        raise RequestError("point-not-photographed", "point-not-photographed-hint")
    return marked


def set_distance(
    session: Session, scan: Scan, marked: dict[str, dict[str, tuple[float, float]]], metres: float
) -> None:
    """Queue a scan in review again, scaled by a known distance between two points.

    The stages before `scale` are kept. The setters' edits are dropped: their coordinates are those
    of the scan before.

    Parameters
    ----------
    marked : see `mark_points`.

    Raises
    ------
    ConflictError : the scan is not in review, or another version gives it its metres.
    """
    check_scalable(scan)
    begin_run(session, scan, before=State.REVIEW)
    scan.distance = {"metres": metres, "points": marked}
    edits = session.get(ScanEdits, scan.id)
    if edits is not None:
        session.delete(edits)


def distance_settings(distance: dict[str, Any], points: Path) -> list[str]:
    """Write the points of `Scan.distance` to a TOML file; return the settings of the pipeline."""
    from walltopo.reconstruct.scale.known_distance import write_points

    write_points(distance["points"], points)
    between = f"a-b={distance['metres']}"
    return [
        "scale.method=distance",
        f"scale.points={json.dumps(str(points.absolute()))}",
        f"scale.distance={json.dumps(between)}",
    ]
