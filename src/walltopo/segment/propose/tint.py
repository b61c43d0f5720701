"""How a piece of surface differs in colour from the wall beside it, photo by photo.

Both are taken from one photo, so that neither its exposure nor the light of the place matters; what
several photos agree on is the piece's own paint, what they do not is shade and shine.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import find_objects

from walltopo.core import Mesh, Progress, View
from walltopo.geometry.zbuffer import render_part
from walltopo.images.colour import linear_from_srgb8, oklab_from_linear
from walltopo.scans.photos import PhotoSet

Floats = NDArray[np.float64]

LONG_SIDE = 720  # pixels: photos are looked at this small
LEAST_PIXELS = 12  # of a piece, and of the wall beside it
RING = 0.35  # of a piece's longer side: so far around it is the wall beside
EXPOSED = 0.02  # linear: the piece's light is divided by the wall's, this much more than nothing


@dataclass(frozen=True, eq=False)
class Sight:
    """One photo and what it shows of a mesh.

    Parameters
    ----------
    picture : (h, w, 3) uint8 sRGB; face : (h, w) int32, the triangle of each pixel, -1 = none.
    """

    picture: NDArray[np.uint8]
    face: NDArray[np.int32]


@dataclass(frozen=True)
class Tint:
    """A piece against the wall beside it.

    Parameters
    ----------
    apart : OKLab distance between both, mean over photos of one direction: 0 = of one colour.
    agreement : length of the mean difference over the mean length: 1 = all photos say the same.
    photos : so many show it with the wall beside it.
    """

    apart: float = 0.0
    agreement: float = 0.0
    photos: int = 0


def sights(
    mesh: Mesh, views: Sequence[View], photos: PhotoSet, progress: Progress
) -> Iterator[Sight]:
    """The photos of a scan, one by one, at most `LONG_SIDE` long."""
    progress.step("comparing with the wall in photos", len(views))
    for view in views:
        factor = min(1.0, LONG_SIDE / max(view.camera.width, view.camera.height))
        camera = view.camera.scaled(factor)
        face, _ = render_part(mesh, camera, view.cam_from_world)
        picture = photos.read_rgb(view.name)
        if picture.shape[:2] != face.shape:
            size = (camera.width, camera.height)
            picture = np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)
        yield Sight(picture, face)
        progress.advance()


def tints(
    seen: Iterable[Sight], label: NDArray[np.int32], wall: NDArray[np.bool_]
) -> dict[int, Tint]:
    """The tint of each piece that a photo shows.

    Parameters
    ----------
    label : (F,) int32, the piece of each triangle, 0 = none.
    wall : (F,) bool, triangles that are of the wall.
    """
    ground = np.where(label > 0, label, np.where(wall, -1, 0)).astype(np.int32)
    rows: dict[int, list[Floats]] = {}
    for sight in seen:
        drawn = np.where(sight.face >= 0, ground[np.maximum(sight.face, 0)], 0).astype(np.int32)
        for number, difference in _differences(sight.picture, drawn):
            rows.setdefault(number, []).append(difference)
    return {number: _agreed(np.array(own)) for number, own in rows.items()}


def _agreed(rows: Floats) -> Tint:
    """What (n, 3) differences of n photos say together."""
    middle = np.median(rows, axis=0)
    lengths = np.linalg.norm(rows, axis=1)
    apart = float(np.linalg.norm(middle))
    return Tint(apart, min(1.0, apart / max(float(np.median(lengths)), 1e-6)), len(rows))


def _differences(picture: NDArray[np.uint8], drawn: NDArray[np.int32]) -> list[tuple[int, Floats]]:
    """Per piece in a photo, its OKLab minus that of the wall beside it, as under one light."""
    found = []
    height, width = drawn.shape
    for number, box in enumerate(find_objects(np.maximum(drawn, 0)), start=1):
        if box is None:
            continue
        rows, columns = box
        pad = max(4, round(RING * max(rows.stop - rows.start, columns.stop - columns.start)))
        top, left = max(rows.start - pad, 0), max(columns.start - pad, 0)
        window = np.s_[top : min(rows.stop + pad, height), left : min(columns.stop + pad, width)]
        own = drawn[window] == number
        beside = drawn[window] == -1
        if own.sum() < LEAST_PIXELS or beside.sum() < LEAST_PIXELS:
            continue
        linear = linear_from_srgb8(picture[window].reshape(-1, 3))
        piece = np.median(linear[own.ravel()], axis=0)
        wall = np.median(linear[beside.ravel()], axis=0)
        # As if the wall were of middle grey: what is left is paint against paint.
        light = max(float(wall.mean()), 1e-4) / 0.4
        pair = oklab_from_linear(np.stack([piece, wall]) / light)
        found.append((number, pair[0] - pair[1]))
    return found
