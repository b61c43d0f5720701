"""Conversions between the boxes, polygons and bitmaps of an object."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from walltopo.core import Mask
from walltopo.scans.segmentation import decode_segmentation
from walltopo_lab.datasets.model import Annotation, Photo, Polygon

_MAX_COMPARED = 4000  # points; above, the pairwise comparison is too slow


def rectangle(x: float, y: float, w: float, h: float) -> Polygon:
    """Return the (4, 2) corners of a box."""
    return np.array([[x, y], [x + w, y], [x + w, y + h], [x, y + h]], dtype=np.float64)


def ellipse(cx: float, cy: float, rx: float, ry: float, corners: int = 32) -> Polygon:
    """Return (corners, 2) points of an axis-aligned ellipse."""
    angle = np.linspace(0, 2 * np.pi, corners, endpoint=False)
    return np.stack([cx + rx * np.cos(angle), cy + ry * np.sin(angle)], axis=1)


def box_of_polygons(polygons: Sequence[Polygon]) -> tuple[float, float, float, float]:
    """Return the bounding box x, y, w, h of all points."""
    points = np.concatenate(list(polygons))
    x, y = points.min(axis=0)
    right, bottom = points.max(axis=0)
    return float(x), float(y), float(right - x), float(bottom - y)


def mask_of(annotation: Annotation, photo: Photo) -> Mask:
    """Return the object's bitmap; for a box-only object, its box clipped to the photo.

    Polygons are drawn by COCO's rule, whose coordinates have the same origin.
    """
    if annotation.mask is not None:
        return annotation.mask
    polygons = annotation.polygons or (rectangle(*annotation.box),)
    flat = tuple(tuple(polygon.ravel().tolist()) for polygon in polygons)
    score = min(max(annotation.score, 1e-6), 1.0)
    return decode_segmentation(flat, photo.width, photo.height, annotation.label, score)


def polygons_of_mask(mask: Mask, tolerance: float = 0.0) -> tuple[Polygon, ...]:
    """Return the outlines of a bitmap along its pixel edges, with holes filled.

    Parameters
    ----------
    tolerance : corners that move the outline by less than this are left out, pixels.
    """
    import cv2

    if mask.area == 0:
        return ()
    # The outlines of a doubled bitmap run along pixel edges instead of pixel centres, so that
    # drawing them again gives the same bitmap.
    doubled = np.kron(np.pad(mask.bitmap, 1), np.ones((2, 2), dtype=np.uint8)).astype(np.uint8)
    contours, _ = cv2.findContours(doubled, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    polygons: list[Polygon] = []
    for contour in contours:
        points = contour[:, 0, :].astype(np.float64)
        # Points are outer pixels of the doubled bitmap; their outer corner lies on the pixel edge.
        edge = np.round((points + 0.5) / 2.0) - 1.0
        edge = edge[np.r_[True, (np.diff(edge, axis=0) != 0).any(axis=1)]]
        if tolerance > 0:
            kept = cv2.approxPolyDP(edge.astype(np.float32)[:, None], tolerance, True)
            edge = kept[:, 0].astype(np.float64)
        edge = _without_straight(edge)
        if len(edge) >= 3:
            polygons.append(edge + np.array([mask.x, mask.y], dtype=np.float64))
    return tuple(polygons)


def _without_straight(points: Polygon) -> Polygon:
    """Return the same outline without the points that lie on a straight run."""
    before = points - np.roll(points, 1, axis=0)
    after = np.roll(points, -1, axis=0) - points
    turns = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    return points[turns != 0]


def join_outlines(polygons: Sequence[Polygon]) -> Polygon:
    """Return one outline of all parts, connected by bridges of zero width.

    Bridges are the shortest ones; with very many points each part connects to the one before it.
    """
    if sum(map(len, polygons)) > _MAX_COMPARED:
        loops = [np.concatenate([part, part[:1]]) for part in polygons]
        back = [part[:1] for part in reversed(polygons[:-1])]
        return np.concatenate([*loops, *back])
    outline = polygons[0]
    for part in polygons[1:]:
        gaps = np.linalg.norm(outline[:, None] - part[None], axis=2)
        at, start = np.unravel_index(int(gaps.argmin()), gaps.shape)
        loop = np.concatenate([part[start:], part[: start + 1]])
        outline = np.concatenate([outline[: at + 1], loop, outline[at:]])
    return outline


def polygons_of(
    annotation: Annotation, photo: Photo, tolerance: float = 0.0
) -> tuple[Polygon, ...]:
    """Return the object's outlines; for a box-only object, its box."""
    if annotation.polygons:
        return annotation.polygons
    if annotation.mask is not None:
        return polygons_of_mask(annotation.mask, tolerance)
    return (rectangle(*annotation.box),)
