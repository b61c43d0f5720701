"""Find floaters: surface that is no wall; `wall.glb` keeps it and the page omits it.

Floaters are disconnected pieces, and ragged slabs beside the wall: low-coverage surface at the
outline (seen by fewer than three photos, `coverage.py`) outside the plane of the adjacent wall.
Surface near a hold on such a slab stays, and so does all surface inside the outline.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.core.instances import triangles_of
from walltopo.core.parallel import available_cores
from walltopo.geometry.topology import face_neighbours, patches, vertex_components
from walltopo.publish.coverage import MAX_COUNTED, MIN_PHOTOS
from walltopo.publish.wall_data import WallModel, keep_faces

# Maximum share of the whole surface of a floating piece. A volume apart from its wall is a hold and
# always stays.
MAX_PIECE_SHARE = 0.01
# Above this share of low-coverage surface, coverage cannot tell slabs from the wall.
MAX_LOW_COVERAGE = 0.5
# Number of well-covered triangles next to a triangle that define the wall's plane, and the maximum
# angle and slope of a continuation of that plane. Set by eye, on `spraywall`.
NEAREST = 64
LEVEL = np.radians(25.0)

Bools = NDArray[np.bool_]
Labels = NDArray[np.int32]


class Floaters:
    """Decides which triangles of a wall the page omits.

    Parameters
    ----------
    coverage : (F,) number of photos that see each triangle; ignored with few photos.
    """

    def __init__(self, wall: WallModel, coverage: NDArray[np.int32]) -> None:
        self._mesh = wall.mesh
        self._low_coverage = (coverage < MIN_PHOTOS) & (len(wall.views) > MIN_PHOTOS)

    def of(self, labels: Labels) -> Bools:
        """Return (F,) whether a triangle is on a slab or piece without a hold in these labels."""
        cut = self._slabs(labels)
        rest = np.flatnonzero(~cut)
        cut[rest[_small_pieces(self._mesh, rest, labels)]] = True
        return cut

    def without(self, wall: WallModel) -> WallModel:
        """Return the wall as the page shows it; the same object if nothing is omitted."""
        cut = self.of(wall.face_instance)
        return keep_faces(wall, ~cut, np.unique(wall.face_instance)) if cut.any() else wall

    def _slabs(self, labels: Labels) -> Bools:
        """Return (F,) the slabs: low-coverage patches that reach the outline.

        Surroundings of holds on slabs are excluded.
        """
        areas, low = self._mesh.areas, self._low_coverage
        if not low.any() or areas[low].sum() > MAX_LOW_COVERAGE * areas.sum():
            return np.zeros(len(areas), dtype=bool)
        low = low & (labels == 0) & ~self._around(self._low_coverage_holds(labels), labels)
        low &= ~self._continues_wall(low, labels)
        patch, _ = patches(self._beside, low.astype(np.int32))
        reaching = np.bincount(patch, low & self._at_outline) > 0
        return np.asarray(low & reaching[patch])

    def _low_coverage_holds(self, labels: Labels) -> NDArray[np.int64]:
        """Return the holds with mostly low coverage; other holds have it at most below."""
        areas, numbers = self._mesh.areas, np.maximum(labels, 0)
        hidden, whole = (
            np.bincount(numbers, areas * self._low_coverage),
            np.bincount(numbers, areas),
        )
        found = np.flatnonzero(hidden > 0.5 * whole)
        return found[found > 0]

    def _around(self, holds: NDArray[np.int64], labels: Labels) -> Bools:
        """Return (F,) the low-coverage triangles near these holds, by the spacing of holds."""
        from scipy.spatial import cKDTree

        near = np.zeros(len(labels), dtype=bool)
        if len(holds) == 0:
            return near
        all_holds = np.unique(labels[labels > 0])
        own = [rows for _, rows in triangles_of(labels, all_holds)]
        places = np.array([self._mesh.centroids[rows].mean(axis=0) for rows in own])
        if len(places) < 2:
            return ~near
        apart, _ = cKDTree(places).query(places, k=2)
        tree = cKDTree(self._mesh.centroids[np.isin(labels, holds)])
        low = np.flatnonzero(self._low_coverage)
        away, _ = tree.query(self._mesh.centroids[low])
        near[low] = away <= np.median(apart[:, 1])
        return near

    def _continues_wall(self, low: Bools, labels: Labels) -> Bools:
        """Return (F,) the low-coverage triangles in the plane of the nearest well-covered wall.

        They are the wall's own edge, not a slab beside it.
        """
        from scipy.spatial import cKDTree

        found = np.zeros(len(low), dtype=bool)
        wall = np.flatnonzero(~self._low_coverage & (labels == 0))
        rows = np.flatnonzero(low)
        if len(wall) < NEAREST or len(rows) == 0:
            return found
        wall = wall[:: max(1, len(wall) // MAX_COUNTED)]
        centres, normals = self._mesh.centroids, self._mesh.normals
        tree = cKDTree(centres[wall])
        for part in np.array_split(rows, 1 + len(rows) // MAX_COUNTED):
            _, near = tree.query(centres[part], k=NEAREST, workers=available_cores())
            plane = normals[wall][near].mean(axis=1)
            plane /= np.maximum(np.linalg.norm(plane, axis=1, keepdims=True), 1e-9)
            away = centres[part] - centres[wall][near].mean(axis=1)
            rise = np.abs((away * plane).sum(axis=1))
            level = rise <= np.sin(LEVEL) * np.linalg.norm(away, axis=1)
            found[part] = level & ((normals[part] * plane).sum(axis=1) >= np.cos(LEVEL))
        return found

    @cached_property
    def _beside(self) -> NDArray[np.int32]:
        return face_neighbours(self._mesh.faces)

    @cached_property
    def _at_outline(self) -> Bools:
        outline = outline_vertices(self._mesh, self._beside)
        return np.asarray(outline[self._mesh.faces].any(axis=1))


def outline_vertices(mesh: Mesh, beside: NDArray[np.int32]) -> Bools:
    """Return (V,) the vertices of each connected component's largest boundary loop.

    Parameters
    ----------
    beside : (F, 3) int32, the face across each edge, -1 at the border (`face_neighbours`).
    """
    face, corner = np.nonzero(beside < 0)
    start, end = mesh.faces[face, corner], mesh.faces[face, (corner + 1) % 3]
    found = np.zeros(len(mesh.vertices), dtype=bool)
    if len(start) == 0:
        return found
    loops = vertex_components(np.column_stack([start, end, end]), len(found))
    piece = vertex_components(mesh.faces, len(found))
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


def _small_pieces(mesh: Mesh, rows: NDArray[np.int64], labels: Labels) -> Bools:
    """Return (n,) which of these triangles belong to small components without a hold."""
    faces = mesh.faces[rows]
    piece = vertex_components(faces, len(mesh.vertices))[faces[:, 0]]
    area = np.bincount(piece, mesh.areas[rows])
    small = area < MAX_PIECE_SHARE * area.sum()
    held = np.bincount(piece, labels[rows] > 0) > 0
    return np.asarray((small & ~held)[piece])
