"""How a piece of surface stands against the wall right beside it: height, rim, planes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from walltopo.core import Mesh
from walltopo.meshes.panels import Heights, Panel

__all__ = ["Relief", "Surroundings"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

RING = 0.03  # metres: wall so near to a piece is beside it
BORDER = 0.012  # metres: triangles so near to the wall beside are the rim
TOP = 90.0  # percentile of the heights that counts as the top
PLANES, PLANE_DEG = 5, 9.0  # so many directions of faces a volume has at most, within so much


@dataclass(frozen=True)
class Relief:
    """What one piece looks like without colour.

    Parameters
    ----------
    height : of its top over the wall beside it, metres.
    rim : mean sine of the angle between the surface at its border and the wall: 1 = upright.
    area : square metres; length : longest extent along an axis, metres.
    flatness : share of its area that lies in its `PLANES` most common directions.
    noise : of the panel it is on, metres.
    on_wall : share of its area that lies on a panel at all.
    """

    height: float
    rim: float
    area: float
    length: float
    flatness: float
    noise: float
    on_wall: float


class Surroundings:
    """The wall around pieces of a mesh.

    Parameters
    ----------
    label : (F,) int32, the piece of each triangle, 0 = wall.
    unit : mesh units a metre.
    """

    def __init__(
        self,
        mesh: Mesh,
        heights: Heights,
        panels: list[Panel],
        label: NDArray[np.int32],
        unit: float,
    ) -> None:
        self._mesh, self._heights, self._panels, self._unit = mesh, heights, panels, unit
        self._bare = np.flatnonzero((label == 0) & (heights.panel >= 0))
        self._tree = cKDTree(mesh.centroids[self._bare])

    def beside(self, rows: Ints) -> tuple[Ints, Floats]:
        """Wall triangles near a piece, and how far the wall is from its own (inf: farther)."""
        places = self._mesh.centroids[rows]
        middle = (places.min(axis=0) + places.max(axis=0)) / 2
        reach = float(np.linalg.norm(places - middle, axis=1).max()) + RING * self._unit
        found = sorted(self._tree.query_ball_point(middle, reach))
        near = self._bare[np.array(found, dtype=np.int64)]
        if len(near) == 0:
            return near, np.full(len(rows), np.inf)
        away, _ = cKDTree(places).query(
            self._mesh.centroids[near], distance_upper_bound=RING * self._unit
        )
        near = near[np.isfinite(away)]
        if len(near) == 0:
            return near, np.full(len(rows), np.inf)
        own, _ = cKDTree(self._mesh.centroids[near]).query(
            places, distance_upper_bound=BORDER * self._unit
        )
        return near, own

    def relief(self, rows: Ints) -> Relief:
        """What a piece looks like; `rows` are its triangles."""
        mesh, heights, unit = self._mesh, self._heights, self._unit
        areas = mesh.areas[rows]
        total = max(float(areas.sum()), 1e-12)
        on_wall = heights.panel[rows] >= 0
        near, away = self.beside(rows)
        length = float(np.ptp(mesh.centroids[rows], axis=0).max()) / unit
        flatness = _flatness(mesh.normals[rows], areas)
        if not on_wall.any():
            return Relief(0.0, 0.0, total / unit**2, length, flatness, 1.0, 0.0)
        counts = np.bincount(heights.panel[rows[on_wall]], areas[on_wall])
        panel = self._panels[int(counts.argmax())]
        same = near[heights.panel[near] == int(counts.argmax())]
        base = float(np.median(heights.height[same])) if len(same) else 0.0
        top = float(np.percentile(heights.height[rows[on_wall]], TOP)) - base
        border = np.isfinite(away)
        cosine = np.abs(mesh.normals[rows[border]] @ panel.normal)
        sine = np.sqrt(np.clip(1 - cosine**2, 0, 1))
        weight = areas[border]
        rim = float((weight * sine).sum() / weight.sum()) if weight.sum() > 0 else 0.0
        return Relief(
            top / unit,
            rim,
            total / unit**2,
            length,
            flatness,
            panel.noise / unit,
            float(areas[on_wall].sum()) / total,
        )


def _flatness(normals: Floats, areas: Floats) -> float:
    """Share of the area that faces in one of few directions."""
    rest = areas.copy()
    total = max(float(areas.sum()), 1e-12)
    cosine = np.cos(np.radians(PLANE_DEG))
    some = np.linspace(0, len(normals) - 1, min(len(normals), 200)).astype(np.int64)
    agree = normals[some] @ normals.T > cosine
    for _ in range(PLANES):
        best = int((agree @ rest).argmax())
        axis = (rest * agree[best]) @ normals
        length = float(np.linalg.norm(axis))
        if length <= 0:
            break
        rest[normals @ (axis / length) > cosine] = 0.0
    return 1 - float(rest.sum()) / total
