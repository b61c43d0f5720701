"""An outcome of the log as the editor wants it: rows, and the places where labels changed."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.editing.crops import cutout_of
from walltopo.editing.messages import EditResult, Region, ShownHold, Surface
from walltopo.editing.replay import Outcome
from walltopo.editing.snapshot import ScanSnapshot
from walltopo.scans.attributes import Doubtful
from walltopo.scans.holds import HoldRow, hold_rows

CELL = 0.25  # metres: changed triangles in cells that touch are of one region
MARGIN = 0.05  # metres of unchanged surface around a region: neighbours to compare with

Labels = NDArray[np.int32]


def shown_labels(labels: Labels, holds: Iterable[int]) -> Labels:
    """(F,) labels as a wall shows them: those of holds, 0 elsewhere."""
    shown = np.isin(labels, list(holds))
    return np.where(shown, labels, 0).astype(np.int32)


def result_of(scanned: ScanSnapshot, outcome: Outcome, touched: NDArray[np.bool_]) -> EditResult:
    """What the editor is told.

    Parameters
    ----------
    touched : (F,) triangles whose label may differ from what a page was made with.
    """
    rows = [
        ShownHold(**_fields(row), cutout=cutout_of(outcome.pictures.get(row.id)))
        for row in outcome.holds.holds
    ]
    rows += [_left_out(row) for row in outcome.left_out]
    labels = shown_labels(outcome.labels, (row.id for row in outcome.holds.holds))
    regions = tuple(_regions(scanned, labels, np.flatnonzero(touched)))
    return EditResult(
        holds=tuple(sorted(rows, key=lambda row: row.id)),
        routes=outcome.routes.routes,
        surface=Surface(regions) if regions else None,
        notes=outcome.notes,
    )


def _left_out(row: Doubtful) -> ShownHold:
    (shown,) = hold_rows((row.hold.rounded(),), {row.hold.id: row.score}, ())
    return ShownHold(**_fields(shown), left_out=row.reason)


def _fields(row: HoldRow) -> dict[str, Any]:
    return {name: getattr(row, name) for name in HoldRow.__struct_fields__}


def _regions(scanned: ScanSnapshot, labels: Labels, rows: NDArray[np.int64]) -> Iterator[Region]:
    """Balls around the clusters of some triangles."""
    if len(rows) == 0:
        return
    from scipy.ndimage import label

    centroids = scanned.mesh.centroids
    cell = np.floor(centroids[rows] / (CELL * scanned.unit)).astype(np.int64)
    cell -= cell.min(axis=0)
    grid = np.zeros(cell.max(axis=0) + 1, dtype=bool)
    grid[tuple(cell.T)] = True
    clusters, count = label(grid, structure=np.ones((3, 3, 3)))
    own = clusters[tuple(cell.T)]
    for number in range(1, count + 1):
        places = centroids[rows[own == number]]
        middle = (places.min(axis=0) + places.max(axis=0)) / 2
        radius = float(np.linalg.norm(places - middle, axis=1).max()) + MARGIN * scanned.unit
        inside = scanned.triangles.within(middle, radius)
        x, y, z = middle.tolist()
        yield Region(
            at=(x, y, z),
            radius_m=radius,
            centroids=_base64(centroids[inside].astype("<f4")),
            labels=_base64(labels[inside].astype("<i4")),
        )


def _base64(values: NDArray[np.generic]) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii")
