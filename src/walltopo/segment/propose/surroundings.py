"""The relief of a piece of surface relative to the wall beside it: height, rim, planes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from walltopo.core import Mesh
from walltopo.geometry.panels import Heights, Panel

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

RING = 0.03  # metres: a wall triangle this near to a piece is beside it
FLANK = (0.2, 0.7)  # shares of the top's height between which the surface is the flank
TOP = 90.0  # percentile of the heights that counts as the top
SECTORS = 24  # directions along the wall


@dataclass(frozen=True)
class Relief:
    """The shape of one piece.

    Parameters
    ----------
    height : of the top over the wall beside the piece, metres.
    rim : mean sine of the angle between the flanks and the wall: 1 = perpendicular.
    area : square metres; length : longest extent along an axis, metres.
    noise : of the panel below the piece, metres.
    on_wall : share of the area that lies on a panel.
    around : share of the directions along the wall in which wall is beside the piece.
    nearby_holds : number of confident instances nearby.
    """

    height: float
    rim: float
    area: float
    length: float
    noise: float
    on_wall: float
    around: float
    nearby_holds: int


class Surroundings:
    """The wall around pieces of a mesh.

    Parameters
    ----------
    label : (F,) int32, the piece of each triangle, 0 = wall.
    unit : mesh units per metre.
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

    def beside(self, rows: Ints) -> Ints:
        """Return the wall triangles near a piece."""
        places = self._mesh.centroids[rows]
        middle = (places.min(axis=0) + places.max(axis=0)) / 2
        reach = float(np.linalg.norm(places - middle, axis=1).max()) + RING * self._unit
        found = sorted(self._tree.query_ball_point(middle, reach))
        near = self._bare[np.array(found, dtype=np.int64)]
        if len(near) == 0:
            return near
        away, _ = cKDTree(places).query(
            self._mesh.centroids[near], distance_upper_bound=RING * self._unit
        )
        return near[np.isfinite(away)]

    def relief(self, rows: Ints, nearby_holds: int) -> Relief:
        """Return the shape of a piece with faces `rows`."""
        mesh, heights, unit = self._mesh, self._heights, self._unit
        areas = mesh.areas[rows]
        total = max(float(areas.sum()), 1e-12)
        on_wall = heights.panel[rows] >= 0
        near = self.beside(rows)
        length = float(np.ptp(mesh.centroids[rows], axis=0).max()) / unit
        if not on_wall.any():
            return Relief(0.0, 0.0, total / unit**2, length, 1.0, 0.0, 0.0, nearby_holds)
        counts = np.bincount(heights.panel[rows[on_wall]], areas[on_wall])
        panel = self._panels[int(counts.argmax())]
        same = near[heights.panel[near] == int(counts.argmax())]
        base = float(np.median(heights.height[same])) if len(same) else 0.0
        top = float(np.percentile(heights.height[rows[on_wall]], TOP)) - base
        over = heights.height[rows] - base
        with np.errstate(invalid="ignore"):
            flank = (over > FLANK[0] * top) & (over < FLANK[1] * top)
        cosine = np.abs(mesh.normals[rows[flank]] @ panel.normal)
        sine = np.sqrt(np.clip(1 - cosine**2, 0, 1))
        weight = areas[flank]
        rim = float((weight * sine).sum() / weight.sum()) if weight.sum() > 0 else 0.0
        return Relief(
            top / unit,
            rim,
            total / unit**2,
            length,
            panel.noise / unit,
            float(areas[on_wall].sum()) / total,
            _wall_around(mesh.centroids[rows], mesh.centroids[same], panel),
            nearby_holds,
        )


def _wall_around(own: Floats, beside: Floats, panel: Panel) -> float:
    """Return the share of the directions around a piece, along its panel, that contain wall."""
    middle = (own.min(axis=0) + own.max(axis=0)) / 2
    right, up = ((beside - middle) @ panel.axes.T).T
    sector = np.floor((np.arctan2(up, right) / np.pi + 1) / 2 * SECTORS).astype(np.int64)
    return len(np.unique(sector % SECTORS)) / SECTORS
