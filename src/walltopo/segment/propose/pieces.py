"""Pieces of surface that may be holds: instances of the lift, and bumps on the wall's panels."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from walltopo.core import Mesh
from walltopo.core.instances import triangles_of
from walltopo.geometry.panels import NO_PANEL, Heights, Panel, find_panels, heights_over
from walltopo.geometry.topology import face_neighbours, patches
from walltopo.scans.detections import Detections
from walltopo.scans.instances import InstanceRecord
from walltopo.segment.propose.evidence import CUES, Masks, PhotoView, Tint, cues_of, tints
from walltopo.segment.propose.surroundings import Relief, Surroundings

Floats = NDArray[np.float64]
Labels = NDArray[np.int32]

FLOOR = 0.85  # upward part of the normal of floors, mats and tops
NEARBY = 1.0  # metres: radius in which other holds are counted
INSIDE = 0.5  # a low-score instance belongs to a bump if at least this share of it lies inside
# Share of a bump that low-score instances cover. An instance below the first lies on the bump
# without being it; at the second or more, the instances are the whole bump.
SPECK, COVERED = 0.1, 0.4


@dataclass(frozen=True, eq=False)
class Pieces:
    """All pieces that may be holds.

    Parameters
    ----------
    label : (F,) int32, the piece of each measured triangle, 0 = wall.
    ids : ids of the pieces, ascending.
    new : ids of pieces to which no mask was lifted.
    joined : ids of instances whose triangles a bump replaced, each with the instances merged
        into it.
    relief, masks, tint : of each piece, by id.
    """

    label: Labels
    ids: tuple[int, ...]
    new: frozenset[int]
    joined: Mapping[int, tuple[int, ...]]
    relief: Mapping[int, Relief]
    masks: Mapping[int, Masks]
    tint: Mapping[int, Tint]

    def cues(self) -> Floats:
        """Return the (n, len(CUES)) cues of the pieces, in the order of `ids`."""
        rows = [cues_of(self.relief[k], self.masks[k], self.tint[k]) for k in self.ids]
        return np.array(rows).reshape(-1, len(CUES))


def masks_of(records: Sequence[InstanceRecord], found: Detections) -> dict[int, Masks]:
    """Return the masks of each instance of the lift."""
    masks_by_id = {}
    for record in records:
        scores = [found.masks[photo][mask].score for photo, mask in record.views]
        masks_by_id[record.id] = Masks(record.score, max(scores, default=0.0), len(scores))
    return masks_by_id


def merge_bumps(
    label: Labels, bumps: Sequence[NDArray[np.int64]], areas: Floats, low_score: frozenset[int]
) -> tuple[Labels, set[int], dict[int, tuple[int, ...]]]:
    """Merge bumps into the labels of instances.

    Low-score instances that lie in a bump and cover a good part of it keep their outline, and the
    bump is dropped. Instances that cover little of the bump are replaced by it; it gets the id of
    the one that covers most. Triangles of other instances keep their label.

    Parameters
    ----------
    label : (F,) int32, 0 = none; areas : (F,).
    low_score : ids of instances with a low score.

    Returns
    -------
    (F,) int32 labels; ids of new pieces; ids of instances that a bump replaced, each with the
    instances merged into it.
    """
    label = label.copy()
    size = np.bincount(label, areas, minlength=int(label.max(initial=0)) + 1)
    new: set[int] = set()
    joined: dict[int, tuple[int, ...]] = {}
    following = len(size)
    for rows in bumps:
        whole = float(areas[rows].sum())
        shared = np.bincount(label[rows], areas[rows], minlength=len(size))[: len(size)]
        inside = [
            number
            for number in np.flatnonzero(shared).tolist()
            if number in low_score and shared[number] >= max(INSIDE * size[number], SPECK * whole)
        ]
        if sum(shared[inside]) >= COVERED * whole:
            continue
        free = rows[np.isin(label[rows], [0, *inside])]
        if inside:
            number = max(inside, key=lambda one: (float(shared[one]), -one))
            joined[number] = tuple(one for one in inside if one != number)
            label[np.isin(label, inside)] = 0
        else:
            number, following = following, following + 1
            new.add(number)
        label[free] = number
    return label, new, joined


def _combine_masks(masks_by_id: Mapping[int, Masks], number: int, others: Sequence[int]) -> Masks:
    """Return the combined masks of instances that were merged."""
    rows = [masks_by_id[one] for one in (number, *others) if one in masks_by_id]
    return Masks(
        max((row.support for row in rows), default=0.0),
        max((row.best for row in rows), default=0.0),
        sum(row.count for row in rows),
    )


@dataclass(frozen=True, eq=False)
class Ground:
    """Panels and relief of a mesh, computed before pieces are found.

    Parameters
    ----------
    mesh : the scan's mesh without guessed triangles; unit : mesh units per metre.
    neighbours : (F, 3), see `face_neighbours`; panels, heights : of the wall.
    """

    mesh: Mesh
    unit: float
    neighbours: NDArray[np.int32]
    panels: list[Panel]
    heights: Heights

    @classmethod
    def of(cls, mesh: Mesh, unit: float, level: bool, seed: int) -> Ground:
        """Find the panels of a mesh; `level` means that z is up, so that floors are excluded."""
        upward = mesh.normals[:, 2] > FLOOR if level else np.zeros(len(mesh.faces), dtype=np.bool_)
        panels = find_panels(mesh, np.flatnonzero(~upward), unit, seed=seed)
        heights = heights_over(mesh, panels, unit)
        return cls(mesh, unit, face_neighbours(mesh.faces), panels, heights)


def gather_pieces(
    ground: Ground,
    label: Labels,
    masks_by_id: Mapping[int, Masks],
    min_score: float,
    views: Iterable[PhotoView],
) -> Pieces:
    """Return all pieces of a scan with their cues.

    Parameters
    ----------
    label : (F,) int32, instances of the lift; masks_by_id : of each instance, see `masks_of`.
    min_score : instances with at least this score keep the lift's outline.
    views : the photos.
    """
    mesh, heights, panels = ground.mesh, ground.heights, ground.panels
    confident_ids = [k for k, masks in masks_by_id.items() if masks.support >= min_score]
    confident = np.where(np.isin(label, confident_ids), label, 0).astype(np.int32)
    bumps = find_bumps(mesh, ground.neighbours, heights, panels, confident, ground.unit)
    low_score = frozenset(masks_by_id) - frozenset(confident_ids)
    label, new, joined = merge_bumps(label, bumps, mesh.areas, low_score)
    relief = _piece_reliefs(ground, label, confident_ids)
    out = stands_out(heights, panels, ground.unit)
    wall = (label == 0) & (heights.panel != NO_PANEL) & ~out
    tint = tints(views, label, wall)
    return Pieces(
        label,
        tuple(relief),
        frozenset(new),
        joined,
        relief,
        {k: _combine_masks(masks_by_id, k, joined.get(k, ())) for k in relief},
        {number: tint.get(number, Tint()) for number in relief},
    )


def _piece_reliefs(ground: Ground, label: Labels, confident: Sequence[int]) -> dict[int, Relief]:
    """Return the relief of each piece, by ascending id; `confident` are ids of instances."""
    around = Surroundings(ground.mesh, ground.heights, ground.panels, label, ground.unit)
    rows = dict(triangles_of(label, np.unique(label[label > 0]).tolist()))
    places = {number: ground.mesh.centroids[own].mean(axis=0) for number, own in rows.items()}
    known = np.array([places[number] for number in confident if number in places]).reshape(-1, 3)
    tree = cKDTree(known)
    return {
        number: around.relief(own, _count_nearby(tree, places[number], ground.unit))
        for number, own in rows.items()
    }


def _count_nearby(tree: cKDTree, place: Floats, unit: float) -> int:
    """Return the number of confident instances around a place, without the one at the place."""
    near = tree.query_ball_point(place, NEARBY * unit, return_length=True)
    here = tree.query_ball_point(place, 1e-6 * unit, return_length=True)
    return int(near - here)


Ints = NDArray[np.int64]

LOW, HIGH = 0.005, 0.008  # metres: a bump is higher than the first and its top reaches the second
LOW_NOISE, HIGH_NOISE = 3.0, 5.0  # the same in standard deviations of the panel's noise
TOP = 90.0  # percentile of the heights that counts as the top
MIN_AREA, MAX_AREA = 0.0006, 0.8  # square metres
LONGEST = 1.6  # metres
BESIDE = 0.02  # metres: a piece this close to a confident instance is adjacent to it
REST = 1.5  # a piece smaller than this multiple of its adjacent instances is their remainder


def stands_out(
    heights: Heights, panels: Sequence[Panel], unit: float, low: float = LOW
) -> NDArray[np.bool_]:
    """Return (F,) whether a triangle is more than `low` metres over its panel, above its noise."""
    begins = np.maximum(low * unit, LOW_NOISE * _face_noise(heights, panels))
    with np.errstate(invalid="ignore"):
        return np.asarray((heights.panel != NO_PANEL) & (heights.height > begins))


def _face_noise(heights: Heights, panels: Sequence[Panel]) -> Floats:
    """Return (F,) the noise of the panel under each triangle; inf without a panel."""
    return np.array([panel.noise for panel in panels] + [np.inf])[heights.panel]


def find_bumps(
    mesh: Mesh,
    neighbours: NDArray[np.int32],
    heights: Heights,
    panels: Sequence[Panel],
    confident: Labels,
    unit: float,
) -> list[Ints]:
    """Return the triangles of each bump that may be a hold, the largest first.

    Parameters
    ----------
    mesh : the measured part of the scan's mesh; neighbours : (F, 3), see `face_neighbours`.
    heights, panels : results of `heights_over` and `find_panels`.
    confident : (F,) int32, the confident instance of each triangle, 0 = none.
    unit : mesh units per metre.
    """
    out = stands_out(heights, panels, unit)
    top = np.maximum(HIGH * unit, HIGH_NOISE * _face_noise(heights, panels))
    held = np.flatnonzero(confident)
    size = np.bincount(confident, mesh.areas)
    beside = cKDTree(mesh.centroids[held]) if len(held) else None
    found: list[Ints] = []
    free = out & (confident == 0)
    for piece in components_of_area(mesh, neighbours, free, MIN_AREA * unit**2, MAX_AREA * unit**2):
        places = mesh.centroids[piece]
        if np.ptp(places, axis=0).max() > LONGEST * unit:
            continue
        if np.percentile(heights.height[piece], TOP) < np.median(top[piece]):
            continue
        if beside is not None:
            away, nearest = beside.query(places, distance_upper_bound=BESIDE * unit)
            hosts = np.unique(confident[held[nearest[np.isfinite(away)]]])
            if mesh.areas[piece].sum() < REST * size[hosts].sum():
                continue
        found.append(piece)
    return sorted(found, key=lambda piece: -float(mesh.areas[piece].sum()))


def components_of_area(
    mesh: Mesh, neighbours: NDArray[np.int32], chosen: NDArray[np.bool_], low: float, high: float
) -> list[Ints]:
    """Return the connected components of (F,) chosen triangles with an area between bounds."""
    part, first = patches(neighbours, chosen.astype(np.int32))
    area = np.bincount(part, mesh.areas * chosen, len(first))
    wanted = (area > low) & (area < high)
    rows = np.flatnonzero(chosen & wanted[part])
    order = rows[np.argsort(part[rows], kind="stable")]
    starts = np.flatnonzero(np.diff(part[order], prepend=-1))
    return np.split(order, starts[1:]) if len(order) else []
