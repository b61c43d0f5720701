"""Compute the depth of one photo from one partner by semi-global matching."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import View
from walltopo.geometry.kernels import in_ranges, kernel
from walltopo.reconstruct.dense.rectify import Rectified, rectify

Floats = NDArray[np.float64]
Image = NDArray[np.uint8]
Depth = NDArray[np.float32]

_BLOCK = 5
# Matching windows this close to a photo's border (pixels) include the black around the photo.
_RIM = 4
_UNIQUENESS = 6
_SPECKLE_AREA = 200
# Grey values of clipped black and white after sensor noise and JPEG, and the side of the smallest
# clipped square, pixels. The square is larger than the dark spots of black holds.
_BLACK, _WHITE = 8, 250
_CLIPPED_SIDE = 15


def undistort(image: Image, view: View, size: tuple[int, int] | None = None) -> tuple[Image, View]:
    """Return the photo resized and without lens distortion, and its pinhole view.

    Parameters
    ----------
    image : (H, W) or (H, W, 3) uint8, the distorted photo.
    view : view of the photo, with the photo's size.
    size : (width, height) of the result; the photo's own if None.
    """
    camera = view.camera
    width, height = size or (camera.width, camera.height)
    pinhole = camera.pinhole().scaled(width / camera.width, height / camera.height)
    resized = camera.scaled(width / camera.width, height / camera.height)
    new = View(view.name, pinhole, view.cam_from_world)
    if (height, width) != image.shape[:2]:
        image = np.asarray(cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA))
    if camera.is_pinhole:
        return image, new
    u, v = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    rays = np.stack([(u - pinhole.cx) / pinhole.fx, (v - pinhole.cy) / pinhole.fy, np.ones_like(u)])
    source = resized.project(np.moveaxis(rays, 0, -1)).astype(np.float32) - 0.5
    straight = cv2.remap(image, source[..., 0], source[..., 1], cv2.INTER_CUBIC)
    return np.asarray(straight, dtype=np.uint8), new


def clipped_mask(image: Image) -> NDArray[np.bool_]:
    """Return a (H, W) mask of the areas of a grey photo that are clipped to black or white.

    Clipped areas, such as the void beside a wall, a lamp or a window, have no texture to match.
    Stereo would extrapolate the depth of their surroundings into them.
    """
    square = np.ones((_CLIPPED_SIDE, _CLIPPED_SIDE), dtype=np.uint8)
    extremes = [(image <= _BLACK).astype(np.uint8), (image >= _WHITE).astype(np.uint8)]
    opened = [cv2.morphologyEx(mask, cv2.MORPH_OPEN, square) for mask in extremes]
    return np.asarray((opened[0] > 0) | (opened[1] > 0))


def _match_disparity(left: Image, right: Image, count: int) -> Depth:
    """Return the disparity of the left image by StereoSGBM, in pixels, NaN if unknown."""
    matcher = cv2.StereoSGBM.create(
        minDisparity=0,
        numDisparities=count,
        blockSize=_BLOCK,
        P1=8 * _BLOCK * _BLOCK,
        P2=40 * _BLOCK * _BLOCK,
        disp12MaxDiff=1,
        preFilterCap=31,
        uniquenessRatio=_UNIQUENESS,
        speckleWindowSize=_SPECKLE_AREA,
        speckleRange=1,
        mode=cv2.STEREO_SGBM_MODE_SGBM_3WAY,
    )
    fixed = matcher.compute(left, right)
    return np.where(fixed >= 0, fixed.astype(np.float32) / 16.0, np.nan).astype(np.float32)


def _filled_disparity(left: Image, right: Image, count: int) -> Depth:
    """Return the disparity of the left image, filled from half size where full size fails.

    Matching at half size succeeds on texture that is too fine or too faint at full size.
    """
    full = _match_disparity(left, right, count)
    height, width = left.shape
    half_size = (width + 1) // 2, (height + 1) // 2
    small = [
        np.asarray(cv2.resize(i, half_size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
        for i in (left, right)
    ]
    # At half size the empty columns on the left are half as many; round them up to 16.
    coarse = _match_disparity(small[0], small[1], (count // 2 + 15) // 16 * 16)
    coarse = np.asarray(cv2.resize(coarse, (width, height), interpolation=cv2.INTER_LINEAR)) * (
        width / half_size[0]
    )
    return np.where(np.isnan(full), coarse, full).astype(np.float32)


def match_pair(image: Image, view: View, other: Image, partner: View, points: Floats) -> Depth:
    """Compute the depth map of `view` from one partner.

    Parameters
    ----------
    image, other : (H, W) uint8 grey photos without distortion.
    view, partner : their pinhole views.
    points : (n, 3) world points that `view` sees; they bound the disparity search.

    Returns
    -------
    (H, W) float32 z-depth in the view's camera frame, NaN where unknown.
    """
    pair = rectify(view, partner, points)
    if pair is None:
        return np.full(image.shape, np.nan, dtype=np.float32)
    size = (pair.width, pair.height)
    left = cv2.warpPerspective(image, pair.left, size, flags=cv2.INTER_CUBIC)
    right = cv2.warpPerspective(other, pair.right, size, flags=cv2.INTER_CUBIC)
    disparity = _filled_disparity(np.asarray(left), np.asarray(right), pair.disparities)
    inside = [_photo_mask(home, image.shape, size) for home in (pair.left, pair.right)]
    in_ranges(_mask_outside, len(disparity), *inside, disparity)
    return _to_photo(disparity, pair, view)


def _photo_mask(homography: Floats, shape: tuple[int, ...], size: tuple[int, int]) -> Image:
    """Return a (h, w) mask, nonzero where a rectified pixel lies inside the photo."""
    whole = np.full(shape, 255, dtype=np.uint8)
    whole[:_RIM], whole[-_RIM:], whole[:, :_RIM], whole[:, -_RIM:] = 0, 0, 0, 0
    warped = cv2.warpPerspective(whole, homography, size, flags=cv2.INTER_NEAREST)
    return np.asarray(warped, dtype=np.uint8)


@kernel
def _mask_outside(begin: Any, end: Any, left: Any, right: Any, disparity: Any) -> None:
    """Set disparities to NaN if their pixel lies outside the photo's border in either photo.

    Beyond the border both images are black, and black matches black. `disparity` is the left
    photo's column minus the right photo's column, pixels.
    """
    last = disparity.shape[1] - 1
    for row in range(begin, end):
        for column in range(disparity.shape[1]):
            there = np.float32(column) - disparity[row, column]
            inside = there >= 0 and left[row, column] > 0  # not so for NaN
            if not inside or right[row, min(int(np.rint(there)), last)] == 0:
                disparity[row, column] = np.nan


def _to_photo(disparity: Depth, pair: Rectified, view: View) -> Depth:
    """Resample the rectified disparity into the photo's pixels and convert it to depth.

    Both frames share their centre, so a homography maps photo pixels to rectified pixels.
    """
    shape = (view.camera.width, view.camera.height)
    inverse = cv2.WARP_INVERSE_MAP | cv2.INTER_LINEAR
    # The border is NaN, and one NaN among the four neighbours makes the result NaN. So no depth is
    # interpolated across a gap.
    found = cv2.warpPerspective(disparity, pair.left, shape, flags=inverse, borderValue=np.nan)
    nearest = cv2.warpPerspective(
        disparity,
        pair.left,
        shape,
        flags=cv2.WARP_INVERSE_MAP | cv2.INTER_NEAREST,
        borderValue=np.nan,
    )
    depth = np.full(found.shape, np.nan, dtype=np.float32)
    in_ranges(
        _depths,
        len(depth),
        found,
        nearest,
        (pair.plane @ pair.left).astype(np.float32),
        pair.left[2].astype(np.float32),
        np.float32(pair.stretch),
        float(pair.scale),
        depth,
    )
    return depth


@kernel
def _depths(
    begin: Any,
    end: Any,
    found: Any,
    nearest: Any,
    plane: Any,
    ahead: Any,
    stretch: Any,
    scale: Any,
    depth: Any,
) -> None:
    """Fill rows of `depth` from the disparity, interpolated or at least from the nearest pixel.

    In homogeneous photo pixels q the rectified pixel is (left q) / (left q)_z, and a photo's ray of
    depth 1 has the rectified depth (left q)_z. Both divisions cancel:
    z = scale / (plane . left q + stretch * found * (left q)_z).
    """
    for row in range(begin, end):
        v = np.float32(row)
        for column in range(found.shape[1]):
            u, value = np.float32(column), found[row, column]
            # Interpolation across a depth edge would invent a depth; use the nearest disparity.
            if not abs(value - nearest[row, column]) < 1.0:
                value = nearest[row, column]
            full = plane[0] * u + plane[1] * v + plane[2]
            full += stretch * value * (ahead[0] * u + ahead[1] * v + ahead[2])
            if full > np.float32(1e-6):
                depth[row, column] = scale / full
