"""`hidden.json`: places that nobody may see, such as a person who was photographed by chance."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import cv2
import msgspec
import numpy as np
from numpy.typing import NDArray

from walltopo.core import View
from walltopo.images.fill import hide_pixels
from walltopo.scans.document import Document
from walltopo.scans.edits import Place, Radius

Bools = NDArray[np.bool_]
Floats = NDArray[np.float64]
_MIN_DEPTH = 1e-3  # world units in front of a camera; nearer points have no useful pixel
# Directions from a ball's centre whose pixels outline it: (n, 3) unit, spread evenly over the
# sphere (a Fibonacci lattice).
_COUNT = 200
_STEP = np.arange(_COUNT) + 0.5
_HEIGHT = 1 - 2 * _STEP / _COUNT
_TURN = np.pi * (1 + np.sqrt(5)) * _STEP
_ACROSS = np.sqrt(1 - _HEIGHT**2)
_SPHERE = np.stack([_ACROSS * np.cos(_TURN), _ACROSS * np.sin(_TURN), _HEIGHT], axis=1)
# The hull of so many points lies inside the ball's outline by less than this share.
_HULL_MARGIN = 1.03


class HiddenPlace(msgspec.Struct, frozen=True):
    """A ball around a place of the wall; world frame, metres (scan units without a scale)."""

    at: Place
    radius_m: Radius


class HiddenPlaces(Document, frozen=True, kw_only=True):
    """`hidden.json`; absent without any hidden place."""

    places: Annotated[tuple[HiddenPlace, ...], msgspec.Meta(min_length=1)]


def are_hidden(points: Floats, places: Sequence[HiddenPlace]) -> Bools:
    """Return (n,) which of (n, 3) world points lie in a hidden place."""
    from scipy.spatial import cKDTree

    inside = np.zeros(len(points), dtype=bool)
    for radius in sorted({place.radius_m for place in places}):
        centres = [place.at for place in places if place.radius_m == radius]
        distance, _ = cKDTree(centres).query(points, distance_upper_bound=radius * (1 + 1e-9))
        inside |= np.isfinite(distance)
    return inside


def hidden_pixels(view: View, places: Sequence[HiddenPlace]) -> Bools:
    """Return the (H, W) pixels of a photo that show hidden places, or would show them if nothing
    was in front."""
    height, width = view.camera.height, view.camera.width
    mask = np.zeros((height, width), dtype=np.uint8)
    for place in places:
        surface = view.to_camera(np.array(place.at)) + place.radius_m * _HULL_MARGIN * _SPHERE
        pixels = view.camera.project(surface[surface[:, 2] > _MIN_DEPTH])
        # OpenCV's polygons take whole numbers of a moderate size.
        pixels = np.clip(pixels[np.isfinite(pixels).all(axis=1)], -4 * width, 5 * width)
        if len(pixels) >= 3:
            hull = cv2.convexHull(np.floor(pixels).astype(np.int32))
            cv2.fillConvexPoly(mask, hull, 1)
            cv2.polylines(mask, [hull], isClosed=True, color=1, thickness=3)  # rounding
    return mask > 0


def hide_in_photo(
    photo: NDArray[np.uint8], view: View, places: Sequence[HiddenPlace]
) -> NDArray[np.uint8]:
    """Return a photo with its hidden places replaced by smooth colours of what is around them.

    Parameters
    ----------
    photo : (H, W, 3) uint8 RGB, of the size of the view's camera; returned itself if it shows none.
    """
    mask = hidden_pixels(view, places)
    return hide_pixels(photo, mask) if mask.any() else photo
