"""Rectify stereo pairs: rotate both photos so that a point lies in the same row of both.

After Fusiello, Trucco and Verri, "A compact algorithm for rectification of stereo pairs", 2000.
All homographies here use OpenCV's convention: pixel (0, 0) is the centre of the first pixel.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera, View

Floats = NDArray[np.float64]

# A rectified canvas larger than this many photos is reduced, down to a zoom of _MIN_ZOOM.
_MAX_CANVAS = 1.6
_MIN_ZOOM = 0.4
# With fewer common points the range of disparities is unknown.
_MIN_POINTS = 12
# Points closer to the baseline's direction than this (cosine) are ignored.
_MAX_FORWARD = 0.96
# Points farther from the rectified axis than this (cosine) would stretch the canvas too much.
_MIN_AHEAD = 0.45
# Minimum ratio of column widths between the photos; a more oblique surface cannot be matched.
_MIN_STRETCH = 0.25
# Margin of the disparity search beyond the sparse points: pixels, and share of their range.
_MARGIN_PIXELS = 6.0
_MARGIN_SHARE = 0.2
# Margin of the canvas beyond the sparse points, as a share of their extent.
_POINT_SLACK = 0.15


@dataclass(frozen=True, eq=False)
class Rectified:
    """The geometry of a rectified pair; the reference photo is always on the left.

    Parameters
    ----------
    left, right : (3, 3) homographies from photo pixels to rectified pixels.
    rotation : (3, 3) from the reference camera frame to the rectified frame.
    width, height : rectified size, pixels.
    scale : focal length times baseline: z_rectified = scale / (full disparity).
    plane : (3,) a, b, c and
    stretch : the full disparity is a * u + b * v + c + stretch * (measured disparity).
    disparities : number of disparities to search, multiple of 16.
    """

    left: Floats
    right: Floats
    rotation: Floats
    width: int
    height: int
    scale: float
    plane: Floats
    stretch: float
    disparities: int


def opencv_matrix(camera: Camera) -> Floats:
    """Return the (3, 3) calibration matrix in OpenCV's pixel convention."""
    matrix = camera.matrix()
    matrix[:2, 2] -= 0.5
    return matrix


def _rectified_rotation(view: View, partner: View, points: Floats) -> Floats | None:
    """Return the (3, 3) world-to-rectified rotation: x along the baseline, z towards the points."""
    x = partner.centre - view.centre
    x = x / np.linalg.norm(x)
    partner_pixels = partner.project(points)
    inside = (partner_pixels >= 0) & (
        partner_pixels <= [partner.camera.width, partner.camera.height]
    )
    rays = points[inside.all(axis=1)] - view.centre
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    rays = rays[np.abs(rays @ x) < _MAX_FORWARD]
    if len(rays) < _MIN_POINTS:
        return None
    z = rays.mean(axis=0)
    z = z - x * (x @ z)
    length = float(np.linalg.norm(z))
    if length < 1e-6:
        return None
    z = z / length
    return np.stack([x, np.cross(z, x), z])


def _outline_bounds(homography: Floats, camera: Camera) -> tuple[Floats, Floats]:
    """Return the minimum and maximum corner (2,) of a photo's outline after a homography."""
    w, h = camera.width, camera.height
    corners = np.array([[0, 0, 1], [w, 0, 1], [0, h, 1], [w, h, 1]], dtype=float) @ homography.T
    if (corners[:, 2] <= 1e-6).any():
        return np.full(2, -np.inf), np.full(2, np.inf)
    corners = corners[:, :2] / corners[:, 2:]
    return corners.min(axis=0), corners.max(axis=0)


def _rectifying_homography(camera: Camera, turn: Floats, focal: float) -> Floats:
    """Return the map from photo pixels to those of a turned camera with this focal length."""
    return np.diag([focal, focal, 1.0]) @ turn @ np.linalg.inv(opencv_matrix(camera))


def rectify(view: View, partner: View, points: Floats, zoom: float = 1.0) -> Rectified | None:
    """Rectify a pair of pinhole views for the surface near some points.

    A plane's disparity is linear in the rectified pixel. The partner's rows are shifted and
    stretched so that the plane through the points has zero disparity. So the search covers only the
    relief of the wall, even if the wall is seen obliquely.

    Parameters
    ----------
    view, partner : pinhole views of the same image size; `view` gets the depth map.
    points : (n, 3) world points that `view` sees.
    zoom : approximate rectified pixels per photo pixel. A baseline towards the wall stretches one
        side of the canvas; the zoom is then reduced automatically.

    Returns
    -------
    Rectified, or None if the pair's geometry is unsuitable for stereo.
    """
    frame = _rectified_rotation(view, partner, points)
    if frame is None:
        return None
    turn_left = frame @ view.cam_from_world[:, :3].T
    turn_right = frame @ partner.cam_from_world[:, :3].T
    focal = view.camera.fx * zoom
    left = _rectifying_homography(view.camera, turn_left, focal)
    right = _rectifying_homography(partner.camera, turn_right, focal)
    scale = focal * float(np.linalg.norm(partner.centre - view.centre))
    uvd = _point_disparities(view, partner, frame, points, focal, scale)
    fitted = None if uvd is None else _fit_plane(uvd)
    if uvd is None or fitted is None:
        return None
    plane, smallest, largest = fitted
    stretch = 1.0 - float(plane[0])
    # After the shear, the plane's points have the same column in both photos.
    shear = np.array([[1.0, plane[1], plane[2]], [0, stretch, 0], [0, 0, stretch]]) / stretch
    right = shear @ right
    box = _common_box(left, right, view, partner, uvd)
    count = int(np.ceil((largest - smallest) / 16.0)) * 16
    width, height = int(box[2] - box[0]) + count, int(box[3] - box[1])
    area = view.camera.width * view.camera.height
    if min(width - count, height) < 32 * zoom or zoom < _MIN_ZOOM:
        return None
    if width * height > _MAX_CANVAS * area:
        smaller = 0.95 * zoom * np.sqrt(_MAX_CANVAS * area / (width * height))
        return rectify(view, partner, points, smaller)
    # StereoSGBM yields no disparity in the first `count` columns; leave them empty.
    move = np.array([[1, 0, count - box[0]], [0, 1, -box[1]], [0, 0, 1.0]])
    nearer = np.array([[1, 0, smallest], [0, 1, 0], [0, 0, 1.0]])
    offset = plane[2] + stretch * smallest - (plane[0] * move[0, 2] + plane[1] * move[1, 2])
    return Rectified(
        left=move @ left,
        right=move @ nearer @ right,
        rotation=turn_left,
        width=width,
        height=height,
        scale=scale,
        plane=np.array([plane[0], plane[1], offset]),
        stretch=stretch,
        disparities=count,
    )


def _point_disparities(
    view: View, partner: View, frame: Floats, points: Floats, focal: float, scale: float
) -> Floats | None:
    """Return the (n, 3) rectified column, row and disparity of the points in both photos."""
    partner_pixels = partner.project(points)
    inside = (partner_pixels >= 0) & (
        partner_pixels <= [partner.camera.width, partner.camera.height]
    )
    turned = (points[inside.all(axis=1)] - view.centre) @ frame.T
    turned = turned[turned[:, 2] > _MIN_AHEAD * np.linalg.norm(turned, axis=1)]
    if len(turned) < _MIN_POINTS:
        return None
    z = turned[:, 2]
    return np.stack([focal * turned[:, 0] / z, focal * turned[:, 1] / z, scale / z], axis=1)


def _fit_plane(uvd: Floats) -> tuple[Floats, float, float] | None:
    """Fit a robust plane to the disparities and measure the range of the residuals.

    Returns
    -------
    (3,) a, b, c with disparity ~ a * u + b * v + c, then the smallest and largest residual in
    stretched pixels, with margins; None if the plane is too oblique.
    """
    design = np.column_stack([uvd[:, :2], np.ones(len(uvd))])
    weight = np.ones(len(uvd))
    plane = np.zeros(3)
    for _ in range(10):
        root = np.sqrt(weight)[:, None]
        plane = np.linalg.lstsq(design * root, uvd[:, 2] * root[:, 0], rcond=None)[0]
        residual = np.abs(uvd[:, 2] - design @ plane)
        spread = max(float(np.median(residual)), 1.0)
        weight = 1.0 / (1.0 + (residual / (2.0 * spread)) ** 2)
    stretch = 1.0 - plane[0]
    if not _MIN_STRETCH < stretch < 1.0 / _MIN_STRETCH:
        return None
    smallest, largest = np.percentile((uvd[:, 2] - design @ plane) / stretch, [0.5, 99.5])
    margin = _MARGIN_PIXELS + _MARGIN_SHARE * (largest - smallest)
    return plane, float(smallest - margin), float(largest + margin)


def _common_box(left: Floats, right: Floats, view: View, partner: View, uvd: Floats) -> Floats:
    """Return the box x0, y0, x1, y1 of rectified pixels that may have a match in the partner."""
    low, high = _outline_bounds(left, view.camera)
    low_other, high_other = _outline_bounds(right, partner.camera)
    near, far = uvd[:, :2].min(axis=0), uvd[:, :2].max(axis=0)
    slack = _POINT_SLACK * (far - near)
    low = np.maximum(np.maximum(low, low_other), near - slack)
    high = np.minimum(np.minimum(high, high_other), far + slack)
    return np.concatenate([np.floor(low), np.ceil(high)])
