"""Compute the scale from a known distance between two photos, or two points marked in photos."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera, InputError, View
from walltopo.core.files import atomic_path, read_toml
from walltopo.core.view import MAX_SIDE
from walltopo.scans.document import parse

Floats = NDArray[np.float64]
Pixel = Annotated[float, msgspec.Meta(ge=0, le=MAX_SIDE)]


def parse_distance(text: str, known: Sequence[str]) -> tuple[str, str, float]:
    """Parse `A-B=1.23` to two names and metres; names may contain hyphens.

    Raises
    ------
    InputError : wrong form, no positive number, or an unknown name.
    """
    pair, equals, number = text.rpartition("=")
    try:
        metres = float(number)
    except ValueError:
        metres = float("nan")
    if not equals or not np.isfinite(metres) or metres <= 0:
        raise InputError(
            f"scale.distance: expected A-B=METRES such as left-right=1.23, got {text!r}"
        )
    parts = pair.split("-")
    splits = [("-".join(parts[:k]), "-".join(parts[k:])) for k in range(1, len(parts))]
    for first, second in splits:
        if first in known and second in known and first != second:
            return first, second, metres
    listed = ", ".join(sorted(known)[:12])
    raise InputError(
        f"scale.distance: {pair!r} does not name two different registered photos or points",
        f"Known names: {listed}{', ...' if len(known) > 12 else ''}.",
    )


def named_points(path: Path, views: Sequence[View]) -> dict[str, Floats]:
    """Triangulate the points of a TOML file.

    The file has one table per point, which gives its pixel (x, y from the top left corner) in
    each of two or more photos::

        [left]
        "IMG_0001.jpg" = [512.0, 300.5]
        "IMG_0004.jpg" = [498.2, 310.0]

    Returns
    -------
    Points (3,) in the frame of the views, by name.

    Raises
    ------
    InputError : the file is unreadable, a photo is not registered, or the rays do not intersect.
    """
    table = parse(read_toml(path), dict[str, dict[str, tuple[Pixel, Pixel]]], str(path))
    by_name = {view.name: view for view in views}
    points: dict[str, Floats] = {}
    for name, seen in table.items():
        if len(seen) < 2:
            raise InputError(f"{path}: point {name!r}: give its pixel in two or more photos")
        unknown = [photo for photo in seen if photo not in by_name]
        if unknown:
            raise InputError(f"{path}: point {name!r}: {unknown[0]} is not a registered photo")
        pixels = np.array(list(seen.values()))
        sizes = [(by_name[k].camera.width, by_name[k].camera.height) for k in seen]
        if ((pixels < 0) | (pixels > np.array(sizes))).any():
            raise InputError(f"{path}: point {name!r}: a pixel lies outside its photo")
        found = triangulate([by_name[photo] for photo in seen], pixels, tolerance_px=12.0)
        if found is None or not found.inliers.all():
            raise InputError(
                f"{path}: point {name!r}: its pixels do not meet in one point",
                "Check that every photo marks the same point, and that the photos were taken from "
                "different places.",
            )
        points[name] = found.point
    return points


def write_points(points: Mapping[str, Mapping[str, tuple[float, float]]], path: Path) -> None:
    """Write the pixels of points, by point and photo, as `named_points` reads them."""
    lines: list[str] = []
    for name, marks in points.items():
        lines.append(f"[{json.dumps(name)}]")
        lines += [f"{json.dumps(photo)} = [{x!r}, {y!r}]" for photo, (x, y) in marks.items()]
    with atomic_path(path) as draft:
        draft.write_text("\n".join(lines) + "\n", encoding="utf-8")


_MAX_MARKS = 20


def mark_point(point: Floats, views: Sequence[View]) -> dict[str, tuple[float, float]]:
    """Return the pixels (x, y) of a point in up to 20 photos, as `named_points` takes them.

    The pixels stand for the point in a later run with other photos, whose model has another unit
    and origin. Photos that the point is hidden in count as well.

    Parameters
    ----------
    point : (3,) float, frame of the views.

    Returns
    -------
    Pixels by photo name; fewer than two if too few photos have the point in their picture.
    """
    marks: dict[str, tuple[float, float]] = {}
    for view in views:
        x, y, depth = view.to_camera(point)
        pixel = view.project(point)
        size = (view.camera.width, view.camera.height)
        if depth <= 0 or not np.isfinite(pixel).all() or (pixel < 0).any() or (pixel > size).any():
            continue
        # The distortion of a lens maps some points far outside the picture into it.
        if np.abs(undistort(view.camera, pixel[None])[0] - [x / depth, y / depth]).max() < 1e-6:
            marks[view.name] = (float(pixel[0]), float(pixel[1]))
    step = 1 + len(marks) // _MAX_MARKS
    return dict(list(marks.items())[::step])


def scale_from_distance(text: str, views: Sequence[View], points: dict[str, Floats]) -> float:
    """Return the metres per model unit from `A-B=1.23`.

    A photo's file name, with or without its suffix, stands for the camera's centre.

    Raises
    ------
    InputError : see `parse_distance`; or both points coincide.
    """
    places = {view.name.rsplit(".", 1)[0]: view.centre for view in views}
    places |= {view.name: view.centre for view in views}
    places |= points
    first, second, metres = parse_distance(text, list(places))
    apart = float(np.linalg.norm(places[first] - places[second]))
    size = float(np.ptp([view.centre for view in views], axis=0).max())
    if apart <= 1e-6 * size:
        raise InputError(f"scale.distance: {first} and {second} are at the same spot")
    return metres / apart


_MIN_ANGLE_DEG = 1.5
_MAX_PAIRS = 300


def undistort(camera: Camera, pixels: Floats) -> Floats:
    """Return the normalised image coordinates (x/z, y/z) (n, 2) of pixels (n, 2).

    The fixed-point iteration inverts `Camera.project`; it converges for the distortion of phones.
    """
    focal = np.array([camera.fx, camera.fy])
    uv = (pixels - [camera.cx, camera.cy]) / focal
    for _ in range(0 if camera.is_pinhole else 30):
        step = (camera.project(np.concatenate([uv, np.ones_like(uv[:, :1])], 1)) - pixels) / focal
        uv = uv - step
        if np.abs(step).max() < 1e-12:
            break
    return uv


@dataclass(frozen=True, eq=False)
class TriangulatedPoint:
    """A triangulated point.

    Parameters
    ----------
    point : (3,) float, frame of the views.
    inliers : (n,) bool, whether an observation agrees with the point.
    residual_px : root mean square reprojection error of the inliers.
    """

    point: Floats
    inliers: NDArray[np.bool_]
    residual_px: float


def triangulate(
    views: Sequence[View], pixels: Floats, tolerance_px: float = 3.0
) -> TriangulatedPoint | None:
    """Return the point with the most inlier observations, at minimum reprojection error.

    Parameters
    ----------
    views : n posed photos.
    pixels : (n, 2) float, the point's pixel in each photo.
    tolerance_px : maximum reprojection error of an inlier.

    Returns
    -------
    None if no two photos agree, or if their rays are nearly parallel.
    """
    if len(views) < 2:
        return None
    origins = np.array([view.centre for view in views])
    directions = np.array([_pixel_ray(view, xy) for view, xy in zip(views, pixels, strict=True)])
    best: tuple[int, float, NDArray[np.bool_], Floats] | None = None
    pairs = list(combinations(range(len(views)), 2))
    for a, b in pairs[:: 1 + len(pairs) // _MAX_PAIRS]:
        if abs(directions[a] @ directions[b]) > np.cos(np.radians(_MIN_ANGLE_DEG)):
            continue
        point = _nearest_to_rays(origins[[a, b]], directions[[a, b]])
        errors = _reprojection_errors(views, pixels, point)
        inliers = errors <= tolerance_px
        score = (int(inliers.sum()), -float(np.minimum(errors, tolerance_px).sum()))
        if inliers.sum() >= 2 and (best is None or score > best[:2]):
            best = (*score, inliers, point)
    if best is None:
        return None
    inliers, point = best[2], best[3]
    for _ in range(2):
        chosen = [view for view, good in zip(views, inliers, strict=True) if good]
        point = _refine_point(chosen, pixels[inliers], point)
        refined = _reprojection_errors(views, pixels, point) <= tolerance_px
        if refined.sum() < 2:
            break
        inliers = refined
    errors = _reprojection_errors(views, pixels, point)[inliers]
    return TriangulatedPoint(point, inliers, float(np.sqrt(np.mean(errors**2))))


def _pixel_ray(view: View, pixel: Floats) -> Floats:
    """Return the unit direction of a pixel's ray in the world frame."""
    uv = undistort(view.camera, pixel[None])[0]
    ray = view.cam_from_world[:, :3].T @ np.array([*uv, 1.0])
    return ray / np.linalg.norm(ray)


def _nearest_to_rays(origins: Floats, directions: Floats) -> Floats:
    """Return the point with the least squared distance to rays."""
    projectors = np.eye(3) - directions[:, :, None] * directions[:, None, :]
    right = (projectors @ origins[:, :, None]).sum(axis=0)[:, 0]
    return np.linalg.solve(projectors.sum(axis=0), right)


def _reprojection_errors(views: Sequence[View], pixels: Floats, point: Floats) -> Floats:
    """Return the reprojection errors (n,) in pixels, inf behind a camera."""
    seen = np.array([view.project(point) for view in views])
    return np.nan_to_num(np.linalg.norm(seen - pixels, axis=1), nan=np.inf)


def _refine_point(views: Sequence[View], pixels: Floats, point: Floats) -> Floats:
    """Minimise the reprojection error by Gauss-Newton with numeric derivatives."""
    for _ in range(5):
        depth = min(float(view.to_camera(point)[2]) for view in views)
        if depth <= 0:
            return point
        delta = 1e-5 * depth
        base = np.concatenate([view.project(point) for view in views])
        columns = [
            (np.concatenate([view.project(point + delta * axis) for view in views]) - base) / delta
            for axis in np.eye(3)
        ]
        step = np.linalg.lstsq(np.stack(columns, 1), pixels.ravel() - base, rcond=None)[0]
        point = point + step
        if np.linalg.norm(step) < 1e-9 * depth:
            break
    return point
