"""Find the surroundings of a wall: floor, ceiling, room and furniture, which the page omits.

The surface without its holds is divided into nearly plane regions. A region is climbing wall if it
carries holds about as densely as the others, or if most of its border is climbing wall. Surface
that the wall encloses, such as a volume that nobody found, belongs to it, and so does a hand's
breadth around it and around every hold.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.core.parallel import available_cores
from walltopo.geometry.kernels import kernel
from walltopo.geometry.topology import face_neighbours, patches
from walltopo.publish.coarse_wall import CoarseWall

Bools = NDArray[np.bool_]
Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

HAND = 0.15  # m around wall and holds that stay
# Greatest angle between a triangle and the mean of its region: between the facets of a wall, which
# turn by more, and the waves of a surface that was measured.
ANGLE = np.radians(25.0)
SMOOTHINGS = 2  # rounds in which each triangle's normal becomes the mean of its neighbours'
CRUMB = 4.0  # hands squared; a smaller region is a crease or a part of a hold, and no wall
# A region with more than this many times the area for each hold is no wall: the hold was imagined,
# or it is the last one on the way out.
SPARSE = 8.0
BORDER = 0.5  # share of a region's border that makes it wall
OPEN = 0.1  # greatest share of the mesh's own border around what the wall encloses
FLOOR = np.cos(np.radians(40.0))  # upward part of a floor's normal


def surroundings(wall: CoarseWall, mesh: Mesh, hand: float = HAND) -> Bools:
    """Return (F,) whether a face shows neither the climbing wall nor a hand's breadth around it.

    Without holds everything may be wall, and nothing is found.

    Parameters
    ----------
    wall : the simplified mesh and its holds.
    mesh : F faces, the wall's own mesh.
    hand : a hand's breadth, world units.
    """
    from scipy.spatial import cKDTree

    if not (wall.labels > 0).any():
        return np.zeros(len(mesh.faces), dtype=bool)
    inside = _Regions(wall, hand).climbed()
    found = ~inside[wall.nearest]
    rows = np.flatnonzero(found)
    tree = cKDTree(wall.mesh.centroids[inside])
    away, _ = tree.query(mesh.centroids[rows], distance_upper_bound=hand, workers=available_cores())
    found[rows] = ~np.isfinite(away)
    return found


def hand_of(wall: CoarseWall, metric: bool) -> float:
    """Return a hand's breadth in world units: of a scan without a scale, the size of its holds."""
    if metric:
        return HAND
    areas = np.bincount(np.maximum(wall.labels, 0), wall.mesh.areas)[1:]
    return float(np.sqrt(np.median(areas[areas > 0]))) if areas.any() else HAND


@dataclass(frozen=True, eq=False)
class _Borders:
    """The edges between two triangles, seen from each of them, and those of the mesh's border.

    Parameters
    ----------
    face, other : (e,) the two triangles; length : (e,) of the edge.
    rim, rim_length : (r,) triangle and length of each border edge.
    """

    face: Ints
    other: Ints
    length: Floats
    rim: Ints
    rim_length: Floats


class _Regions:
    """The nearly plane regions of a wall between its holds.

    Parameters
    ----------
    wall, hand : see `surroundings`.
    """

    def __init__(self, wall: CoarseWall, hand: float) -> None:
        self._wall, self._hand = wall, hand
        self._areas = wall.mesh.areas
        self._beside = face_neighbours(wall.mesh.faces)
        normals = _smooth_normals(wall.mesh.normals, self._areas, self._beside)
        bend = np.zeros(len(normals))
        for other in self._beside.T:
            turn = 1.0 - (normals * normals[other]).sum(axis=1)
            bend = np.maximum(bend, np.where(other < 0, 1.0, turn))
        region, count = _grown(
            self._beside,
            normals,
            self._areas,
            np.argsort(bend, kind="stable").astype(np.int32),
            wall.labels > 0,
            np.cos(ANGLE),
        )
        area = self._sums(region, self._areas, count)
        crumb = area < CRUMB * hand**2
        # (c,) region of each triangle; -1: a hold or a crumb.
        self._region = np.where(crumb[region], -1, region)
        self._area = np.where(crumb, 0.0, area)
        up = self._sums(region, self._areas * normals[:, 2], count)
        self._is_floor = up > FLOOR * area

    @staticmethod
    def _sums(region: NDArray[np.integer], values: Floats, count: int) -> Floats:
        """Return the (count,) sums over the triangles of each region."""
        own = region >= 0
        return np.bincount(region[own], values[own], minlength=count).astype(np.float64)

    def climbed(self) -> Bools:
        """Return (c,) whether a triangle is a hold or climbing wall."""
        wall = self._carrying()
        while True:
            inside = self._inside(wall)
            more = self._bordered(inside) & ~wall
            if not more.any():
                return inside | self._enclosed(inside)
            wall |= more

    def _inside(self, wall: Bools) -> Bools:
        """Return (c,) whether a triangle is a hold or in a region that is wall."""
        return (self._wall.labels > 0) | ((self._region >= 0) & wall[self._region])

    def _carrying(self) -> Bools:
        """Return (regions,) which of them carry holds about as densely as the wall does."""
        holds = self._holds()
        several = holds >= min(3, holds.max(initial=0))
        usual = self._area[several].sum() / max(holds[several].sum(), 1)
        return np.asarray((holds > 0) & (self._area <= SPARSE * usual * holds))

    def _holds(self) -> Ints:
        """Return (regions,) the number of holds on each: where most surface beside a hold is."""
        from scipy.spatial import cKDTree

        count = len(self._area)
        centres, labels = self._wall.mesh.centroids, self._wall.labels
        own, held = np.flatnonzero(self._region >= 0), np.flatnonzero(labels > 0)
        if len(own) == 0:
            return np.zeros(count, dtype=np.int64)
        away, nearest = cKDTree(centres[held]).query(centres[own], workers=available_cores())
        near = away <= self._hand
        pair = labels[held[nearest[near]]].astype(np.int64) * count + self._region[own[near]]
        pairs, which = np.unique(pair, return_inverse=True)
        area = np.bincount(which, self._areas[own[near]])
        order = np.lexsort([area, pairs // count])
        last = np.append(np.diff(pairs[order] // count) > 0, True)[: len(order)]
        return np.bincount(pairs[order[last]] % count, minlength=count)

    @cached_property
    def _borders(self) -> _Borders:
        vertices, faces = self._wall.mesh.vertices, self._wall.mesh.faces
        face, corner = np.nonzero(self._beside >= -1)
        ends = vertices[faces[face, corner]] - vertices[faces[face, (corner + 1) % 3]]
        length = np.linalg.norm(ends, axis=1)
        other = self._beside[face, corner].astype(np.int64)
        rim = other < 0
        return _Borders(face[~rim], other[~rim], length[~rim], face[rim], length[rim])

    def _bordered(self, inside: Bools) -> Bools:
        """Return (regions,) which of them, floors aside, have most of their border inside."""
        borders, count = self._borders, len(self._area)
        own = self._region[borders.face]
        crossing = np.where(own != self._region[borders.other], own, -1)
        whole = self._sums(crossing, borders.length, count)
        whole += self._sums(self._region[borders.rim], borders.rim_length, count)
        shared = np.where(inside[borders.other], crossing, -1)
        of_wall = self._sums(shared, borders.length, count)
        return np.asarray((self._area > 0) & ~self._is_floor & (of_wall >= BORDER * whole))

    def _enclosed(self, inside: Bools) -> Bools:
        """Return (c,) the triangles outside of which only the wall is around."""
        borders = self._borders
        patch, _ = patches(self._beside, inside.astype(np.int32))
        count = int(patch.max()) + 1
        crossing = patch[borders.face] != patch[borders.other]
        around = np.bincount(patch[borders.face], borders.length * crossing, minlength=count)
        rim = np.bincount(patch[borders.rim], borders.rim_length, minlength=count)
        return np.asarray(~inside & (rim <= OPEN * (around + rim))[patch])


def _smooth_normals(normals: Floats, areas: Floats, beside: NDArray[np.int32]) -> Floats:
    """Return the (c, 3) normals, each the mean with those of the neighbours."""
    for _ in range(SMOOTHINGS):
        weighted = normals * areas[:, None]
        total = weighted.copy()
        for other in beside.T:
            known = other >= 0
            total[known] += weighted[other[known]]
        normals = total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12)
    return normals


@kernel
def _grown(beside: Any, normals: Any, areas: Any, order: Any, barred: Any, least: Any) -> Any:
    """Return (c,) the region of each triangle, -1 where barred, and the number of regions.

    A region grows from the first free triangle of `order` to neighbours whose normal times its mean
    is at least `least`.
    """
    region = np.full(len(beside), -1, dtype=np.int32)
    queue = np.empty(len(beside), dtype=np.int32)
    count = 0
    for seed in order:
        if region[seed] >= 0 or barred[seed]:
            continue
        region[seed], queue[0] = count, seed
        head, tail = 0, 1
        x, y, z = normals[seed, 0], normals[seed, 1], normals[seed, 2]
        x, y, z = x * areas[seed], y * areas[seed], z * areas[seed]
        while head < tail:
            face = queue[head]
            head += 1
            for k in range(3):
                other = beside[face, k]
                if other < 0 or region[other] >= 0 or barred[other]:
                    continue
                along = normals[other, 0] * x + normals[other, 1] * y + normals[other, 2] * z
                if along < least * np.sqrt(x * x + y * y + z * z):
                    continue
                region[other], queue[tail] = count, other
                tail += 1
                x += normals[other, 0] * areas[other]
                y += normals[other, 1] * areas[other]
                z += normals[other, 2] * areas[other]
        count += 1
    return region, count
