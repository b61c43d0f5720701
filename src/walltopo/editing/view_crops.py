"""Crops of photos around a place of the wall."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera, View
from walltopo.describe.classify.observations import HoldView
from walltopo.editing.messages import Crop
from walltopo.editing.snapshot import ScanSnapshot
from walltopo.geometry.zbuffer import render_culled
from walltopo.scans.edits import Place
from walltopo.scans.hidden import HiddenPlace, hide_in_photo

Floats = NDArray[np.float64]

LONG_SIDE = 1600  # pixels: maximum length of a photo, as in `classify`
MIN_COSINE = 0.25  # a photo taken more along the wall is useless
MARGIN_PX = 8  # a place nearer to the photo's border is skipped
# Share of the reach: surface nearer to the camera by more than this hides the place. The place of a
# hold is the centroid of its surface, which lies somewhat behind its front.
OCCLUSION_DEPTH = 0.4


@dataclass(frozen=True, eq=False)
class ViewCrop:
    """A window of one photo around a place.

    Parameters
    ----------
    photo : number of the view; name : of the photo.
    picture : (h, w, 3) uint8 sRGB.
    face : (h, w) int32, the mesh's triangle at each pixel, -1 = none.
    depth : (h, w) float32, along the viewing direction; inf without a triangle.
    x, y : the place, pixels of the window.
    """

    photo: int
    name: str
    picture: NDArray[np.uint8]
    face: NDArray[np.int32]
    depth: NDArray[np.float32]
    x: float
    y: float


def normal_at(snapshot: ScanSnapshot, at: Sequence[float] | Floats, radius: float) -> Floats:
    """Return the mean unit normal (3,) of the surface around a place."""
    mesh = snapshot.mesh
    rows = snapshot.triangles.within(at, radius)
    total = mesh.areas[rows] @ mesh.normals[rows]
    length = float(np.linalg.norm(total))
    return total / length if length > 0 else np.array([0.0, -1.0, 0.0])


def view_crops(
    snapshot: ScanSnapshot,
    at: Sequence[float] | Floats,
    reach: float,
    max_photos: int,
    hidden: Sequence[HiddenPlace] = (),
) -> list[ViewCrop]:
    """Return crops of the unoccluded photos that show a place largest and most frontally.

    Parameters
    ----------
    at : (3,) world frame, on the surface; reach : half the side of the crop, world units.
    max_photos : maximum number of crops.
    hidden : places that the crops must not show.
    """
    place = np.asarray(at, dtype=np.float64)
    normal = normal_at(snapshot, place, reach / 3)
    ranked = sorted(
        (
            (_pixels_per_metre(view, place, normal), number)
            for number, view in enumerate(snapshot.views)
        ),
        key=lambda row: (-row[0], row[1]),
    )
    found: list[ViewCrop] = []
    for detail, number in ranked[: 3 * max_photos]:
        if detail <= 0 or len(found) == max_photos:
            break
        crop = _crop_photo(snapshot, number, place, reach, hidden)
        if crop is not None:
            found.append(crop)
    return found


def _pixels_per_metre(view: View, place: Floats, normal: Floats) -> float:
    """Return the pixels per metre at a place, less at a slant; 0 if the photo does not show it."""
    towards = view.centre - place
    distance = float(np.linalg.norm(towards))
    cosine = float(towards @ normal) / max(distance, 1e-9)
    if cosine < MIN_COSINE or view.to_camera(place)[2] <= 0:
        return 0.0
    x, y = view.project(place).tolist()
    width, height = view.camera.width, view.camera.height
    inside = MARGIN_PX <= x <= width - MARGIN_PX and MARGIN_PX <= y <= height - MARGIN_PX
    return cosine * view.camera.fx / distance if inside else 0.0


def _crop_photo(
    snapshot: ScanSnapshot,
    number: int,
    place: Floats,
    reach: float,
    hidden: Sequence[HiddenPlace],
) -> ViewCrop | None:
    """Return a crop of a photo, or None if a nearer surface hides the place."""
    view = snapshot.views[number]
    factor = min(1.0, LONG_SIDE / max(view.camera.width, view.camera.height))
    whole = view.camera.scaled(factor)
    local = view.to_camera(place)
    x, y = whole.project(local).tolist()
    half = reach * whole.fx / float(local[2])
    left, top = max(int(x - half), 0), max(int(y - half), 0)
    right, bottom = min(int(x + half) + 2, whole.width), min(int(y + half) + 2, whole.height)
    camera = _crop_camera(whole, left, top, right - left, bottom - top)
    face, depth = render_culled(snapshot.mesh, camera, view.cam_from_world)
    row, column = min(int(y) - top, len(depth) - 1), min(int(x) - left, len(depth[0]) - 1)
    if depth[row, column] < float(local[2]) - OCCLUSION_DEPTH * reach:
        return None
    photo = snapshot.photos.read_rgb(view.name)
    if photo.shape[:2] != (whole.height, whole.width):
        size = (whole.width, whole.height)
        photo = np.asarray(cv2.resize(photo, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    picture = np.ascontiguousarray(photo[top:bottom, left:right])
    if hidden:
        picture = hide_in_photo(picture, View(view.name, camera, view.cam_from_world), hidden)
    return ViewCrop(number, view.name, picture, face, depth, x - left, y - top)


def _crop_camera(camera: Camera, left: int, top: int, width: int, height: int) -> Camera:
    """Return the camera of a crop of the photo."""
    at = {"SIMPLE_PINHOLE": 1, "SIMPLE_RADIAL": 1, "RADIAL": 1}.get(camera.model, 2)
    params = list(camera.params)
    params[at] -= left
    params[at + 1] -= top
    return Camera(camera.model, width, height, tuple(params))


REACH = 0.4  # metres around the place
MAX_CROPS = 4
LONGEST = 480  # pixels
QUALITY = 82
_CUTOUTS: WeakKeyDictionary[HoldView, str] = WeakKeyDictionary()


def crops_of(snapshot: ScanSnapshot, at: Place, hidden: Sequence[HiddenPlace] = ()) -> list[Crop]:
    """Return crops of the photos that show a place best, best first; empty if no photo does.

    Parameters
    ----------
    hidden : places that the crops must not show.
    """
    found = []
    for crop in view_crops(snapshot, at, REACH * snapshot.unit, MAX_CROPS, hidden):
        height, width = crop.picture.shape[:2]
        factor = min(1.0, LONGEST / max(height, width))
        size = max(1, round(width * factor)), max(1, round(height * factor))
        small = cv2.resize(crop.picture, size, interpolation=cv2.INTER_AREA)
        bgr = np.asarray(cv2.cvtColor(small, cv2.COLOR_RGB2BGR), dtype=np.uint8)
        url = _data_url("jpeg", bgr, cv2.IMWRITE_JPEG_QUALITY)
        found.append(Crop(crop.name, url, round(crop.x / width, 4), round(crop.y / height, 4)))
    return found


def cutout_of(view: HoldView | None) -> str:
    """Return a hold's cutout as a data URL; empty without a view."""
    if view is None:
        return ""
    if view not in _CUTOUTS:
        alpha = np.where(view.mask, 255, 0).astype(np.uint8)
        bgra = np.dstack([view.crop[..., ::-1], alpha])
        _CUTOUTS[view] = _data_url("webp", bgra, cv2.IMWRITE_WEBP_QUALITY)
    return _CUTOUTS[view]


def _data_url(kind: str, picture: NDArray[np.uint8], quality: int) -> str:
    _, data = cv2.imencode(f".{kind}", picture, [quality, QUALITY])
    return f"data:image/{kind};base64," + base64.b64encode(data.tobytes()).decode("ascii")
