"""Read the photos: the pixels of each hold, and one light for all photos.

The same patch of wall must look the same in all photos. With log values
`seen[patch, photo] = gain[photo] + own[patch]` per channel, least absolute deviations (reweighted
least squares) find both terms. This removes exposure and white balance without knowledge of the
wall's colour. One gain for the whole scan remains undetermined; the median photo fixes it, so that
the scan keeps the white balance that the phone chose on average.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, Progress, View
from walltopo.describe.classify.observations import (
    HoldView,
    WallLight,
    load_photo,
    read_hold_views,
    wall_patches,
)
from walltopo.describe.settings import ClassifySettings
from walltopo.scans.photos import PhotoSet
from walltopo.scans.pictures import SceneLight

Floats = NDArray[np.float64]

ROUNDS = 25
TINT_RADIUS = 1.0  # metres: spread of the window for the wall's tint


def _solve_gains(
    photo: NDArray[np.int64], patch: NDArray[np.int64], seen: Floats
) -> tuple[Floats, Floats]:
    """Return gains and own values (log) of one channel by reweighted least squares."""
    photos, patches = int(photo.max()) + 1, int(patch.max()) + 1
    gain, own = np.zeros(photos), np.zeros(patches)
    weight = np.ones(len(seen))
    for _ in range(ROUNDS):
        for _ in range(4):
            total = np.bincount(patch, weight, patches)
            own = np.bincount(patch, weight * (seen - gain[photo]), patches) / np.maximum(
                total, 1e-12
            )
            total = np.bincount(photo, weight, photos)
            gain = np.bincount(photo, weight * (seen - own[patch]), photos) / np.maximum(
                total, 1e-12
            )
        weight = 1 / np.maximum(np.abs(seen - gain[photo] - own[patch]), 0.02)
    return gain, own


def solve_light(lights: Sequence[WallLight], photos: int, patch_centres: Floats) -> SceneLight:
    """Return the gains of the photos and the wall's own colours.

    Parameters
    ----------
    lights : the wall's patches in each photo.
    photos : number of photos.
    patch_centres : (patches, 3) float64, world frame.
    """
    gain = np.zeros((photos, 3))
    measured = [light for light in lights if len(light.patch)]
    if not measured:
        return SceneLight(gain, np.zeros((0, 3)), np.zeros((0, 3)))
    photo = np.concatenate([np.full(len(light.patch), light.photo) for light in measured])
    patch = np.concatenate([light.patch for light in measured])
    seen = np.concatenate([light.log_rgb for light in measured])
    rows, compact = np.unique(patch, return_inverse=True)
    own = np.zeros((len(rows), 3))
    known = np.unique(photo)
    for channel in range(3):
        solved, own[:, channel] = _solve_gains(photo, compact, seen[:, channel])
        middle = float(np.median(solved[known]))
        gain[known, channel] = solved[known] - middle
        own[:, channel] += middle
    luminance = np.log(np.exp(own) @ np.array([0.2126, 0.7152, 0.0722]))
    wall = float(np.exp(np.median(luminance)))
    return SceneLight(gain, patch_centres[rows], own, wall)


LONG_SIDE = 1600  # pixels: maximum length of a photo

ERODE = 2  # pixels removed from the rim of a hold before its colour is read

PATCHES = 60  # wall patches along the longest side of the wall


def observe(
    views: Sequence[View],
    photos: PhotoSet,
    mesh: Mesh,
    face_instance: NDArray[np.int32],
    settings: ClassifySettings,
    progress: Progress,
) -> tuple[dict[int, list[HoldView]], SceneLight]:
    """Return the views of each hold in all photos, and the light of the photos."""
    progress.step("read holds in photos", len(views))
    hold_views: dict[int, list[HoldView]] = {}
    lights = []

    def load(view: View, width: int, height: int) -> NDArray[np.uint8]:
        return load_photo(photos.path(view.name), width, height)

    def hidden(view: View, width: int, height: int) -> NDArray[np.bool_] | None:
        return photos.people_mask(view.name, width, height)

    patch_of = wall_patches(mesh, face_instance, PATCHES)
    stream = read_hold_views(
        views,
        load,
        mesh,
        face_instance,
        patch_of,
        long_side=LONG_SIDE,
        erode=ERODE,
        crop_px=settings.cutout_px,
        hidden=hidden,
    )
    for holds, light in stream:
        for hold in holds:
            hold_views.setdefault(hold.hold, []).append(hold)
        lights.append(light)
        progress.advance()
    return hold_views, solve_light(lights, len(views), _patch_centres(mesh, patch_of))


def _patch_centres(mesh: Mesh, patch_of: NDArray[np.int32]) -> Floats:
    """Return the (n, 3) centres of the patches."""
    number = patch_of + 1  # holds first
    total = np.bincount(number)[1:]
    sums = [np.bincount(number, axis)[1:] for axis in mesh.centroids.T]
    return np.asarray(np.stack(sums, axis=1) / total[:, None])
