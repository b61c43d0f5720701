"""The plane panels that a wall is made of, and how far each triangle stands out of its panel.

Panels are found by random sample consensus over small neighbourhoods of the mesh; floors are left
out by who calls. Where a reconstruction bends a panel, a plane is millimetres off, as much as the
thinnest holds stand out; so heights are over the panel's own smooth surface: the running mean of
what lies in the plane.

Source: M. Fischler, R. Bolles, "Random Sample Consensus" (CACM 1981); points with normals as
in R. Schnabel, R. Wahl, R. Klein, "Efficient RANSAC for Point-Cloud Shape
Detection" (2007), section 4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_fill_holes
from scipy.spatial import cKDTree

from walltopo.core import Mesh
from walltopo.geometry.similarity import fit_plane

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

NO_PANEL = -1
# Lengths in metres; a caller with another unit gives it.
CELL = 0.04  # points of the search are means over cubes of this side
NEAR = 0.012  # a point so near to a plane may be of it
AGREE_DEG = 18.0  # and its normal so near to the plane's
TRIES = 160  # planes tried a panel, each of the points of one neighbourhood
LOCAL = 0.25  # radius of that
JUDGES = 12_000  # points that judge a try
LEAST_POINTS = 12  # of a panel
RASTER = 0.03  # pixels of a panel's own surface
REACH = 0.30  # gaps of a panel's surface up to twice this wide are of the panel: holds cover them
BEND = 0.22  # radius of the running mean of its surface
SMALL = 0.7  # square metres: a larger plane is never a facet of a volume
STANDS, MOST = 0.02, 0.6  # a facet of a volume stands so far out of the panel that carries it
BEHIND = 0.03  # what lies deeper behind a panel's plane is not of it


@dataclass(frozen=True, eq=False)
class Panel:
    """A plane piece of wall.

    Parameters
    ----------
    normal : (3,) unit, out of the wall; point : (3,) of the plane.
    axes : (2, 3) unit vectors across the normal.
    origin : (2,) of the raster, along `axes` from `point`; pixel : its pixels' side.
    inside : (h, w) bool, where the panel is, what covers it included.
    surface : (h, w) float64, height of its own smooth surface over the plane.
    noise : spread (standard deviation, robust) of its triangles around that surface.
    area : of the triangles that lie in it.
    points : (n, 3) a sample of it.
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
        """Row and column of (n, 3) points in the raster, and whether the panel is there."""
        flat = ((points - self.point) @ self.axes.T - self.origin) / self.pixel
        column, row = np.floor(flat).astype(np.int64).T
        height, width = self.inside.shape
        within = (row >= 0) & (column >= 0) & (row < height) & (column < width)
        row, column = np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)
        return row, column, within & self.inside[row, column]

    def over_plane(self, points: Floats) -> Floats:
        """(n,) heights of (n, 3) points over the plane."""
        return np.asarray((points - self.point) @ self.normal)


@dataclass(frozen=True, eq=False)
class Heights:
    """How the triangles of a mesh stand over its panels.

    Parameters
    ----------
    panel : (F,) int32, the panel that each triangle lies in or stands on, `NO_PANEL` = none.
    height : (F,) float64, of its centroid over the panel's own surface; NaN where none.
    """

    panel: NDArray[np.int32]
    height: Floats


def find_panels(
    mesh: Mesh, rows: Ints, unit: float = 1.0, least: float = 0.12, seed: int = 0, most: int = 200
) -> list[Panel]:
    """The panels of a mesh, the largest first.

    Parameters
    ----------
    mesh : the scan's; rows : triangles that may be of a wall.
    unit : mesh units a metre; least : area of the smallest panel, square metres.
    seed : of the samples; most : so many panels at most.
    """
    points, normals, weights = _thinned(mesh, rows, CELL * unit)
    free = np.ones(len(points), dtype=np.bool_)
    rng = np.random.default_rng(seed)
    found: list[Panel] = []
    cosine = np.cos(np.radians(AGREE_DEG))
    beside = cKDTree(points)
    while len(found) < most and weights[free].sum() >= least * unit**2:
        own = np.flatnonzero(free)
        near = _best_plane(points, normals, weights, own, free, beside, rng, unit)
        if near is None:
            break
        part = _largest_part(points[near], weights[near], 3 * CELL * unit)
        members = near[part]
        if weights[members].sum() < least * unit**2:
            if weights[near].sum() < least * unit**2:
                break
            free[members] = False
            continue
        axis, offset = _facing(points[members], weights[members] @ normals[members])
        away = np.abs(points @ axis - offset)
        taken = free & (away < 2 * NEAR * unit) & (normals @ axis > cosine)
        panel = _panel(axis, offset, points[members], weights[members], unit)
        taken &= panel.cells(points)[2]
        taken[members] = True
        free &= ~taken
        found.append(panel)
    return _of_the_wall(sorted(found, key=lambda panel: -panel.area), unit)


def _of_the_wall(panels: Sequence[Panel], unit: float) -> list[Panel]:
    """Without the small ones that stand on a larger one: facets of volumes, flat tops of holds."""
    kept: list[Panel] = []
    for panel in panels:
        on_another = False
        for other in kept:
            if panel.area < SMALL * unit**2:
                away = other.over_plane(panel.points)
                inside = other.cells(panel.points)[2]
                standing = inside & (away > STANDS * unit) & (away < MOST * unit)
                on_another = on_another or standing.mean() > 0.6
        if not on_another:
            kept.append(panel)
    return kept


def _thinned(mesh: Mesh, rows: Ints, side: float) -> tuple[Floats, Floats, Floats]:
    """Means of the triangles in cubes that face alike: places, normals and areas."""
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

    turned = mean(normals)
    length = np.linalg.norm(turned, axis=1)
    some = (total > 0) & (length > 0.8)  # cubes at edges say nothing of a plane
    return mean(places)[some], turned[some] / length[some, None], total[some]


def _best_plane(
    points: Floats,
    normals: Floats,
    weights: Floats,
    own: Ints,
    free: NDArray[np.bool_],
    beside: cKDTree,
    rng: np.random.Generator,
    unit: float,
) -> Ints | None:
    """Indices of the points of the plane that holds most area among some tries; None: no plane.

    Parameters
    ----------
    own : indices of the points that are in no panel yet; free : (n,) the same as a mask.
    beside : of all points.
    """
    if len(own) < LEAST_POINTS:
        return None
    cosine = np.cos(np.radians(AGREE_DEG))

    def lies_in(rows: Ints, axis: Floats, offset: float) -> NDArray[np.bool_]:
        near = np.abs(points[rows] @ axis - offset) < NEAR * unit
        return np.asarray(near & (normals[rows] @ axis > cosine))

    some = own if len(own) <= JUDGES else rng.choice(own, size=JUDGES, replace=False)
    best: tuple[float, Floats, float] | None = None
    for start in rng.choice(own, size=min(TRIES, len(own)), replace=False).tolist():
        around = np.array(beside.query_ball_point(points[start], LOCAL * unit), dtype=np.int64)
        around = around[free[around] & (normals[around] @ normals[start] > cosine)]
        if len(around) < LEAST_POINTS // 2:
            continue
        axis, offset = _facing(points[around], normals[start])
        area = float(weights[some[lies_in(some, axis, offset)]].sum())
        if best is None or area > best[0]:
            best = area, axis, offset
    if best is None:
        return None
    _, axis, offset = best
    for _ in range(3):
        near = own[lies_in(own, axis, offset)]
        if len(near) < LEAST_POINTS:
            return None
        axis, offset = _facing(points[near], axis)
    return own[lies_in(own, axis, offset)]


def _facing(points: Floats, towards: Floats) -> tuple[Floats, float]:
    """The plane of some points, its normal turned to the side of another."""
    axis, offset = fit_plane(points)
    return (axis, offset) if axis @ towards > 0 else (-axis, -offset)


def _largest_part(points: Floats, weights: Floats, reach: float) -> NDArray[np.bool_]:
    """(n,) which points are of the part that holds most area; nearer than `reach` is one part."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    pairs = cKDTree(points).query_pairs(reach, output_type="ndarray")
    ones = np.ones(len(pairs), dtype=np.int8)
    graph = coo_matrix((ones, (pairs[:, 0], pairs[:, 1])), (len(points), len(points)))
    _, part = connected_components(graph, directed=False)
    return np.asarray(part == np.bincount(part, weights).argmax())


def _panel(normal: Floats, offset: float, points: Floats, weights: Floats, unit: float) -> Panel:
    """A panel from the points that lie in it."""
    up = np.array([0.0, 0.0, 1.0]) if abs(normal[2]) < 0.9 else np.array([0.0, 1.0, 0.0])
    right = np.cross(up, normal)
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(normal, right)])
    point = normal * offset
    flat = (points - point) @ axes.T
    pixel, reach = RASTER * unit, REACH * unit
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
    # The points are means over cubes: the panel goes on for half a cube.
    drawn = np.asarray(cv2.dilate(drawn, np.ones((3, 3), dtype=np.uint8)), dtype=np.uint8)
    # Volumes cover what is as large as a door.
    inside = np.asarray(binary_fill_holes(drawn), dtype=np.bool_)
    sigma = BEND * unit / pixel / 2
    weight = cv2.GaussianBlur(count, (0, 0), sigma)
    surface = cv2.GaussianBlur(total, (0, 0), sigma) / np.maximum(weight, 1e-12)
    surface[weight < 1e-9] = 0.0
    rest = away - surface[row, column]
    noise = 1.4826 * float(np.median(np.abs(rest - np.median(rest))))
    return Panel(
        normal, point, axes, origin, pixel, inside, surface, noise, float(weights.sum()), points
    )


def heights_over(
    mesh: Mesh, panels: Sequence[Panel], unit: float = 1.0, most: float = MOST
) -> Heights:
    """How far the triangles stand out of the panels.

    Of several panels the one whose surface is nearest counts.

    Parameters
    ----------
    unit : mesh units a metre; most : what stands farther out, metres, is of no panel.
    """
    count = len(mesh.faces)
    panel = np.full(count, NO_PANEL, dtype=np.int32)
    height = np.full(count, np.nan)
    best = np.full(count, np.inf)
    for number, own in enumerate(panels):
        away = own.over_plane(mesh.centroids)
        rows = np.flatnonzero(
            (away > -BEHIND * unit) & (away < most * unit) & (np.abs(away) < best + BEHIND * unit)
        )
        row, column, inside = own.cells(mesh.centroids[rows])
        over = away[rows] - own.surface[row, column]
        nearer = inside & (np.abs(over) < best[rows])
        kept = rows[nearer]
        panel[kept], height[kept] = number, over[nearer]
        best[kept] = np.abs(over[nearer])
    return Heights(panel, height)
