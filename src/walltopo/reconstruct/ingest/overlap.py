"""Find groups of photos that overlap, from small images, before the scan starts.

Two photos overlap if enough mutual SIFT matches that pass Lowe's ratio test are inliers of one
epipolar geometry (D. Lowe, "Distinctive Image Features from Scale-Invariant Keypoints", IJCV 2004,
7.1; D. Barath et al., "MAGSAC++", CVPR 2020). Consecutive photos are compared first, and pairs
within one group are skipped.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

_FEATURES: Final = 1000  # per picture
_CONTRAST: Final = (
    0.02  # half of OpenCV's default, because small pictures of plywood have low contrast
)
_RATIO: Final = 0.85
# Inlier matches of one geometry; photos without overlap reach up to 15 by chance.
_MIN_INLIERS: Final = 25
_INLIER_PX: Final = 1.0
_CONFIDENCE: Final = 0.999
_MAX_ITERATIONS: Final = 2000

Features = tuple[NDArray[np.float32], NDArray[np.float32]]


@dataclass(frozen=True)
class Shift:
    """How far the view moved from picture `before` to the overlapping picture `after`.

    Parameters
    ----------
    before, after : picture numbers, `before` < `after`.
    right, up : median motion of the view, as a share of the picture's width and height. A step to
        the right moves the wall to the left in the picture: `right` is then positive.
    """

    before: int
    after: int
    right: float
    up: float


@dataclass(frozen=True)
class Overlap:
    """The groups of connected pictures.

    Parameters
    ----------
    groups : picture numbers of each group, the largest group first.
    shifts : the pairs that connect the groups. They form a tree in each group, and contain all
        consecutive pictures that overlap.
    gaps : for each group but the largest, a picture of it and one of another group: those that
        share most matches, so that a picture taken between them is most likely to connect them.
    pairs : number of compared pairs.
    is_whole : False if the search stopped at `max_pairs`; groups may then belong together.
    """

    groups: tuple[tuple[int, ...], ...]
    shifts: tuple[Shift, ...]
    gaps: tuple[tuple[int, int], ...]
    pairs: int
    is_whole: bool


def find_overlap(pictures: Sequence[NDArray[np.uint8]], max_pairs: int = 4000) -> Overlap:
    """Return the groups of pictures that overlap.

    Parameters
    ----------
    pictures : (H, W) uint8 grey images in the order of capture; 480 px are enough.
    max_pairs : maximum number of compared pairs.
    """
    features = [_find_features(picture) for picture in pictures]
    group_of = list(range(len(pictures)))  # group of each picture, named by a member's number
    shifts = []
    matches: dict[tuple[int, int], int] = {}
    is_whole = True
    for a, b in _pairs_by_gap(len(pictures)):
        if group_of[a] == group_of[b]:
            continue
        if len(matches) >= max_pairs:
            is_whole = False
            break
        moved = _find_motion(features[a], features[b])
        matches[a, b] = len(moved)
        if len(moved) >= _MIN_INLIERS:
            shifts.append(_view_shift(a, b, moved, pictures[b].shape))
            merged, kept = group_of[b], group_of[a]
            group_of = [kept if own == merged else own for own in group_of]
    groups: dict[int, list[int]] = {}
    for number, own in enumerate(group_of):
        groups.setdefault(own, []).append(number)
    ordered = sorted(groups.values(), key=lambda group: (-len(group), group[0]))
    return Overlap(
        groups=tuple(map(tuple, ordered)),
        shifts=tuple(shifts),
        gaps=_gap_pairs(group_of, [group_of[group[0]] for group in ordered[1:]], matches),
        pairs=len(matches),
        is_whole=is_whole,
    )


def _gap_pairs(
    group_of: Sequence[int], apart: Sequence[int], matches: Mapping[tuple[int, int], int]
) -> tuple[tuple[int, int], ...]:
    """Return a pair for each group in `apart`; of equal pairs the nearest in the sequence."""
    gaps = []
    for group in apart:
        pairs = [pair for pair in matches if [group_of[k] for k in pair].count(group) == 1]
        if pairs:
            a, b = max(pairs, key=lambda pair: (matches[pair], pair[0] - pair[1]))
            gaps.append((a, b) if group_of[a] == group else (b, a))
    return tuple(gaps)


def _view_shift(a: int, b: int, moved: NDArray[np.float32], shape: tuple[int, ...]) -> Shift:
    """Return the motion of the view from the motion of the matches, which is its opposite."""
    height, width = shape[:2]
    across, down = np.median(moved, axis=0).tolist()
    return Shift(a, b, right=-across / width, up=down / height)


def _pairs_by_gap(count: int) -> Iterator[tuple[int, int]]:
    """Yield all pairs in order of distance in the sequence: consecutive pictures first."""
    for gap in range(1, count):
        for a in range(count - gap):
            yield a, a + gap


def _find_features(picture: NDArray[np.uint8]) -> Features:
    """Return the keypoint positions (n, 2) and the RootSIFT descriptors (n, 128) of unit length."""
    import cv2

    sift = cv2.SIFT.create(nfeatures=_FEATURES, contrastThreshold=_CONTRAST)
    keypoints, found = sift.detectAndCompute(picture, None)
    if found is None:
        return np.zeros((0, 2), np.float32), np.zeros((0, 128), np.float32)
    positions = np.array([keypoint.pt for keypoint in keypoints], dtype=np.float32)
    weights = found / np.maximum(found.sum(axis=1, keepdims=True), 1e-9)
    return positions, np.sqrt(weights).astype(np.float32)


def _find_motion(one: Features, other: Features) -> NDArray[np.float32]:
    """Return the motion (n, 2) in pixels of the inlier matches of one epipolar geometry."""
    import cv2

    nothing = np.zeros((0, 2), np.float32)
    (positions, found), (other_positions, other_found) = one, other
    if min(len(found), len(other_found)) < _MIN_INLIERS:
        return nothing
    similarity = found @ other_found.T
    best = similarity.argmax(axis=1)
    mutual = np.flatnonzero(similarity.argmax(axis=0)[best] == np.arange(len(best)))
    second = np.partition(similarity[mutual], -2, axis=1)[:, -2]
    # Squared distances of unit vectors up to a factor of 2, so the ratio is squared too.
    first_distance, second_distance = 1.0 - similarity[mutual, best[mutual]], 1.0 - second
    distinct = mutual[first_distance < _RATIO**2 * second_distance]
    if len(distinct) < _MIN_INLIERS:
        return nothing
    before, after = positions[distinct], other_positions[best[distinct]]
    _, inliers = cv2.findFundamentalMat(
        before,
        after,
        cv2.USAC_MAGSAC,
        _INLIER_PX,
        _CONFIDENCE,
        _MAX_ITERATIONS,
    )
    if inliers is None:
        return nothing
    return np.asarray((after - before)[inliers.ravel() != 0], dtype=np.float32)
