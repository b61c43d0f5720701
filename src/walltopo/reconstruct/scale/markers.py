"""ArUco markers in photos: corners to a tenth of a pixel, free of the spread of bright fields."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.images.colour import linear32_from_srgb8
from walltopo.reconstruct.scale.plates import marker_cells

Floats = NDArray[np.float64]

_SAMPLES = 25  # profiles along one side

_ALONG = (0.1, 0.9)  # part of a side that is used: near its ends the other side disturbs

_STEP = 0.25  # px between the values of a profile

_LEAST_CONTRAST = 0.02  # linear light between black and white, below which a profile is ignored

_SMALLEST = 12.0  # px, the shortest side of a marker that is worth measuring


@dataclass(frozen=True)
class Detection:
    """One marker seen in one photo.

    Parameters
    ----------
    photo : file name.
    marker : the marker's id.
    corners : (4, 2) float, pixels (COLMAP's convention: (0, 0) is the corner of the top-left
        pixel), in the order top left, top right, bottom right, bottom left of the upright print.
    dictionary : OpenCV's name of the dictionary.
    """

    photo: str
    marker: int
    corners: Floats
    dictionary: str = "DICT_4X4_50"


def detect_markers(
    grey: NDArray[np.uint8], photo: str, dictionaries: Iterable[str]
) -> list[Detection]:
    """All markers of the dictionaries in one grey photo.

    Parameters
    ----------
    grey : (H, W) uint8.
    photo : name written into the detections.
    dictionaries : names such as "DICT_4X4_50".

    Raises
    ------
    InputError : OpenCV has no dictionary of that name.
    """
    import cv2

    # In linear light blur is symmetric.
    light = linear32_from_srgb8(grey)
    found: list[Detection] = []
    for name in dictionaries:
        number = getattr(cv2.aruco, name, None)
        if not name.startswith("DICT_") or number is None:
            raise InputError(f"{name!r} is not an ArUco dictionary of OpenCV")
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_NONE
        detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(number), parameters)
        quads, ids, _ = detector.detectMarkers(grey)
        for quad, marker in zip(quads, [] if ids is None else np.ravel(ids).tolist(), strict=True):
            # OpenCV puts pixel centres at integers.
            corners = refine_corners(light, quad.reshape(4, 2).astype(np.float64) + 0.5)
            if corners is not None:
                corners = without_spread(light, corners, marker_cells(name, int(marker)))
                found.append(Detection(photo, int(marker), corners, name))
    return found


def refine_corners(light: NDArray[np.float32], corners: Floats, rounds: int = 3) -> Floats | None:
    """Corners of a dark quadrilateral on a light ground, from lines fitted to its sides.

    Parameters
    ----------
    light : (H, W) float32, linear light in [0, 1].
    corners : (4, 2) float, pixels, clockwise in the image, within about 3 px of the truth.

    Returns
    -------
    (4, 2) float, or None where a side cannot be located (blurred, covered, cut off, too small).
    """
    start = corners
    for turn in range(rounds):
        sides = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
        if sides.min() < _SMALLEST:
            return None
        # Never look further than the marker's black border, which is a sixth of its side wide.
        reach = min(3.5 if turn == 0 else 2.5, 0.8 * sides.min() / 6)
        lines = [_side_line(light, corners[k], corners[(k + 1) % 4], reach) for k in range(4)]
        if any(line is None for line in lines):
            return None
        meets = [np.cross(lines[k - 1], lines[k]) for k in range(4)]  # type: ignore[arg-type]
        if any(abs(meet[2]) < 1e-9 for meet in meets):
            return None
        corners = np.array([meet[:2] / meet[2] for meet in meets])
        if np.abs(corners - start).max() > max(5.0, 0.1 * sides.max()):
            return None
    return corners


def _side_line(
    light: NDArray[np.float32], start: Floats, end: Floats, reach: float
) -> Floats | None:
    """Homogeneous line (3,) through the dark-to-light edge between two corners."""
    along = (end - start) / np.linalg.norm(end - start)
    # Clockwise in an image whose y points down: outside is to the left of the walking direction.
    outward = np.array([along[1], -along[0]])
    shares = np.linspace(*_ALONG, _SAMPLES)[:, None]
    bases = start + shares * (end - start)
    offsets = np.arange(-reach, reach + 1e-9, _STEP)
    profiles = sample(light, bases[:, None, :] + offsets[None, :, None] * outward)
    crossing = _crossing(profiles, offsets)
    good = np.isfinite(crossing)
    if good.sum() < _SAMPLES // 3:
        return None
    return _fit_line(bases[good] + crossing[good, None] * outward)


def _crossing(profiles: Floats, offsets: Floats) -> Floats:
    """(n,) offset at which each dark-to-light profile passes the middle; NaN where it does not."""
    # Means over the whole side, not extremes: noise would lift the brighter level more.
    edge = max(2, profiles.shape[1] // 5)
    dark = np.nanmedian(profiles[:, :edge].mean(axis=1))
    white = np.nanmedian(profiles[:, -edge:].mean(axis=1))
    middle = 0.5 * (dark + white)
    above = profiles >= middle
    rising = above[:, 1:] & ~above[:, :-1]
    at = rising.argmax(axis=1)
    rows = np.arange(len(profiles))
    low, high = profiles[rows, at], profiles[rows, at + 1]
    share = (middle - low) / np.where(high > low, high - low, 1.0)
    crossing = offsets[at] + share * (offsets[1] - offsets[0])
    bad = (rising.sum(axis=1) != 1) | ~np.isfinite(profiles).all(axis=1)
    if not white - dark >= _LEAST_CONTRAST:
        bad[:] = True
    return np.where(bad, np.nan, crossing)


def _fit_line(points: Floats) -> Floats | None:
    """Total least squares line, refitted without the points far from it."""
    for _ in range(3):
        if len(points) < 5:
            return None
        centre = points.mean(axis=0)
        normal = np.linalg.svd(points - centre, full_matrices=False)[2][1]
        away = np.abs((points - centre) @ normal)
        points = points[away <= max(3 * np.median(away), 0.05)]
    return np.array([*normal, -normal @ centre])


_PER_CELL = 7  # profiles across each cell's side

_MIDDLE = 0.3  # half the part of a cell's side that is used: its ends are rounded

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
    crossing = _edge_crossing(profiles, offsets)
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


def _edge_crossing(profiles: Floats, offsets: Floats) -> Floats:
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
