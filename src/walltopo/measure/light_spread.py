"""Marker corners without what light adds: white fields grow in photos, dark ones shrink.

Phones brighten and clip their photos, so that an edge's middle grey lies on the dark side of the
edge. All corners of a marker then move inwards, and the plate seems too small by up to a per cent.
The marker's own cells tell by how much: a white cell in a dark field has grown by what the outer
square has shrunk. Corners and growth are fitted together to all edges between cells.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["sample", "without_spread"]

Floats = NDArray[np.float64]

_PER_CELL = 7  # profiles across each cell's side
_MIDDLE = 0.3  # half the part of a cell's side that is used: its ends are rounded
_STEP = 0.25  # px between the values of a profile
_LONGEST = 2.5  # px, half a profile
_CELL_SHARE = 0.45  # of a cell's size, half a profile at most: beyond lies the next edge
_LEAST_CELL = 5.0  # px; the edges of smaller cells blur into each other
_LEAST_INNER = 20  # profiles at edges inside the marker; fewer do not tell the growth
_MOST_SPREAD = 1.5  # px; more is no growth but a mistake
_ROBUST = 0.15  # px; residuals beyond it weigh less


class _Edges(NamedTuple):
    """Points on the edges between cells, in cells from the marker's top left, y down.

    points, along, to_light : (m, 2); unit directions. inner : (m,) bool, not on the outer square.
    """

    points: Floats
    along: Floats
    to_light: Floats
    inner: NDArray[np.bool_]


def _edges(white: NDArray[np.bool_]) -> _Edges:
    """The edges of a marker's cells (n, n), its white surroundings included."""
    around = np.pad(white, 1, constant_values=True)
    points, along, to_light = [], [], []
    places = np.linspace(0.5 - _MIDDLE, 0.5 + _MIDDLE, _PER_CELL)
    for axis in (0, 1):  # rows apart: edges that run along x; columns apart: along y
        step = np.diff(around.astype(np.int8), axis=axis)
        for row, column in np.argwhere(step):
            # Cell (r, c) of `around` spans x from c - 1 to c and y from r - 1 to r.
            x = np.full(_PER_CELL, float(column)) if axis == 1 else column - 1 + places
            y = np.full(_PER_CELL, float(row)) if axis == 0 else row - 1 + places
            points.append(np.stack([x, y], axis=1))
            side = np.array([0.0, 1.0]) if axis == 0 else np.array([1.0, 0.0])
            along += [side[::-1]] * _PER_CELL
            to_light += [side * step[row, column]] * _PER_CELL
    place = np.concatenate(points)
    inner = np.asarray(((place > 1e-6) & (place < len(white) - 1e-6)).all(axis=1))
    return _Edges(place, np.array(along), np.array(to_light), inner)


def _project(corners: Floats, size: int, points: Floats) -> Floats:
    """(m, 2) pixels of points given in cells, by the homography of the four corners."""
    import cv2

    square = np.array([[0, 0], [size, 0], [size, size], [0, size]], dtype=np.float32)
    homography = cv2.getPerspectiveTransform(square, corners.astype(np.float32))
    moved = np.column_stack([points, np.ones(len(points))]) @ homography.T
    return np.asarray(moved[:, :2] / moved[:, 2:])


def without_spread(
    light: NDArray[np.float32], corners: Floats, white: NDArray[np.bool_], rounds: int = 2
) -> Floats:
    """Corners moved outwards by what the light parts of the marker have grown.

    Parameters
    ----------
    light : (H, W) float32, about linear light.
    corners : (4, 2) float, pixels: top left, top right, bottom right, bottom left of the print.
    white : (n, n) bool, the marker's cells, its black border included, top row first.
    rounds : of fitting.

    Returns
    -------
    (4, 2) float; the corners as given where the cells are too small or too few to tell.
    """
    size = len(white)
    cell = float(np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1).min()) / size
    if cell < _LEAST_CELL:
        return corners
    edges = _edges(white)
    reach = min(_LONGEST, _CELL_SHARE * cell)
    found = corners
    for _ in range(rounds):
        fit = _fit(light, found, size, edges, reach)
        if fit is None or abs(fit[8]) > _MOST_SPREAD:
            return corners
        found = found + fit[:8].reshape(4, 2)
    return found


def _fit(
    light: NDArray[np.float32], corners: Floats, size: int, edges: _Edges, reach: float
) -> Floats | None:
    """(9,) moves of the four corners and the growth of the light parts, pixels."""
    pixels = _project(corners, size, edges.points)
    tangent = _project(corners, size, edges.points + 1e-2 * edges.along) - pixels
    normal = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    lit = _project(corners, size, edges.points + 1e-2 * edges.to_light) - pixels
    normal *= np.sign((lit * normal).sum(axis=1))[:, None]
    offsets = np.arange(-reach, reach + 1e-9, _STEP)
    profiles = sample(light, pixels[:, None] + offsets[None, :, None] * normal[:, None])
    crossing = _crossing(profiles, offsets)
    good = np.isfinite(crossing)
    if (good & edges.inner).sum() < _LEAST_INNER or (good & ~edges.inner).sum() < _LEAST_INNER:
        return None
    design = np.zeros((len(pixels), 9))
    for k in range(8):
        nudged = corners.copy()
        nudged.flat[k] += 0.5
        moved = _project(nudged, size, edges.points) - pixels
        design[:, k] = (moved * normal).sum(axis=1) / 0.5
    design[:, 8] = -1.0  # light parts grow into the dark
    return _robust(design[good], crossing[good])


def _robust(design: Floats, target: Floats) -> Floats:
    """Least squares that gives residuals beyond `_ROBUST` less weight."""
    weight = np.ones(len(target))
    solution: Floats = np.zeros(design.shape[1])
    for _ in range(5):
        root = np.sqrt(weight)
        found = np.linalg.lstsq(design * root[:, None], target * root, rcond=None)[0]
        solution = found.astype(np.float64)
        weight = 1.0 / (1.0 + ((design @ solution - target) / _ROBUST) ** 2)
    return solution


def _crossing(profiles: Floats, offsets: Floats) -> Floats:
    """(m,) offset at which each profile passes the grey midway between the marker's dark and
    light; NaN where it does not, or more than once."""
    # One level for all edges: only then has the growth the same size at each.
    level = 0.5 * (np.nanmedian(profiles[:, 0]) + np.nanmedian(profiles[:, -1]))
    above = profiles >= level
    rising = above[:, 1:] & ~above[:, :-1]
    at = rising.argmax(axis=1)
    rows = np.arange(len(profiles))
    low, high = profiles[rows, at], profiles[rows, at + 1]
    share = (level - low) / np.where(high > low, high - low, 1.0)
    bad = (rising.sum(axis=1) != 1) | ~np.isfinite(profiles).all(axis=1)
    return np.where(bad, np.nan, offsets[at] + share * _STEP)


def sample(image: NDArray[np.float32], xy: Floats) -> Floats:
    """Bilinear values at pixels (..., 2) in COLMAP's convention; NaN outside the image."""
    height, width = image.shape
    x, y = xy[..., 0] - 0.5, xy[..., 1] - 0.5
    inside = (x >= 0) & (y >= 0) & (x < width - 1) & (y < height - 1)
    x0 = np.where(inside, np.floor(x), 0).astype(np.intp)
    y0 = np.where(inside, np.floor(y), 0).astype(np.intp)
    dx, dy = x - x0, y - y0
    values = (
        image[y0, x0] * (1 - dx) * (1 - dy)
        + image[y0, x0 + 1] * dx * (1 - dy)
        + image[y0 + 1, x0] * (1 - dx) * dy
        + image[y0 + 1, x0 + 1] * dx * dy
    )
    return np.where(inside, values, np.nan)
