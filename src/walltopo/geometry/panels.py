"""Find the planar panels of a wall, and the height of each triangle over its panel.

Panels are found by RANSAC over small neighbourhoods of the mesh; the caller excludes floors. A
reconstruction may bend a panel by millimetres, as much as the thinnest holds stand out. So heights
are measured over the panel's smooth surface: the moving average of its points.

Source: M. Fischler, R. Bolles, "Random Sample Consensus" (CACM 1981); points with normals as
in R. Schnabel, R. Wahl, R. Klein, "Efficient RANSAC for Point-Cloud Shape
Detection" (2007), section 4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_fill_holes
from scipy.spatial import cKDTree

from walltopo.core import Mesh
from walltopo.geometry.kernels import kernel
from walltopo.geometry.rays import triangle_index_of
from walltopo.geometry.similarity import fit_plane

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

NO_PANEL = -1
# Lengths in metres; callers pass `unit` for other units.
CELL = 0.04  # side of the cubes over which the mesh is averaged for the search
INLIER_DISTANCE = 0.012  # maximum distance of an inlier from the plane
INLIER_ANGLE_DEG = 18.0  # maximum angle between an inlier's normal and the plane's
INLIER_COSINE = float(np.cos(np.radians(INLIER_ANGLE_DEG)))
ITERATIONS = 160  # RANSAC iterations per panel, each from one neighbourhood
NEIGHBOURHOOD = 0.25  # radius of a neighbourhood
MAX_SCORERS = 12_000  # maximum number of points that score a candidate plane
MIN_POINTS = 12  # minimum number of points of a panel
PIXEL = 0.03  # pixel size of a panel's surface raster
BOX_MARGIN = 4  # pixels: closing gaps and rounding widen a panel by less
GAP_REACH = 0.30  # gaps up to twice this wide belong to the panel, because holds cover it
SMOOTHING_RADIUS = 0.22  # radius of the moving average
MAX_FACET_AREA = 0.7  # square metres; a larger plane is never a facet of a volume
MIN_FACET_HEIGHT, MAX_FACET_HEIGHT = 0.02, 0.6  # height range of a volume's facet over its panel
MAX_BEHIND = 0.03  # maximum depth behind the plane of a triangle of the panel


@dataclass(frozen=True, eq=False)
class Panel:
    """A planar piece of wall.

    Parameters
    ----------
    normal : (3,) unit, out of the wall.
    point : (3,) a point of the plane.
    axes : (2, 3) unit vectors perpendicular to the normal.
    origin : (2,) of the raster, along `axes` from `point`.
    pixel : side of a raster pixel.
    inside : (h, w) bool, extent of the panel, including areas under holds and volumes.
    surface : (h, w) float64, height of the panel's smooth surface over the plane.
    noise : robust standard deviation of the points around that surface.
    area : area of the triangles in the panel.
    points : (n, 3) averaged points of the panel.
    """

    normal: Floats
    point: Floats
    axes: Floats
    origin: Floats
    pixel: float
    inside: NDArray[np.bool_]
    surface: Floats
    noise: float
    area: float
    points: Floats

    def cells(self, points: Floats) -> tuple[Ints, Ints, NDArray[np.bool_]]:
        """Return the row and column of (n, 3) points in the raster, and whether the panel covers
        them."""
        flat = ((points - self.point) @ self.axes.T - self.origin) / self.pixel
        column, row = np.floor(flat).astype(np.int64).T
        height, width = self.inside.shape
        within = (row >= 0) & (column >= 0) & (row < height) & (column < width)
        row, column = np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)
        return row, column, within & self.inside[row, column]

    def box(self, height: float) -> tuple[Floats, Floats]:
        """Return two corners (3,) of an axis-aligned box around all that the panel covers, up to a
        height over or below its plane."""
        beyond = height + BOX_MARGIN * self.pixel
        return self.points.min(axis=0) - beyond, self.points.max(axis=0) + beyond

    def over_plane(self, points: Floats) -> Floats:
        """Return (n,) heights of (n, 3) points over the plane."""
        return np.asarray((points - self.point) @ self.normal)


@dataclass(frozen=True, eq=False)
class Heights:
    """The heights of a mesh's triangles over its panels.

    Parameters
    ----------
    panel : (F,) int32, panel that each triangle lies in or stands on, `NO_PANEL` = none.
    height : (F,) float64, height of the centroid over the panel's surface; NaN without a panel.
    """

    panel: NDArray[np.int32]
    height: Floats


def find_panels(
    mesh: Mesh,
    rows: Ints,
    unit: float = 1.0,
    min_area: float = 0.12,
    seed: int = 0,
) -> list[Panel]:
    """Return the panels of a mesh, the largest first.

    Parameters
    ----------
    rows : triangles that may belong to a wall.
    unit : mesh units per metre.
    min_area : minimum area of a panel, square metres.
    seed : random seed.
    """
    points, normals, weights = _average_in_cubes(mesh, rows, CELL * unit)
    free = np.ones(len(points), dtype=np.bool_)
    rng = np.random.default_rng(seed)
    found: list[Panel] = []
    tree = cKDTree(points)
    while weights[free].sum() >= min_area * unit**2:
        own = np.flatnonzero(free)
        near = _best_plane(points, normals, weights, own, free, tree, rng, unit)
        if near is None:
            break
        part = _largest_component(points[near], weights[near], 3 * CELL * unit)
        members = near[part]
        if weights[members].sum() < min_area * unit**2:
            if weights[near].sum() < min_area * unit**2:
                break
            free[members] = False
            continue
        axis, offset = _fit_facing_plane(points[members], weights[members] @ normals[members])
        panel = _make_panel(axis, offset, points[members], weights[members], unit)
        used = _on_plane(points, normals, own, axis, offset, 2 * INLIER_DISTANCE * unit)
        free[used[panel.cells(points[used])[2]]] = False
        free[members] = False
        found.append(panel)
    return _drop_facets(sorted(found, key=lambda panel: -panel.area), unit)


def _drop_facets(panels: Sequence[Panel], unit: float) -> list[Panel]:
    """Drop small panels that stand on a larger one: facets of volumes and flat tops of holds."""
    kept: list[Panel] = []
    boxes: list[tuple[Floats, Floats]] = []
    for panel in panels:
        if panel.area < MAX_FACET_AREA * unit**2:
            low, high = panel.box(0.0)
            near = (
                other
                for other, (first, last) in zip(kept, boxes, strict=True)
                if (low <= last).all() and (high >= first).all()
            )
            if any(_stands_on(panel, other, unit) for other in near):
                continue
        kept.append(panel)
        boxes.append(panel.box(MAX_FACET_HEIGHT * unit))
    return kept


def _stands_on(panel: Panel, other: Panel, unit: float) -> bool:
    away = other.over_plane(panel.points)
    inside = other.cells(panel.points)[2]
    standing = inside & (away > MIN_FACET_HEIGHT * unit) & (away < MAX_FACET_HEIGHT * unit)
    return bool(standing.mean() > 0.6)


def _average_in_cubes(mesh: Mesh, rows: Ints, side: float) -> tuple[Floats, Floats, Floats]:
    """Average triangles in cubes, by facing direction; return positions, normals and areas."""
    places, normals, areas = mesh.centroids[rows], mesh.normals[rows], mesh.areas[rows]
    cell = np.floor((places - places.min(axis=0, initial=0.0)) / side).astype(np.int64)
    facing = np.abs(normals).argmax(axis=1) * 2 + (normals.max(axis=1) > -normals.min(axis=1))
    key = ((cell[:, 0] * 100_003 + cell[:, 1]) * 100_003 + cell[:, 2]) * 6 + facing
    _, group = np.unique(key, return_inverse=True)
    count = int(group.max(initial=-1)) + 1
    total = np.bincount(group, areas, count)

    def mean(values: Floats) -> Floats:
        sums = [np.bincount(group, areas * values[:, k], count) for k in range(3)]
        return np.stack(sums, axis=1) / np.maximum(total, 1e-12)[:, None]

    mean_normals = mean(normals)
    length = np.linalg.norm(mean_normals, axis=1)
    some = (total > 0) & (length > 0.8)  # averages over an edge belong to no plane
    return mean(places)[some], mean_normals[some] / length[some, None], total[some]


def _best_plane(
    points: Floats,
    normals: Floats,
    weights: Floats,
    own: Ints,
    free: NDArray[np.bool_],
    tree: cKDTree,
    rng: np.random.Generator,
    unit: float,
) -> Ints | None:
    """Return the indices of the points of the best RANSAC plane by area, or None.

    Parameters
    ----------
    own : indices of the points without a panel.
    free : (n,) the same as a mask.
    tree : all points.
    """
    if len(own) < MIN_POINTS:
        return None
    reach = INLIER_DISTANCE * unit
    some = own if len(own) <= MAX_SCORERS else rng.choice(own, size=MAX_SCORERS, replace=False)
    best: tuple[float, Floats, float] | None = None
    for start in rng.choice(own, size=min(ITERATIONS, len(own)), replace=False).tolist():
        around = np.array(
            tree.query_ball_point(points[start], NEIGHBOURHOOD * unit), dtype=np.int64
        )
        around = around[free[around] & (normals[around] @ normals[start] > INLIER_COSINE)]
        if len(around) < MIN_POINTS // 2:
            continue
        axis, offset = _fit_facing_plane(points[around], normals[start])
        area = float(weights[_on_plane(points, normals, some, axis, offset, reach)].sum())
        if best is None or area > best[0]:
            best = area, axis, offset
    if best is None:
        return None
    _, axis, offset = best
    for _ in range(3):
        near = _on_plane(points, normals, own, axis, offset, reach)
        if len(near) < MIN_POINTS:
            return None
        axis, offset = _fit_facing_plane(points[near], axis)
    return _on_plane(points, normals, own, axis, offset, reach)


def _on_plane(
    points: Floats, normals: Floats, rows: Ints, axis: Floats, offset: float, reach: float
) -> Ints:
    """Return those of the rows whose points lie within `reach` of a plane and face as it does."""
    return rows[_lies_on_plane(points, normals, rows, axis, offset, reach, INLIER_COSINE)]


@kernel
def _lies_on_plane(
    points: Any, normals: Any, rows: Any, axis: Any, offset: Any, reach: Any, cosine: Any
) -> Any:
    found = np.empty(len(rows), dtype=np.bool_)
    x, y, z = axis[0], axis[1], axis[2]
    for k in range(len(rows)):
        p = rows[k]
        away = points[p, 0] * x + points[p, 1] * y + points[p, 2] * z - offset
        facing = normals[p, 0] * x + normals[p, 1] * y + normals[p, 2] * z
        found[k] = abs(away) < reach and facing > cosine
    return found


def _fit_facing_plane(points: Floats, towards: Floats) -> tuple[Floats, float]:
    """Fit a plane to points; orient its normal to the side of `towards`."""
    axis, offset = fit_plane(points)
    return (axis, offset) if axis @ towards > 0 else (-axis, -offset)


def _largest_component(points: Floats, weights: Floats, reach: float) -> NDArray[np.bool_]:
    """Return (n,) whether points belong to the component with the largest area, linked within
    `reach`."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    pairs = cKDTree(points).query_pairs(reach, output_type="ndarray")
    ones = np.ones(len(pairs), dtype=np.int8)
    graph = coo_matrix((ones, (pairs[:, 0], pairs[:, 1])), (len(points), len(points)))
    _, part = connected_components(graph, directed=False)
    return np.asarray(part == np.bincount(part, weights).argmax())


def _make_panel(
    normal: Floats, offset: float, points: Floats, weights: Floats, unit: float
) -> Panel:
    """Return the panel of the points in a plane."""
    up = np.array([0.0, 0.0, 1.0]) if abs(normal[2]) < 0.9 else np.array([0.0, 1.0, 0.0])
    right = np.cross(up, normal)
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(normal, right)])
    point = normal * offset
    flat = (points - point) @ axes.T
    pixel, reach = PIXEL * unit, GAP_REACH * unit
    origin = flat.min(axis=0) - reach - pixel
    column, row = np.floor((flat - origin) / pixel).astype(np.int64).T
    shape = (int(row.max() + reach / pixel) + 2, int(column.max() + reach / pixel) + 2)
    away = (points - point) @ normal
    drawn = np.zeros(shape, dtype=np.uint8)
    drawn[row, column] = 1
    total, count = np.zeros(shape), np.zeros(shape)
    np.add.at(total, (row, column), weights * away)
    np.add.at(count, (row, column), weights)
    side = 2 * int(reach / pixel) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side))
    drawn = np.asarray(cv2.morphologyEx(drawn, cv2.MORPH_CLOSE, disc), dtype=np.uint8)
    # The points are averages over cubes, so the panel extends half a cube farther.
    drawn = np.asarray(cv2.dilate(drawn, np.ones((3, 3), dtype=np.uint8)), dtype=np.uint8)
    # A volume may cover an area as large as a door.
    inside = np.asarray(binary_fill_holes(drawn), dtype=np.bool_)
    sigma = SMOOTHING_RADIUS * unit / pixel / 2
    weight = cv2.GaussianBlur(count, (0, 0), sigma)
    surface = cv2.GaussianBlur(total, (0, 0), sigma) / np.maximum(weight, 1e-12)
    surface[weight < 1e-9] = 0.0
    rest = away - surface[row, column]
    noise = 1.4826 * float(np.median(np.abs(rest - np.median(rest))))
    return Panel(
        normal, point, axes, origin, pixel, inside, surface, noise, float(weights.sum()), points
    )


def heights_over(
    mesh: Mesh, panels: Sequence[Panel], unit: float = 1.0, max_height: float = MAX_FACET_HEIGHT
) -> Heights:
    """Return the heights of the triangles over the panels.

    A triangle near several panels belongs to the one with the nearest surface.

    Parameters
    ----------
    unit : mesh units per metre.
    max_height : higher triangles belong to no panel, metres.
    """
    count = len(mesh.faces)
    panel = np.full(count, NO_PANEL, dtype=np.int32)
    height = np.full(count, np.nan)
    best = np.full(count, np.inf)
    index = triangle_index_of(mesh)
    for number, own in enumerate(panels):
        rows = index.in_box(*own.box(max_height * unit))
        away = own.over_plane(mesh.centroids[rows])
        near = (
            (away > -MAX_BEHIND * unit)
            & (away < max_height * unit)
            & (np.abs(away) < best[rows] + MAX_BEHIND * unit)
        )
        rows, away = rows[near], away[near]
        row, column, inside = own.cells(mesh.centroids[rows])
        over = away - own.surface[row, column]
        nearer = inside & (np.abs(over) < best[rows])
        kept = rows[nearer]
        panel[kept], height[kept] = number, over[nearer]
        best[kept] = np.abs(over[nearer])
    return Heights(panel, height)
