"""One light for all photos: gains per photo, and the brightness over the wall.

The same patch of wall must look the same in all photos. With log values
`seen[patch, photo] = gain[photo] + own[patch]` per channel, both are found together by least
absolute deviations (reweighted least squares), which takes exposure and white balance out
without knowing the wall's colour. What no photo can tell, one gain for the whole scan, is
fixed by the median photo: the scan keeps the white balance that the phone chose on average.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from walltopo.describe.classify.observations import WallLight
from walltopo.scans.light import SceneLight

Floats = NDArray[np.float64]

ROUNDS = 25
TINT_RADIUS = 1.0  # metres: spread of the window over which the wall's tint is taken
REACH = 4.0  # patches: width of the window over which the wall's brightness is taken


def _solve(
    photo: NDArray[np.int64], patch: NDArray[np.int64], seen: Floats
) -> tuple[Floats, Floats]:
    """Gains and own values (log) of one channel by reweighted least squares."""
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


def solve_light(
    lights: Sequence[WallLight], photos: int, patch_centres: Floats, patch_size: float
) -> SceneLight:
    """Gains of the photos and the light over the wall.

    Parameters
    ----------
    lights : what each photo sees of the wall's patches.
    photos : number of photos.
    patch_centres : (patches, 3) float64, world frame; patch_size : their side.
    """
    gain = np.zeros((photos, 3))
    measured = [light for light in lights if len(light.patch)]
    if not measured:
        return SceneLight(gain, np.zeros((0, 3)), np.zeros(0), np.zeros((0, 3)))
    photo = np.concatenate([np.full(len(light.patch), light.photo) for light in measured])
    patch = np.concatenate([light.patch for light in measured])
    seen = np.concatenate([light.log_rgb for light in measured])
    rows, compact = np.unique(patch, return_inverse=True)
    own = np.zeros((len(rows), 3))
    known = np.unique(photo)
    for channel in range(3):
        solved, own[:, channel] = _solve(photo, compact, seen[:, channel])
        middle = float(np.median(solved[known]))
        gain[known, channel] = solved[known] - middle
        own[:, channel] += middle
    luminance = np.log(np.exp(own) @ np.array([0.2126, 0.7152, 0.0722]))
    brightness = _smooth(patch_centres[rows], luminance, patch_size)
    wall = float(np.exp(np.median(luminance)))
    return SceneLight(gain, patch_centres[rows], brightness, own, wall)


def _smooth(points: Floats, luminance: Floats, patch_size: float) -> Floats:
    """Log luminance around each patch over the median: light varies slowly, paint does not."""
    from scipy.spatial import cKDTree

    tree = cKDTree(points)
    near = tree.query_ball_point(points, REACH * patch_size)
    local = np.array([np.median(luminance[rows]) for rows in near])
    return local - float(np.median(luminance))
