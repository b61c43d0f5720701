"""Read the photos once: the pixels of each hold, and the light of the wall around it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, Progress, View
from walltopo.describe.classify.light import solve_light
from walltopo.describe.classify.observations import HoldView, load_photo, look, wall_patches
from walltopo.describe.classify.settings import ClassifySettings
from walltopo.scans.light import SceneLight
from walltopo.scans.photos import PhotoSet

Floats = NDArray[np.float64]

LONG_SIDE = 1600  # pixels: photos are read at most this long


ERODE = 2  # pixels taken off the rim of a hold before its colour is read


PATCHES = 60  # wall patches along the longest side of the wall


def observe(
    views: Sequence[View],
    photos: PhotoSet,
    mesh: Mesh,
    face_instance: NDArray[np.int32],
    settings: ClassifySettings,
    progress: Progress,
) -> tuple[dict[int, list[HoldView]], SceneLight]:
    """What all photos show of each hold, and the light they were taken in."""
    progress.step("reading holds in photos", len(views))
    seen: dict[int, list[HoldView]] = {}
    lights = []

    def load(view: View, width: int, height: int) -> NDArray[np.uint8]:
        return load_photo(photos.path(view.name), width, height)

    stream = look(
        views,
        load,
        mesh,
        face_instance,
        long_side=LONG_SIDE,
        erode=ERODE,
        crop_px=settings.cutout_px,
    )
    for holds, light in stream:
        for hold in holds:
            seen.setdefault(hold.hold, []).append(hold)
        lights.append(light)
        progress.advance()
    centres, size = _patch_centres(mesh, face_instance)
    return seen, solve_light(lights, len(views), centres, size)


def _patch_centres(mesh: Mesh, face_instance: NDArray[np.int32]) -> tuple[Floats, float]:
    patch = wall_patches(mesh, face_instance, PATCHES)
    rows = patch >= 0
    count = int(patch.max(initial=-1)) + 1
    total = np.maximum(np.bincount(patch[rows], minlength=count), 1)
    sums = [np.bincount(patch[rows], mesh.centroids[rows, k], count) for k in range(3)]
    size = float(np.ptp(mesh.vertices, axis=0).max()) / PATCHES
    return np.stack(sums, axis=1) / total[:, None], size
