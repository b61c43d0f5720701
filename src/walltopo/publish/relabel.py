"""A tier whose labels changed here and there: relabelled, not made anew.

Simplified triangles are larger than those that a setter's edits are about. So around the places
that changed they are halved, without moving the surface or its texture, until they are as small as
the mesh's own; then each takes the label of the mesh's triangle that is nearest to it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.geometry.subdivision import halved
from walltopo.publish.surface import Surface

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
Labels = NDArray[np.int32]

FINE = 1.5  # times the mesh's usual edge: triangles so small are not halved
AROUND = 2.0  # times that edge: triangles so near to a change are looked at


def relabelled(surface: Surface, mesh: Mesh, before: Labels, after: Labels) -> Surface:
    """The surface with the labels `after`, where it was made with `before`.

    Parameters
    ----------
    mesh : that the surface was made from; before, after : (F,) int32 labels of its triangles.
    """
    from scipy.spatial import cKDTree

    rows = np.flatnonzero(before != after)
    if len(rows) == 0:
        return surface
    edge = _usual_edge(mesh, rows)
    change = _Change(cKDTree(mesh.centroids[rows]), edge)
    near = change.beside(surface)
    part = surface.triangles[near]
    if len(surface.triangles) < len(mesh.faces):
        surface, part = _refined(surface, part, change)
    looked = np.flatnonzero(change.near(surface.positions[part].astype(np.float64)))
    feature = surface.feature[part[:, 0]]
    corners = surface.positions[part[looked]].astype(np.float64)
    nearest = _nearest(mesh, corners.mean(axis=1), change)
    changed = np.isin(nearest, rows)
    feature[looked[changed]] = after[nearest[changed]]
    return _with_features(surface, surface.triangles[~near], part, feature)


@dataclass(frozen=True, eq=False)
class _Change:
    """Where labels changed.

    Parameters
    ----------
    tree : of the centroids of the mesh's changed triangles; edge : usual edge of the mesh there.
    """

    tree: Any
    edge: float

    def near(self, corners: Floats, more: float = 0.0) -> NDArray[np.bool_]:
        """(T,) triangles of (T, 3, 3) corners that may touch a change, or are `more` away."""
        middle = corners.mean(axis=1)
        radius = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1)
        reach = radius + AROUND * self.edge + more
        away, _ = self.tree.query(middle, distance_upper_bound=float(reach.max(initial=0.0)))
        return np.asarray(away <= reach)

    def beside(self, surface: Surface) -> NDArray[np.bool_]:
        """(T,) a surface's triangles that may touch a change, and those that have an edge with one.

        What shares an edge with a triangle is not farther from the change than it is wide.
        """
        corners = surface.positions[surface.triangles]
        near = self._in_box(corners, 0.0)
        own = corners[near].astype(np.float64)
        near[near] = self.near(own)
        own = corners[near].astype(np.float64)
        wide = np.linalg.norm(own - np.roll(own, 1, axis=1), axis=2).max(initial=0.0)
        near = self._in_box(corners, 2 * float(wide))
        near[near] = self.near(corners[near].astype(np.float64), 2 * float(wide))
        return near

    def _in_box(self, corners: NDArray[np.float32], more: float) -> NDArray[np.bool_]:
        """(T,) triangles that reach into the box around all that changed."""
        room = AROUND * self.edge + more
        low, high = self.tree.mins - room, self.tree.maxes + room
        return np.asarray(
            ((corners.max(axis=1) >= low) & (corners.min(axis=1) <= high)).all(axis=1)
        )


def _usual_edge(mesh: Mesh, rows: Ints) -> float:
    corners = mesh.vertices[mesh.faces[rows]]
    return float(np.median(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)))


def _nearest(mesh: Mesh, places: Floats, change: _Change) -> Ints:
    """The mesh's triangle nearest to each place."""
    from scipy.spatial import cKDTree

    if len(places) == 0:
        return np.zeros(0, dtype=np.int64)
    low, high = places.min(axis=0) - change.edge, places.max(axis=0) + change.edge
    inside = np.flatnonzero(((mesh.centroids >= low) & (mesh.centroids <= high)).all(axis=1))
    _, index = cKDTree(mesh.centroids[inside]).query(places)
    return inside[index]


def _refined(
    surface: Surface, part: NDArray[np.uint32], change: _Change
) -> tuple[Surface, NDArray[np.uint32]]:
    """Halve the long edges of some triangles near a change, again and again.

    An edge is halved in all its triangles alike, also where vertices at one place are several (a
    seam of the texture, a hold's border): so no crack opens.
    """
    faces = part.astype(np.int32)
    while True:
        used, local = np.unique(faces, return_inverse=True)
        places = np.unique(surface.positions[used], axis=0, return_inverse=True)[1].ravel()
        place = places[local.reshape(-1, 3)]
        corners = surface.positions[faces].astype(np.float64)
        long = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2) > FINE * change.edge
        asked = long & change.near(corners)[:, None]
        start, end = place.ravel(), np.roll(place, -1, axis=1).ravel()
        key = np.minimum(start, end) * (int(places.max(initial=0)) + 1) + np.maximum(start, end)
        halve = np.isin(key, key[asked.ravel()]).reshape(-1, 3)
        if not halve.any():
            return surface, faces.astype(np.uint32)
        surface, middle = _with_middles(surface, faces, halve)
        faces = halved(faces, middle)


def _with_middles(
    surface: Surface, faces: NDArray[np.int32], halve: NDArray[np.bool_]
) -> tuple[Surface, Ints]:
    """The surface with vertices in the middle of some edges, and (T, 3) which these are."""
    pairs = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1)[halve], axis=1)
    unique, index = np.unique(pairs, axis=0, return_inverse=True)
    middle = np.full(faces.shape, -1, dtype=np.int64)
    middle[halve] = len(surface.positions) + index.ravel()
    one, two = unique.T

    def mean(values: NDArray[Any]) -> NDArray[Any]:
        both = (values[one].astype(np.float64) + values[two]) / 2
        return np.concatenate([values, both.astype(values.dtype)])

    normals = mean(surface.normals)
    length = np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
    grown = Surface(
        positions=mean(surface.positions),
        triangles=surface.triangles,
        feature=np.concatenate([surface.feature, surface.feature[one]]),
        normals=(normals / length).astype(np.float32),
        uv=None if surface.uv is None else mean(surface.uv),
        colours=None if surface.colours is None else mean(surface.colours),
        # Both ends of an edge are guessed, or neither is.
        guessed=None
        if surface.guessed is None
        else np.concatenate([surface.guessed, surface.guessed[one]]),
    )
    return grown, middle


def _with_features(
    surface: Surface, kept: NDArray[np.uint32], part: NDArray[np.uint32], labels: Labels
) -> Surface:
    """Triangles that stay, and some with one label each: a vertex at a border becomes several.

    Parameters
    ----------
    kept : (K, 3); part : (T, 3); labels : (T,) of the latter.
    """
    wanted = np.repeat(labels, 3)
    corner = part.ravel().astype(np.int64)
    # A vertex with the label that it has stays; with another one it becomes a new one.
    other = surface.feature[corner] != wanted
    key = corner[other] * (int(labels.max(initial=0)) + 1) + wanted[other]
    _, first, inverse = np.unique(key, return_index=True, return_inverse=True)
    source = corner[other][first]
    corner[other] = len(surface.positions) + inverse.ravel()

    def grown(values: NDArray[Any]) -> NDArray[Any]:
        return np.concatenate([values, values[source]])

    return Surface(
        positions=grown(surface.positions),
        triangles=np.concatenate([kept, corner.reshape(-1, 3).astype(np.uint32)]),
        feature=np.concatenate([surface.feature, wanted[other][first]]).astype(np.int32),
        normals=grown(surface.normals),
        uv=None if surface.uv is None else grown(surface.uv),
        colours=None if surface.colours is None else grown(surface.colours),
        guessed=None if surface.guessed is None else grown(surface.guessed),
    )
