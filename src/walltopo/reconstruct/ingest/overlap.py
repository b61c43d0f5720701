"""Which photos show something in common: a quick look at small pictures, before the scan.

SIFT features of small pictures, matched both ways with Lowe's ratio, and of the matches those that
one epipolar geometry explains (D. Lowe, "Distinctive Image Features from Scale-Invariant
Keypoints", IJCV 2004, 7.1; D. Barath et al., "MAGSAC++", CVPR 2020). Only as many pairs are
compared as are needed to know what hangs together: neighbours first, and none that are joined
already.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

_FEATURES: Final = 1000  # of one picture
_CONTRAST: Final = 0.02  # half of OpenCV's: small pictures of plywood have little
_RATIO: Final = 0.85
_FEWEST: Final = (
    25  # matches of one geometry; of photos that share nothing up to 15 agree by chance
)
_WITHIN_PX: Final = 1.0
_CONFIDENCE: Final = 0.999
_TRIES: Final = 2000

Features = tuple[NDArray[np.float32], NDArray[np.float32]]


@dataclass(frozen=True)
class Overlap:
    """What hangs together.

    Parameters
    ----------
    groups : numbers of the pictures of each part, the largest part first.
    pairs : how many were compared.
    is_whole : False: so many would have had to be compared that it was left; parts may be one.
    """

    groups: tuple[tuple[int, ...], ...]
    pairs: int
    is_whole: bool


def find_overlap(pictures: Sequence[NDArray[np.uint8]], most_pairs: int = 4000) -> Overlap:
    """Which pictures hang together by what they show.

    Parameters
    ----------
    pictures : each (H, W) uint8, grey, in the order in which they were taken; 480 px are enough.
    most_pairs : more are not compared.
    """
    features = [_features(picture) for picture in pictures]
    part = list(range(len(pictures)))  # each picture's part, by the number of one of its pictures
    compared = 0
    is_whole = True
    for a, b in _near_first(len(pictures)):
        if part[a] == part[b]:
            continue
        if compared >= most_pairs:
            is_whole = False
            break
        compared += 1
        if _agreeing(features[a], features[b]) >= _FEWEST:
            gone, kept = part[b], part[a]
            part = [kept if own == gone else own for own in part]
    groups: dict[int, list[int]] = {}
    for number, own in enumerate(part):
        groups.setdefault(own, []).append(number)
    ordered = sorted(groups.values(), key=lambda group: (-len(group), group[0]))
    return Overlap(tuple(map(tuple, ordered)), compared, is_whole)


def _near_first(count: int) -> Iterator[tuple[int, int]]:
    """All pairs; those that were taken after one another first."""
    for away in range(1, count):
        for a in range(count - away):
            yield a, a + away


def _features(picture: NDArray[np.uint8]) -> Features:
    """Places (n, 2) and RootSIFT descriptors (n, 128), each of length 1."""
    import cv2

    sift = cv2.SIFT.create(nfeatures=_FEATURES, contrastThreshold=_CONTRAST)
    keypoints, found = sift.detectAndCompute(picture, None)
    if found is None:
        return np.zeros((0, 2), np.float32), np.zeros((0, 128), np.float32)
    places = np.array([keypoint.pt for keypoint in keypoints], dtype=np.float32)
    weights = found / np.maximum(found.sum(axis=1, keepdims=True), 1e-9)
    return places, np.sqrt(weights).astype(np.float32)


def _agreeing(one: Features, other: Features) -> int:
    """How many matches one geometry explains."""
    import cv2

    (places, found), (places_there, found_there) = one, other
    if min(len(found), len(found_there)) < _FEWEST:
        return 0
    alike = found @ found_there.T
    best = alike.argmax(axis=1)
    mutual = np.flatnonzero(alike.argmax(axis=0)[best] == np.arange(len(best)))
    second = np.partition(alike[mutual], -2, axis=1)[:, -2]
    # Distances of unit vectors, squared; so is the ratio.
    first_far, second_far = 1.0 - alike[mutual, best[mutual]], 1.0 - second
    clear = mutual[first_far < _RATIO**2 * second_far]
    if len(clear) < _FEWEST:
        return 0
    _, agrees = cv2.findFundamentalMat(
        places[clear], places_there[best[clear]], cv2.USAC_MAGSAC, _WITHIN_PX, _CONFIDENCE, _TRIES
    )
    return 0 if agrees is None else int(np.count_nonzero(agrees))
