"""One light for all photos: gains per photo, and the brightness over the wall.

The same patch of wall must look the same in all photos. With log values
`seen[patch, photo] = gain[photo] + own[patch]` per channel, both are found together by least
absolute deviations (reweighted least squares), which takes exposure and white balance out
without knowing the wall's colour. What no photo can tell, one gain for the whole scan, is
fixed by the median photo: the scan keeps the white balance that the phone chose on average.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.holds.observations import WallLight

__all__ = ["TINT_RADIUS", "SceneLight", "solve_light"]

Floats = NDArray[np.float64]

ROUNDS = 25
TINT_RADIUS = 1.0  # metres: spread of the window over which the wall's tint is taken
REACH = 4.0  # patches: width of the window over which the wall's brightness is taken


@dataclass(frozen=True, eq=False)
class SceneLight:
    """What to divide out of a hold's colour.

    Parameters
    ----------
    gain : (photos, 3) float64, log gain of each photo and channel; 0 for photos without wall.
    points : (n, 3) float64, centres of wall patches, world frame.
    brightness : (n,) float64, log luminance of the wall around each patch over the scan's
        median, smoothed: how much light falls there.
    wall : median luminance of the wall, linear, under the scan's mean light; 0 if unknown.
    colour : (n, 3) float64, log linear RGB of each patch under the scan's mean light.
    """

    gain: Floats
    points: Floats
    brightness: Floats
    wall: float = 0.0
    colour: Floats | None = None

    def at(self, positions: Floats) -> Floats:
        """(n,) log brightness of the light at (n, 3) positions; 0 where nothing is known."""
        if len(self.points) == 0:
            return np.zeros(len(positions))
        from scipy.spatial import cKDTree

        _, nearest = cKDTree(self.points).query(positions)
        return self.brightness[nearest]

    def tint_at(self, positions: Floats, radius: float) -> Floats:
        """(n, 3) relative colour of the wall around (n, 3) positions; 1 where nothing is known.

        The mean over the patches, by a Gaussian of `radius`; its own mean over RGB (of logs)
        is 1. Where the wall is of one paint, differences between places are the light's.
        """
        if self.colour is None or len(self.points) == 0:
            return np.ones((len(positions), 3))
        away = ((positions[:, None] - self.points[None]) ** 2).sum(axis=2) / (2 * radius**2)
        weight = np.exp(-(away - away.min(axis=1, keepdims=True)))
        logs = weight @ self.colour / weight.sum(axis=1, keepdims=True)
        return np.asarray(np.exp(logs - logs.mean(axis=1, keepdims=True)))


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
        return SceneLight(gain, np.zeros((0, 3)), np.zeros(0))
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
    return SceneLight(gain, patch_centres[rows], brightness, wall, own)


def _smooth(points: Floats, luminance: Floats, patch_size: float) -> Floats:
    """Log luminance around each patch over the median: light varies slowly, paint does not."""
    from scipy.spatial import cKDTree

    tree = cKDTree(points)
    near = tree.query_ball_point(points, REACH * patch_size)
    local = np.array([np.median(luminance[rows]) for rows in near])
    return local - float(np.median(luminance))
