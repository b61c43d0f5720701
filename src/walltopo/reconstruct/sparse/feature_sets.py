"""The features that a network found in a photo, and their matches by a network of LightGlue's."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.images.networks import Network

Floats = NDArray[np.float32]

_MIN_MATCH_PROBABILITY = 0.1  # minimum probability of a match (the authors' default)

# Minimum cosine of mutually nearest descriptors that count for a pair (the authors' default).
_MIN_COSINE = 0.82


@dataclass(frozen=True, eq=False)
class Features:
    """The features of one photo, strongest first.

    Parameters
    ----------
    xy : (n, 2) float32, COLMAP's pixel coordinates (the first pixel's centre is 0.5, 0.5).
    descriptors : (n, numbers) float32, unit length.
    size : width and height of the photo, pixels.
    """

    xy: Floats
    descriptors: Floats
    size: tuple[int, int]


def shrink_photo(
    photo: NDArray[np.uint8], max_side: int, stride: int, min_side: int
) -> tuple[Floats, NDArray[np.float64]]:
    """Return a photo (h, w, 3), reduced for a network, and the photo's pixels per pixel, (2,) x, y.

    Parameters
    ----------
    photo : (height, width, 3) uint8.
    max_side : longer side of the result, about; smaller photos keep their size.
    stride : number of which the sides are multiples; min_side : a multiple of it.
    """
    size = np.array([photo.shape[1], photo.shape[0]])
    shrink = min(1.0, max_side / size.max())
    small = [max(min_side, round(side * shrink / stride) * stride) for side in size.tolist()]
    reduced = cv2.resize(photo, small, interpolation=cv2.INTER_AREA).astype(np.float32)
    return reduced, size / np.array(small)


def match_features(network: Network, a: Features, b: Features) -> NDArray[np.uint32]:
    """Return (m, 2) feature indices of `a` and `b` that match.

    Parameters
    ----------
    network : has two sets of positions and descriptors as inputs, and as outputs the best match of
        each feature of the first, its probability, and the best match of each of the second.
    """
    if not len(a.xy) or not len(b.xy):
        return np.zeros((0, 2), np.uint32)
    to_b, probability, to_a = (
        found[0]
        for found in network.session.run(
            None,
            {
                "points0": _normalised(a),
                "descriptors0": a.descriptors[None],
                "points1": _normalised(b),
                "descriptors1": b.descriptors[None],
            },
        )
    )
    rows = np.arange(len(to_b))
    good = (to_a[to_b] == rows) & (probability > _MIN_MATCH_PROBABILITY)
    return np.stack([rows[good], to_b[good]], axis=1).astype(np.uint32)


def count_mutual_neighbours(a: Features, b: Features) -> int:
    """Return the number of mutual nearest neighbours: a cheap estimate of the number of matches."""
    if not len(a.xy) or not len(b.xy):
        return 0
    cosine = a.descriptors @ b.descriptors.T
    to_b, to_a = cosine.argmax(axis=1), cosine.argmax(axis=0)
    rows = np.arange(len(to_b))
    return int(((to_a[to_b] == rows) & (cosine[rows, to_b] > _MIN_COSINE)).sum())


def _normalised(features: Features) -> Floats:
    """Return (1, n, 2) positions with the longer side from -1 to 1 and the centre at 0."""
    size = np.array(features.size, dtype=np.float32)
    return ((features.xy - size / 2) / (size.max() / 2))[None].astype(np.float32)
