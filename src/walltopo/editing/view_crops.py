"""A place of the wall in the photos that see it best."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera, View
from walltopo.editing.snapshot import ScanSnapshot
from walltopo.geometry.zbuffer import render_part

Floats = NDArray[np.float64]

LONG_SIDE = 1600  # pixels: photos are read at most this long, as `classify` reads them
LEAST_COSINE = 0.25  # a photo taken along the wall shows nothing of a place
MARGIN_PX = 8  # a place nearer to the border is not looked at
# Of the reach: what stands before the place by more hides it. The place of a hold is the middle of
# its surface, which lies somewhat behind its front.
ON_IT = 0.4


@dataclass(frozen=True, eq=False)
class Look:
    """A window of one photo around a place.

    Parameters
    ----------
    photo : number of the view; name : of the photo.
    picture : (h, w, 3) uint8 sRGB.
    face : (h, w) int32, the mesh's triangle that each pixel sees, -1 = none.
    depth : (h, w) float32, along the viewing direction; inf where none.
    x, y : the place, pixels of the window.
    """

    photo: int
    name: str
    picture: NDArray[np.uint8]
    face: NDArray[np.int32]
    depth: NDArray[np.float32]
    x: float
    y: float


def normal_at(scanned: ScanSnapshot, at: Sequence[float] | Floats, radius: float) -> Floats:
    """(3,) unit: the mean normal of the surface around a place."""
    mesh = scanned.mesh
    rows = scanned.triangles.within(at, radius)
    total = mesh.areas[rows] @ mesh.normals[rows]
    length = float(np.linalg.norm(total))
    return total / length if length > 0 else np.array([0.0, -1.0, 0.0])


def looks_at(
    scanned: ScanSnapshot, at: Sequence[float] | Floats, reach: float, most: int
) -> list[Look]:
    """The photos that show a place largest and least slanted, past what hides it; best first.

    Parameters
    ----------
    at : (3,) world frame, on the surface; reach : how much around it, metres of the world frame.
    most : so many photos at most.
    """
    place = np.asarray(at, dtype=np.float64)
    normal = normal_at(scanned, place, reach / 3)
    ranked = sorted(
        ((_worth(view, place, normal), number) for number, view in enumerate(scanned.views)),
        key=lambda row: (-row[0], row[1]),
    )
    found: list[Look] = []
    for worth, number in ranked[: 3 * most]:
        if worth <= 0 or len(found) == most:
            break
        look = _look(scanned, number, place, reach)
        if look is not None:
            found.append(look)
    return found


def _worth(view: View, place: Floats, normal: Floats) -> float:
    """Pixels per metre of a place, less where it is seen from aside; 0 where it is not."""
    towards = view.centre - place
    distance = float(np.linalg.norm(towards))
    cosine = float(towards @ normal) / max(distance, 1e-9)
    if cosine < LEAST_COSINE or view.to_camera(place)[2] <= 0:
        return 0.0
    x, y = view.project(place).tolist()
    width, height = view.camera.width, view.camera.height
    inside = MARGIN_PX <= x <= width - MARGIN_PX and MARGIN_PX <= y <= height - MARGIN_PX
    return cosine * view.camera.fx / distance if inside else 0.0


def _look(scanned: ScanSnapshot, number: int, place: Floats, reach: float) -> Look | None:
    """The window of a photo; None where something stands before the place."""
    view = scanned.views[number]
    factor = min(1.0, LONG_SIDE / max(view.camera.width, view.camera.height))
    whole = view.camera.scaled(factor)
    local = view.to_camera(place)
    x, y = whole.project(local).tolist()
    half = reach * whole.fx / float(local[2])
    left, top = max(int(x - half), 0), max(int(y - half), 0)
    right, bottom = min(int(x + half) + 2, whole.width), min(int(y + half) + 2, whole.height)
    camera = _window(whole, left, top, right - left, bottom - top)
    face, depth = render_part(scanned.mesh, camera, view.cam_from_world)
    row, column = min(int(y) - top, len(depth) - 1), min(int(x) - left, len(depth[0]) - 1)
    if depth[row, column] < float(local[2]) - ON_IT * reach:
        return None
    photo = scanned.photos.read_rgb(view.name)
    if photo.shape[:2] != (whole.height, whole.width):
        size = (whole.width, whole.height)
        photo = np.asarray(cv2.resize(photo, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    picture = np.ascontiguousarray(photo[top:bottom, left:right])
    return Look(number, view.name, picture, face, depth, x - left, y - top)


def _window(camera: Camera, left: int, top: int, width: int, height: int) -> Camera:
    """The camera of a part of its picture."""
    at = {"SIMPLE_PINHOLE": 1, "SIMPLE_RADIAL": 1, "RADIAL": 1}.get(camera.model, 2)
    params = list(camera.params)
    params[at] -= left
    params[at + 1] -= top
    return Camera(camera.model, width, height, tuple(params))
