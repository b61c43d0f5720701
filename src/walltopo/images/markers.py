"""Detect ArUco markers; refine their corners to a tenth of a pixel, corrected for blooming."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.images.colour import linear32_from_srgb8

Floats = NDArray[np.float64]

STICKERS = "DICT_APRILTAG_36h11"  # dictionary of the stickers: 587 codes, far apart
STICKER_SIDE = 0.08  # m, of the marker
STICKER_MARGIN = 0.0075  # m, white around it; six fit on A4
_SMALL_PHOTO = 2048  # px, longer side

_SAMPLES = 25  # profiles along one side of a marker

_ALONG = (0.1, 0.9)  # part of a side that is used; near the ends the adjacent side disturbs

_STEP = 0.25  # px between the samples of a profile

_MIN_CONTRAST = 0.02  # minimum difference of white and black in linear light

_MIN_SIDE = 12.0  # px; minimum side of a marker


@dataclass(frozen=True)
class Detection:
    """One marker detected in one photo.

    Parameters
    ----------
    photo : file name.
    marker : the marker's id.
    corners : (4, 2) float, pixels (COLMAP's convention: (0, 0) is the corner of the top-left
        pixel), in the order top left, top right, bottom right, bottom left of the upright print.
    dictionary : OpenCV's name of the marker dictionary.
    """

    photo: str
    marker: int
    corners: Floats
    dictionary: str = "DICT_4X4_50"


def marker_cells(dictionary: str, marker: int) -> NDArray[np.bool_]:
    """Return (n, n) bool, which cells of a marker (border included) are white, top row first."""
    import cv2

    number = getattr(cv2.aruco, dictionary, None)
    if not dictionary.startswith("DICT_") or number is None:
        raise InputError(f"{dictionary!r} is not an ArUco dictionary of OpenCV")
    table = cv2.aruco.getPredefinedDictionary(number)
    if not 0 <= marker < len(table.bytesList):
        raise InputError(f"{dictionary} has markers 0 to {len(table.bytesList) - 1}, not {marker}")
    cells = table.markerSize + 2
    image = cv2.aruco.generateImageMarker(table, marker, cells)
    return np.asarray(image) > 127


def detect_markers(
    grey: NDArray[np.uint8], photo: str, dictionaries: Iterable[str]
) -> list[Detection]:
    """Return all markers of the dictionaries in one grey photo.

    Parameters
    ----------
    grey : (H, W) uint8.
    photo : file name for the detections.
    dictionaries : names such as "DICT_4X4_50".

    Raises
    ------
    InputError : OpenCV has no such dictionary.
    """
    found: list[Detection] = []
    for name in dictionaries:
        found += _detect_dictionary(grey, photo, name, _detector_parameters())
    return found


def detect_stickers(grey: NDArray[np.uint8], photo: str) -> list[Detection]:
    """Return all stickers in one grey photo.

    They are small and far away, so small photos are doubled, and codes with up to four wrong cells
    are accepted: the dictionary corrects five.

    Parameters
    ----------
    grey : (H, W) uint8.
    photo : file name for the detections.
    """
    import cv2

    parameters = _detector_parameters()
    parameters.perspectiveRemovePixelPerCell = 8
    parameters.perspectiveRemoveIgnoredMarginPerCell = 0.3
    parameters.errorCorrectionRate = 0.8
    double = max(grey.shape) <= _SMALL_PHOTO
    if not double:
        return _detect_dictionary(grey, photo, STICKERS, parameters)
    large = cv2.resize(grey, None, fx=2, fy=2, interpolation=cv2.INTER_CUBIC)
    found = _detect_dictionary(np.asarray(large, np.uint8), photo, STICKERS, parameters)
    return [replace(one, corners=one.corners / 2) for one in found]


def _detector_parameters() -> Any:
    """Return OpenCV's parameters, with no refinement of corners."""
    import cv2

    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_NONE
    return parameters


def _detect_dictionary(
    grey: NDArray[np.uint8], photo: str, dictionary: str, parameters: Any
) -> list[Detection]:
    """Return the markers of one dictionary whose corners could be refined."""
    import cv2

    # Blur is symmetric in linear light only.
    light = linear32_from_srgb8(grey)
    number = getattr(cv2.aruco, dictionary, None)
    if not dictionary.startswith("DICT_") or number is None:
        raise InputError(f"{dictionary!r} is not an ArUco dictionary of OpenCV")
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(number), parameters)
    quads, ids, _ = detector.detectMarkers(grey)
    found: list[Detection] = []
    for quad, marker in zip(quads, [] if ids is None else np.ravel(ids).tolist(), strict=True):
        white = marker_cells(dictionary, int(marker))
        # OpenCV puts pixel centres at integers.
        start = quad.reshape(4, 2).astype(np.float64) + 0.5
        corners = refine_corners(light, start, len(white))
        if corners is not None:
            corners = correct_blooming(light, corners, white)
            found.append(Detection(photo, int(marker), corners, dictionary))
    return found


def refine_corners(
    light: NDArray[np.float32], corners: Floats, cells: int, rounds: int = 3
) -> Floats | None:
    """Refine the corners of a dark quadrilateral on a light ground by lines fitted to its sides.

    Parameters
    ----------
    light : (H, W) float32, linear light in [0, 1].
    corners : (4, 2) float, pixels, clockwise in the image, accurate to about 3 px.
    cells : cells along a side; the outermost are black.

    Returns
    -------
    (4, 2) float, or None if a side cannot be located (blurred, occluded, cut off, too small).
    """
    start = corners
    for round_ in range(rounds):
        sides = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
        if sides.min() < _MIN_SIDE:
            return None
        # Stay within the marker's black border, which is one cell wide.
        reach = min(3.5 if round_ == 0 else 2.5, 0.8 * sides.min() / cells)
        lines = [_side_line(light, corners[k], corners[(k + 1) % 4], reach) for k in range(4)]
        if any(line is None for line in lines):
            return None
        intersections = [np.cross(lines[k - 1], lines[k]) for k in range(4)]  # type: ignore[arg-type]
        if any(abs(point[2]) < 1e-9 for point in intersections):
            return None
        corners = np.array([point[:2] / point[2] for point in intersections])
        if np.abs(corners - start).max() > max(5.0, 0.1 * sides.max()):
            return None
    return corners


def _side_line(
    light: NDArray[np.float32], start: Floats, end: Floats, reach: float
) -> Floats | None:
    """Fit the homogeneous line (3,) to the dark-to-light edge between two corners; None if not
    found."""
    along = (end - start) / np.linalg.norm(end - start)
    # The corners are clockwise and y points down, so the outside is to the left of the direction.
    outward = np.array([along[1], -along[0]])
    shares = np.linspace(*_ALONG, _SAMPLES)[:, None]
    bases = start + shares * (end - start)
    offsets = np.arange(-reach, reach + 1e-9, _STEP)
    profiles = sample(light, bases[:, None, :] + offsets[None, :, None] * outward)
    crossing = _crossing_offsets(profiles, offsets)
    good = np.isfinite(crossing)
    if good.sum() < _SAMPLES // 3:
        return None
    return _fit_line(bases[good] + crossing[good, None] * outward)


def _crossing_offsets(profiles: Floats, offsets: Floats) -> Floats:
    """Return (n,) the offset at which each dark-to-light profile crosses the middle level, or
    NaN."""
    # Use averages over the whole side, because noise biases the extremes.
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
    if not white - dark >= _MIN_CONTRAST:
        bad[:] = True
    return np.where(bad, np.nan, crossing)


def _fit_line(points: Floats) -> Floats | None:
    """Fit a line by total least squares, refitted without outliers."""
    for _ in range(3):
        if len(points) < 5:
            return None
        centre = points.mean(axis=0)
        normal = np.linalg.svd(points - centre, full_matrices=False)[2][1]
        away = np.abs((points - centre) @ normal)
        points = points[away <= max(3 * np.median(away), 0.05)]
    return np.array([*normal, -normal @ centre])


_PER_CELL = 7  # profiles across each side of a cell

_MIDDLE = 0.3  # half the part of a cell's side that is used; the ends are rounded by blur

_MAX_REACH = 2.5  # px, maximum half length of a profile

_CELL_SHARE = 0.45  # maximum half length of a profile in cells; beyond lies the next edge

_MIN_CELL = 5.0  # px; the edges of smaller cells blur into each other

_MIN_PROFILES = 20  # minimum profiles at inner and at outer edges to estimate the blooming

_MAX_BLOOMING = 1.5  # px; a larger estimate is an error

_RESIDUAL_SCALE = 0.15  # px; larger residuals get less weight


class _CellEdges(NamedTuple):
    """Points on the edges between cells, in cells from the marker's top left corner, y down.

    points : (m, 2). along, to_light : (m, 2) unit directions along the edge and to its light side.
    inner : (m,) bool, whether the edge is inside the marker's outline.
    """

    points: Floats
    along: Floats
    to_light: Floats
    inner: NDArray[np.bool_]


def _cell_edges(white: NDArray[np.bool_]) -> _CellEdges:
    """Return the edges of a marker's cells (n, n), including those to the white margin."""
    around = np.pad(white, 1, constant_values=True)
    points, along, to_light = [], [], []
    places = np.linspace(0.5 - _MIDDLE, 0.5 + _MIDDLE, _PER_CELL)
    for axis in (0, 1):  # differences of rows give edges along x, of columns along y
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
    return _CellEdges(place, np.array(along), np.array(to_light), inner)


def _project_points(corners: Floats, size: int, points: Floats) -> Floats:
    """Return the pixels (m, 2) of points in cells, by the homography of the four corners."""
    import cv2

    square = np.array([[0, 0], [size, 0], [size, size], [0, size]], dtype=np.float32)
    homography = cv2.getPerspectiveTransform(square, corners.astype(np.float32))
    moved = np.column_stack([points, np.ones(len(points))]) @ homography.T
    return np.asarray(moved[:, :2] / moved[:, 2:])


def correct_blooming(
    light: NDArray[np.float32], corners: Floats, white: NDArray[np.bool_], rounds: int = 2
) -> Floats:
    """Move corners outwards by the amount that light areas have grown over dark ones (blooming).

    Parameters
    ----------
    light : (H, W) float32, about linear light.
    corners : (4, 2) float, pixels: top left, top right, bottom right, bottom left of the print.
    white : (n, n) bool, whether a cell is white, including the black border, top row first.
    rounds : number of fits.

    Returns
    -------
    (4, 2) float; the input corners if the cells are too small or too few.
    """
    size = len(white)
    cell = float(np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1).min()) / size
    if cell < _MIN_CELL:
        return corners
    edges = _cell_edges(white)
    reach = min(_MAX_REACH, _CELL_SHARE * cell)
    found = corners
    for _ in range(rounds):
        fit = _fit_corners_and_blooming(light, found, size, edges, reach)
        if fit is None or abs(fit[8]) > _MAX_BLOOMING:
            return corners
        found = found + fit[:8].reshape(4, 2)
    return found


def _fit_corners_and_blooming(
    light: NDArray[np.float32], corners: Floats, size: int, edges: _CellEdges, reach: float
) -> Floats | None:
    """Return (9,) the shifts of the four corners and the growth of light areas, pixels; None if
    unreliable."""
    pixels = _project_points(corners, size, edges.points)
    tangent = _project_points(corners, size, edges.points + 1e-2 * edges.along) - pixels
    normal = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    lit = _project_points(corners, size, edges.points + 1e-2 * edges.to_light) - pixels
    normal *= np.sign((lit * normal).sum(axis=1))[:, None]
    offsets = np.arange(-reach, reach + 1e-9, _STEP)
    profiles = sample(light, pixels[:, None] + offsets[None, :, None] * normal[:, None])
    crossing = _edge_crossing(profiles, offsets)
    good = np.isfinite(crossing)
    if (good & edges.inner).sum() < _MIN_PROFILES or (good & ~edges.inner).sum() < _MIN_PROFILES:
        return None
    design = np.zeros((len(pixels), 9))
    for k in range(8):
        nudged = corners.copy()
        nudged.flat[k] += 0.5
        moved = _project_points(nudged, size, edges.points) - pixels
        design[:, k] = (moved * normal).sum(axis=1) / 0.5
    design[:, 8] = -1.0  # light areas grow into dark ones
    return _solve_robust(design[good], crossing[good])


def _solve_robust(design: Floats, target: Floats) -> Floats:
    """Solve least squares with less weight for residuals beyond `_RESIDUAL_SCALE`."""
    weight = np.ones(len(target))
    solution: Floats = np.zeros(design.shape[1])
    for _ in range(5):
        root = np.sqrt(weight)
        found = np.linalg.lstsq(design * root[:, None], target * root, rcond=None)[0]
        solution = found.astype(np.float64)
        weight = 1.0 / (1.0 + ((design @ solution - target) / _RESIDUAL_SCALE) ** 2)
    return solution


def _edge_crossing(profiles: Floats, offsets: Floats) -> Floats:
    """Return (m,) the offset at which each profile crosses the marker's middle grey.

    NaN for a profile without a crossing, or with several.
    """
    # The blooming is equal at all edges only if all edges use the same level.
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
    """Return bilinear values at pixels (..., 2) in COLMAP's convention; NaN outside the image."""
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
