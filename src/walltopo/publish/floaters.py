"""What of the surface is no wall: kept in `wall.glb`, left out of the page.

Pieces that hang in the air, and ragged slabs beside the wall: surface at the outline that fewer
than three photos see, as the report counts them (`report/coverage.py`), and that does not lie in
the plane of the wall next to it. What is as near to a hold on such a slab as holds of this wall lie
apart stays, and so does all inside the wall: a hole there stays as small as it is.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from contextlib import suppress
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Mesh, View
from walltopo.core.files import atomic_path
from walltopo.core.parallel import cores
from walltopo.geometry.neighbours import face_neighbours, patches
from walltopo.geometry.topology import vertex_parts
from walltopo.publish.meshopt import available
from walltopo.publish.report.coverage import THIN, count_views
from walltopo.publish.surface import simplify, split_at_borders
from walltopo.publish.wall_data import Wall, keep_faces
from walltopo.scans.arrays import read_arrays

# Of the whole surface. A volume that stands apart from its wall is a hold and stays in any case.
LEAST_SHARE = 0.01
# Where so much of the surface is seen by few photos, that tells nothing of what is beside the wall.
MOST_THIN = 0.5
# Triangles on which views are counted: as fine as the report's, whatever the mesh has.
COUNTED = 60_000
# So many of those, next to a triangle, say where the wall's plane is; what leans and rises from it
# by no more than this goes on with it. Set by eye, on `spraywall`.
NEAREST = 64
LEVEL = np.radians(25.0)

Bools = NDArray[np.bool_]
Labels = NDArray[np.int32]


class Hidden:
    """Which triangles of a wall its page leaves out.

    Parameters
    ----------
    cache : file where what photos see is kept for this mesh; None: nowhere.
    """

    def __init__(self, wall: Wall, cache: Path | None = None) -> None:
        self._mesh = wall.mesh
        self._views = wall.views
        self._cache = cache

    def of(self, labels: Labels) -> Bools:
        """(F,) bool: slabs and pieces without a hold, as these labels say."""
        cut = self._slabs(labels)
        rest = np.flatnonzero(~cut)
        cut[rest[_loose(self._mesh, rest, labels)]] = True
        return cut

    def without(self, wall: Wall) -> Wall:
        """The wall as the page shows it; the same object where nothing is left out."""
        cut = self.of(wall.face_instance)
        return keep_faces(wall, ~cut, {hold.id for hold in wall.holds}) if cut.any() else wall

    def _slabs(self, labels: Labels) -> Bools:
        """(F,) bool: patches of thinly seen surface that reach the outline, but for the
        surroundings of holds on them.
        """
        areas, thin = self._mesh.areas, self._thin
        if not thin.any() or areas[thin].sum() > MOST_THIN * areas.sum():
            return np.zeros(len(areas), dtype=bool)
        thin = thin & (labels == 0) & ~self._around(self._holds_on_it(labels), labels)
        thin &= ~self._goes_on(thin, labels)
        patch, _ = patches(self._beside, thin.astype(np.int32))
        reaching = np.bincount(patch, thin & self._at_outline) > 0
        return np.asarray(thin & reaching[patch])

    def _holds_on_it(self, labels: Labels) -> NDArray[np.int64]:
        """Holds that few photos see most of: others have an underside at most that few see."""
        areas, numbers = self._mesh.areas, np.maximum(labels, 0)
        hidden, whole = np.bincount(numbers, areas * self._thin), np.bincount(numbers, areas)
        found = np.flatnonzero(hidden > 0.5 * whole)
        return found[found > 0]

    def _around(self, holds: NDArray[np.int64], labels: Labels) -> Bools:
        """(F,) bool: triangles as near to one of these holds as holds of this wall lie apart."""
        from scipy.spatial import cKDTree

        near = np.zeros(len(labels), dtype=bool)
        if len(holds) == 0:
            return near
        all_holds = np.unique(labels[labels > 0])
        rows = [np.flatnonzero(labels == number) for number in all_holds]
        places = np.array([self._mesh.centroids[row].mean(axis=0) for row in rows])
        if len(places) < 2:
            return ~near
        apart, _ = cKDTree(places).query(places, k=2)
        tree = cKDTree(self._mesh.centroids[np.isin(labels, holds)])
        thin = np.flatnonzero(self._thin)
        away, _ = tree.query(self._mesh.centroids[thin])
        near[thin] = away <= np.median(apart[:, 1])
        return near

    def _goes_on(self, thin: Bools, labels: Labels) -> Bools:
        """(F,) bool: of thinly seen triangles those that lie in the plane of the well-seen wall
        nearest to them: its own edge, and no slab beside it.
        """
        from scipy.spatial import cKDTree

        found = np.zeros(len(thin), dtype=bool)
        wall = np.flatnonzero(~self._thin & (labels == 0))
        rows = np.flatnonzero(thin)
        if len(wall) < NEAREST or len(rows) == 0:
            return found
        wall = wall[:: max(1, len(wall) // COUNTED)]
        centres, normals = self._mesh.centroids, self._mesh.normals
        _, near = cKDTree(centres[wall]).query(centres[rows], k=NEAREST, workers=cores())
        plane = normals[wall][near].mean(axis=1)
        plane /= np.maximum(np.linalg.norm(plane, axis=1, keepdims=True), 1e-9)
        away = centres[rows] - centres[wall][near].mean(axis=1)
        rise = np.abs((away * plane).sum(axis=1))
        level = rise <= np.sin(LEVEL) * np.linalg.norm(away, axis=1)
        found[rows] = level & ((normals[rows] * plane).sum(axis=1) >= np.cos(LEVEL))
        return found

    @cached_property
    def _beside(self) -> NDArray[np.int32]:
        return face_neighbours(self._mesh.faces)

    @cached_property
    def _at_outline(self) -> Bools:
        outline = outline_vertices(self._mesh, self._beside)
        return np.asarray(outline[self._mesh.faces].any(axis=1))

    @cached_property
    def _thin(self) -> Bools:
        if len(self._views) <= THIN:
            return np.zeros(len(self._mesh.faces), dtype=bool)
        if self._cache is None:
            return thin_faces(self._mesh, self._views)
        digest = hashlib.blake2b(self._mesh.vertices.tobytes(), digest_size=16)
        digest.update(self._mesh.faces.tobytes())
        for view in self._views:
            digest.update(repr(view.camera).encode() + view.cam_from_world.tobytes())
        key = np.frombuffer(digest.digest(), dtype=np.uint8)
        with suppress(InputError):  # a cache: what cannot be read is made again
            thin, made_of = read_arrays(self._cache, "thin", "key")
            if made_of.tobytes() == key.tobytes() and thin.shape == (len(self._mesh.faces),):
                return thin.astype(bool)
        found = thin_faces(self._mesh, self._views)
        self._cache.parent.mkdir(parents=True, exist_ok=True)
        with atomic_path(self._cache) as temporary, temporary.open("wb") as stream:
            np.savez_compressed(stream, thin=found, key=key)
        return found


def thin_faces(mesh: Mesh, views: Sequence[View]) -> Bools:
    """(F,) bool: triangles that fewer than `THIN` photos see.

    Counted on a coarser surface where there is a simplifier: each triangle as the nearest of it.
    """
    from scipy.spatial import cKDTree

    coarse = mesh
    if available() and len(mesh.faces) > COUNTED:
        plain = np.zeros(len(mesh.faces), dtype=np.int32)
        coarse = simplify(split_at_borders(mesh, plain), COUNTED).mesh
    thin = count_views(coarse, views) < THIN
    if coarse is mesh:
        return thin
    _, nearest = cKDTree(coarse.centroids).query(mesh.centroids, workers=cores())
    return np.asarray(thin[nearest])


def outline_vertices(mesh: Mesh, beside: NDArray[np.int32]) -> Bools:
    """(V,) bool: the outer border of each connected piece, the one that reaches farthest.

    Parameters
    ----------
    beside : (F, 3) int32, the face across each edge, -1 at the border (`face_neighbours`).
    """
    face, corner = np.nonzero(beside < 0)
    start, end = mesh.faces[face, corner], mesh.faces[face, (corner + 1) % 3]
    found = np.zeros(len(mesh.vertices), dtype=bool)
    if len(start) == 0:
        return found
    loops = vertex_parts(np.column_stack([start, end, end]), len(found))
    piece = vertex_parts(mesh.faces, len(found))
    vertices = np.unique(start)
    names, loop = np.unique(loops[vertices], return_inverse=True)
    low = np.full((len(names), 3), np.inf)
    high = -low
    np.minimum.at(low, loop, mesh.vertices[vertices])
    np.maximum.at(high, loop, mesh.vertices[vertices])
    reach = np.linalg.norm(high - low, axis=1)
    of_piece = np.zeros(len(names), dtype=np.int64)
    of_piece[loop] = piece[vertices]
    order = np.lexsort([reach, of_piece])
    last = np.append(np.diff(of_piece[order]) > 0, True)
    outer = np.zeros(len(names), dtype=bool)
    outer[order[last]] = True
    found[vertices[outer[loop]]] = True
    return found


def _loose(mesh: Mesh, rows: NDArray[np.int64], labels: Labels) -> Bools:
    """(n,) bool: of these triangles those of small connected pieces without a hold."""
    faces = mesh.faces[rows]
    piece = vertex_parts(faces, len(mesh.vertices))[faces[:, 0]]
    area = np.bincount(piece, mesh.areas[rows])
    small = area < LEAST_SHARE * area.sum()
    held = np.bincount(piece, labels[rows] > 0) > 0
    return np.asarray((small & ~held)[piece])
