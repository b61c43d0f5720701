"""Decide which triangles of a wall a partial rescan replaces, by the rays of its photos.

A new photo sees the place of an old triangle if no new surface is in front of it: the triangle is
still there, or the photo looks through where it was (a removed volume). The new mesh must have a
surface at that pixel, so that no hole appears where the new photos gave none. A place that is
hidden closely behind a new surface (a new hold or volume) is photographed, too: the new surface is
added there. The old wall behind it stays, because from the side it may be visible.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, View

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Labels = NDArray[np.int32]

MIN_PHOTOS: Final = 2  # stereo needs as many
BORDER: Final = 0.02  # share of a photo's side without counting, as detections are cut there
# Metres. The old surface may lie this far behind the new one; more is hidden by it, up to the depth
# of the largest volumes.
BEHIND: Final = 0.03
DEEPEST: Final = 0.6
# Triangles that no photo sees (undercuts, backs of holds) are filled up to this distance.
CLOSING: Final = 0.10
MIN_PHOTOGRAPHED: Final = 0.9  # share of an old instance that the photos must show, for it to go
MARGIN: Final = 0.05  # the replaced region ends this far inside of what the photos see
OVERLAP: Final = 0.02  # the new wall reaches this far over the old one, so that the seam has no gap
RIM: Final = 0.01  # the same over a hold that stays inside the region
_AROUND: Final = 12  # triangles whose plane stands for the surface
_SIDE: Final = 1200  # pixels, longer side of the rendered photos


@dataclass(frozen=True, eq=False)
class Region:
    """The triangles that a partial rescan keeps from the old wall and adds from the new one.

    Parameters
    ----------
    old : (F_old,) bool, triangles that stay; new : (F_new,) bool, triangles that are added.
    new_labels : (F_new,) int32, instance of each new triangle; 0 for instances that are not added.
    held : ids of old instances that were photographed and stay, as they are not exchanged.
    ignored : ids of new instances in the photographed area that are not added.
    """

    old: Flags
    new: Flags
    new_labels: Labels
    held: frozenset[int] = frozenset()
    ignored: frozenset[int] = frozenset()


@dataclass(frozen=True)
class Exchange:
    """The instances that a partial rescan exchanges.

    Parameters
    ----------
    old : ids of old instances that may go; new : ids of new instances that may be added.
    """

    old: frozenset[int]
    new: frozenset[int]


def replaced_region(
    old: Mesh,
    old_labels: Labels,
    new: Mesh,
    new_labels: Labels,
    views: Sequence[View],
    unit: float = 1.0,
    exchange: Exchange | None = None,
) -> Region:
    """Return the triangles of both meshes that form the wall after a partial rescan.

    Parameters
    ----------
    old, new : meshes in one frame.
    old_labels, new_labels : (F,) int32, instance of each triangle, 0 = wall. An old instance goes
        as a whole if nearly all of it was photographed; a new one is added as a whole if most of
        its place was.
    views : the new photos, without masks.
    unit : scan units per metre.
    exchange : the instances to exchange; None: all.
    """
    seen, hidden, bare = seen_places(old.centroids, new, views, unit)
    closed = _points_within(old.centroids, seen, CLOSING * unit)
    inside = _without_margin(old.centroids, closed | hidden, unit)
    photographed = whole_instances(old_labels, inside & ~bare, MIN_PHOTOGRAPHED)
    is_held, wanted = np.zeros_like(photographed), new_labels
    if exchange is not None:
        is_held = photographed & (old_labels > 0) & ~np.isin(old_labels, list(exchange.old))
        wanted = np.where(np.isin(new_labels, list(exchange.new)), new_labels, 0).astype(np.int32)
    exchanged = photographed & ~is_held
    gone = exchanged & ((old_labels > 0) | closed)
    if not gone.any():
        return Region(~gone, np.zeros(len(new.faces), dtype=np.bool_), np.zeros_like(new_labels))
    from scipy.spatial import cKDTree

    _, nearest = cKDTree(old.centroids).query(new.centroids, workers=2)
    added = whole_instances(wanted, exchanged[nearest], 0.5)
    labels = np.where(added, wanted, 0).astype(np.int32)
    away, _ = cKDTree(old.centroids[gone]).query(new.centroids, workers=2)
    reach = np.where(is_held[nearest], RIM, OVERLAP) * unit
    inside_new = whole_instances(new_labels, photographed[nearest], 0.5)
    return Region(
        ~gone,
        added | (away <= reach),
        labels,
        _ids(old_labels[is_held]),
        _ids(new_labels[inside_new]) - _ids(labels),
    )


def _ids(labels: Labels) -> frozenset[int]:
    return frozenset(np.unique(labels).tolist()) - {0}


def seen_places(
    points: Floats, mesh: Mesh, views: Sequence[View], unit: float = 1.0
) -> tuple[Flags, Flags, Flags]:
    """Return which places at least `MIN_PHOTOS` photos see, and what is there instead elsewhere.

    Parameters
    ----------
    points : (n, 3) world; mesh : the surface that hides them.

    Returns
    -------
    (n,) seen: no surface is more than `BEHIND` in front, and there is a surface; (n,) hidden: a
    surface is in front by at most `DEEPEST`; (n,) bare: photos show the place, the mesh has no
    surface there.
    """
    from walltopo.geometry.zbuffer import render_ids

    counts = np.zeros((3, len(points)), dtype=np.int32)
    for view in views:
        camera = view.camera
        camera = camera.scaled(min(1.0, _SIDE / max(camera.width, camera.height)))
        _, depth = render_ids(mesh.vertices, mesh.faces, camera, view.cam_from_world)
        local = view.to_camera(points)
        pixels = camera.project(local)  # NaN behind the camera; comparisons with NaN are False
        size = np.array([camera.width, camera.height])
        inside = ((pixels > BORDER * size) & (pixels < (1 - BORDER) * size)).all(axis=1)
        column, row = pixels[inside].astype(np.int64).T
        surface = depth[row, column]
        behind = local[inside, 2] - surface  # -inf without a surface
        counts[0, inside] += np.isfinite(surface) & (behind < BEHIND * unit)
        counts[1, inside] += (behind >= BEHIND * unit) & (behind < DEEPEST * unit)
        counts[2, inside] += ~np.isfinite(surface)
    seen, hidden, bare = counts >= MIN_PHOTOS
    return seen, hidden & ~seen, bare & ~seen & ~hidden


def whole_instances(labels: Labels, chosen: Flags, share: float) -> Flags:
    """Return the chosen triangles, each instance as a whole if more than a share of it is
    chosen."""
    size = int(labels.max(initial=0)) + 1
    total = np.bincount(labels, minlength=size)
    part = np.bincount(labels, chosen, minlength=size)
    whole = part > share * total
    return np.asarray(np.where(labels > 0, whole[labels], chosen))


def _points_within(points: Floats, chosen: Flags, distance: float) -> Flags:
    """Return (n,) whether each point is within a distance of a chosen one."""
    if not chosen.any():
        return chosen
    from scipy.spatial import cKDTree

    away, _ = cKDTree(points[chosen]).query(points, workers=2)
    return np.asarray(away <= distance)


def _without_margin(points: Floats, grown: Flags, unit: float) -> Flags:
    """Return the grown region without a border as wide as `CLOSING` and `MARGIN` together."""
    return grown & ~_points_within(points, ~grown, (CLOSING + MARGIN) * unit)


def seam_offsets(
    old: Mesh, old_labels: Labels, new: Mesh, region: Region, unit: float = 1.0
) -> Floats:
    """Return (n,) distances between old and new wall where they overlap along the seam.

    Holds and guessed triangles are left out. At each added triangle with enough old triangles
    around it, the distance from the plane through these: single triangles are noisier than the
    surface.
    """
    from scipy.spatial import cKDTree

    stays = np.flatnonzero(region.old & (old_labels == 0) & old.measured)
    added = region.new & (region.new_labels == 0) & new.measured
    if len(stays) < _AROUND or not added.any():
        return np.zeros(0)
    points = new.centroids[added]
    away, near = cKDTree(old.centroids[stays]).query(points, k=_AROUND, workers=2)
    overlap = (away[:, 0] <= OVERLAP * unit) & (away[:, -1] <= 3 * OVERLAP * unit)
    around = old.centroids[stays[near[overlap]]]
    middle = around.mean(axis=1)
    _, _, axes = np.linalg.svd(around - middle[:, None], full_matrices=False)
    return np.asarray(np.abs(((points[overlap] - middle) * axes[:, 2]).sum(axis=1)))
