"""Finding ArUco markers in photos, with corners good to a tenth of a pixel.

OpenCV's own corner refinements pull a marker's corners inwards by 0.35 to 1 px (a blurred L
corner is round, and photos are gamma-encoded, which fattens the dark side of an edge): one per
cent of a marker 60 px wide, ten times the accuracy a measure must have. So the four sides are
located here: edge profiles across each side in linear light, a line through them, and the corners
where neighbouring lines meet. What clipped and tone-mapped white adds is then taken off by means
of the marker's inner edges (see `light_spread`).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.imaging.srgb import linear32_from_srgb8
from walltopo.measure.light_spread import sample, without_spread
from walltopo.measure.plates import marker_cells

__all__ = ["Detection", "detect_markers", "refine_corners"]

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
