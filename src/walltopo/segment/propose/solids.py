"""Volumes that no mask shows: solids that stand out of the wall's panels, with wall around them.

Volumes often have the wall's colour, and a detector misses more of them than of the holds. Masks
outline a volume better than the mesh does (docs/propose.md), so a volume with masks stays as it is.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from walltopo.scans.instances import InstanceRecord, InstanceRecords, InstanceTable
from walltopo.segment.propose.pieces import Ground, components_of_area, stands_out
from walltopo.segment.propose.surroundings import TOP, Surroundings

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

VOLUME = "volume"
RISE = 0.012  # metres over the panel at which a solid begins
MIN_HEIGHT = 0.04  # metres: of the top
MIN_AREA, MAX_AREA = 0.06, 3.0  # square metres, without the holds on it
LONGEST = 2.5  # metres
# Minimum share of the directions along the panel in which wall is beside the solid. It excludes
# fins and what stands out at the end of a panel.
MIN_AROUND = 0.72
# Metres from an instance with masks, where there is any: what stands out farther away is a part of
# the room, as climbing walls have holds everywhere.
NEAR = 1.0
_MAX_PLACES = 20_000  # triangles of instances from which distances are measured
TAKEN = 0.2  # a solid is known if instances of volumes cover this share of it
EVIDENCE = 0.9  # probability that a proposed solid is a volume (docs/propose.md)


def find_solids(
    ground: Ground,
    label: NDArray[np.int32],
    volumes: Collection[int],
    uncertain: Collection[int] = (),
) -> list[Ints]:
    """Return the triangles of each solid that is no known volume, without the holds on it.

    Parameters
    ----------
    label : (F,) int32, instance of each triangle, 0 = none.
    volumes : ids of the instances that are volumes.
    uncertain : ids of instances with a low score, whose triangles count as free.
    """
    mesh, heights, unit = ground.mesh, ground.heights, ground.unit
    label = np.where(np.isin(label, list(uncertain)), 0, label)
    known = np.isin(label, list(volumes))
    out = stands_out(heights, ground.panels, unit, RISE) & ((label == 0) | known)
    other = (out | (label > 0)).astype(np.int32)
    surroundings = Surroundings(mesh, heights, ground.panels, other, unit)
    instances = _tree_of(mesh.centroids[label > 0])
    found = []
    for rows in components_of_area(
        mesh, ground.neighbours, out, MIN_AREA * unit**2, MAX_AREA * unit**2
    ):
        areas = mesh.areas[rows]
        if (
            np.ptp(mesh.centroids[rows], axis=0).max() <= LONGEST * unit
            and np.percentile(heights.height[rows], TOP) >= MIN_HEIGHT * unit
            and areas[known[rows]].sum() < TAKEN * areas.sum()
            and _is_near(mesh.centroids[rows], instances, NEAR * unit)
            and surroundings.relief(rows, 0).around >= MIN_AROUND
        ):
            found.append(rows[~known[rows]])
    return found


def _tree_of(places: Floats) -> cKDTree | None:
    """Return a tree of at most about `_MAX_PLACES` of (n, 3) places; None without any."""
    from scipy.spatial import cKDTree

    return cKDTree(places[:: max(1, len(places) // _MAX_PLACES)]) if len(places) else None


def _is_near(places: Floats, instances: cKDTree | None, within: float) -> bool:
    """Return whether one of (n, 3) places is near an instance; so they are if there is no other."""
    if instances is None:
        return True
    away, _ = instances.query(places, distance_upper_bound=within)
    return bool(np.isfinite(away).any())


def add_volumes(
    ground: Ground,
    table: InstanceTable,
    records: InstanceRecords,
    measured: NDArray[np.bool_],
    sure: float,
) -> tuple[InstanceTable, InstanceRecords]:
    """Return the instances with a volume for each solid that no mask shows with certainty.

    A volume with a low score that lies in the solid gets its outline.

    Parameters
    ----------
    ground : of the measured part of the mesh.
    measured : (F,) bool, whether a triangle of the whole mesh is measured.
    sure : volumes with at least this score are certain.
    """
    if VOLUME not in records.labels:
        return table, records
    rows = {record.id: record for record in records.instances}
    own = {number for number, record in rows.items() if record.kind == VOLUME}
    low = {number for number in own if rows[number].score < sure}
    label = table.face_instance[measured]
    areas = ground.mesh.areas
    size = np.bincount(label, areas, max(rows, default=0) + 1)
    labels, scores = table.face_instance.copy(), table.face_score.copy()
    faces = np.flatnonzero(measured)
    solids = find_solids(ground, label, own - low, low)
    for solid in solids:
        inside = np.bincount(label[solid], areas[solid], len(size))
        within = [number for number in low if inside[number] > size[number] / 2 > 0]
        number = max(within, key=lambda one: float(size[one]), default=max(rows, default=0) + 1)
        new = InstanceRecord.without_masks(number, records.labels[VOLUME], VOLUME)
        labels[labels == number] = 0
        labels[faces[solid]], scores[faces[solid]] = number, EVIDENCE
        rows[number] = replace(rows.get(number, new), evidence=EVIDENCE)
    if not solids:
        return table, records
    counts = np.bincount(labels, minlength=max(rows) + 1)
    found = [replace(row, faces=int(counts[number])) for number, row in rows.items()]
    kept = tuple(row for row in found if row.faces)
    return InstanceTable(labels, scores), replace(records, instances=kept)
