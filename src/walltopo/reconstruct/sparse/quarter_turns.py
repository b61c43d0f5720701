"""Turn photos upright that a phone took sideways and whose EXIF, which would tell, is lost.

Networks match photos that are turned against each other by a quarter hardly at all: on a generated
wall, two photos of the same place had 35 matches, and 519 with the picture turned back.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from walltopo.reconstruct.sparse.feature_sets import Features, count_mutual_neighbours

Floats = NDArray[np.float32]

QUARTERS = 4
# A turn must explain this many times the similarity of the photo as it is. On two generated walls,
# 32 of 34 photos get the right turn, the other two the right one relative to each other.
_MIN_GAIN = 1.2
_MAX_ROUNDS = 10


def turned_picture(picture: NDArray[np.uint8], turn: int) -> NDArray[np.uint8]:
    """Return the picture (height, width, 3), turned to the left by `turn` quarters."""
    return np.ascontiguousarray(np.rot90(picture, turn))


def turned_back(features: Features, turn: int) -> Floats:
    """Return the positions (n, 2) in the photo of features that were found in the turned photo."""
    xy, (width, height) = features.xy, features.size
    for _ in range(turn):
        xy = np.stack([height - xy[:, 1], xy[:, 0]], axis=1)
        width, height = height, width
    return xy


def quarter_turns(versions: Sequence[Sequence[Features]]) -> list[int]:
    """Return by how many quarters to turn each photo to the left, so that all stand alike.

    Each photo takes the turn in which it resembles the others most, until none changes; at first,
    all are as they were taken.

    Parameters
    ----------
    versions : the features of each photo when turned by 0, 1, 2 and 3 quarters.
    """
    count = len(versions)
    alike = np.zeros((count, QUARTERS, count, QUARTERS))
    for a, b in combinations(range(count), 2):
        for k, m in product(range(QUARTERS), repeat=2):
            alike[a, k, b, m] = alike[b, m, a, k] = count_mutual_neighbours(
                versions[a][k], versions[b][m]
            )
    if not alike.any():
        return [0] * count
    excess = np.maximum(alike - np.median(alike[alike > 0]), 0)  # different places have some, too
    turns = np.zeros(count, dtype=np.int64)
    everyone = np.arange(count)
    for _ in range(_MAX_ROUNDS):
        before = turns.copy()
        for photo in everyone:
            scores = excess[photo][:, everyone, turns].sum(axis=1)
            best = int(scores.argmax())
            if scores[best] > _MIN_GAIN * scores[turns[photo]]:
                turns[photo] = best
        if np.array_equal(turns, before):
            break
    return [int(turn) for turn in turns]
