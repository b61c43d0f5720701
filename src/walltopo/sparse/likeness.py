"""What a photo looks like, as one vector: photos of one place have similar ones.

The vector says for each of some visual words how the photo's SIFT descriptors of that word differ
from it in sum (VLAD). The words are learned from the photos themselves, so that no vocabulary has
to be shipped or fetched.

Source: Jegou, Douze, Schmid & Perez, "Aggregating local descriptors into a compact image
representation" (CVPR 2010); Arandjelovic & Zisserman, "All about VLAD" (CVPR 2013).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["signatures"]

Floats = NDArray[np.float32]

_WORDS = 256
_SAMPLE = 60_000  # descriptors that the words are learned from
_PER_PHOTO = 2000  # descriptors of a photo that count


def signatures(
    descriptors: Callable[[int], NDArray[np.uint8]], ids: Sequence[int], seed: int
) -> Floats:
    """One vector a photo; the more alike two photos are, the larger the product of theirs.

    The descriptors of one photo at a time are in memory.

    Parameters
    ----------
    descriptors : gives those of a photo by its id, (n, 128) uint8.
    ids : the photos.
    seed : of the samples.

    Returns
    -------
    (photos, words * 128) float32, rows of length 1 (0 for a photo without features).
    """
    words = _words(descriptors, ids, seed)
    rows = np.zeros((len(ids), words.size), np.float32)
    for place, number in enumerate(ids):
        rng = np.random.default_rng([seed, number])
        rows[place] = _signature(_some(descriptors(number), _PER_PHOTO, rng), words)
    return rows


def _words(
    descriptors: Callable[[int], NDArray[np.uint8]], ids: Sequence[int], seed: int
) -> Floats:
    """(words, 128) middles of a sample of all descriptors."""
    import cv2

    rng = np.random.default_rng(seed)
    share = max(1, _SAMPLE // max(1, len(ids)))
    sample = np.concatenate([_some(descriptors(number), share, rng) for number in ids])
    count = min(_WORDS, max(1, len(sample) // 8))
    cv2.setRNGSeed(seed)
    stop = (cv2.TERM_CRITERIA_MAX_ITER + cv2.TERM_CRITERIA_EPS, 12, 1e-3)
    points = sample.astype(np.float32)
    _, _, middles = cv2.kmeans(points, count, None, stop, 1, cv2.KMEANS_RANDOM_CENTERS)  # type: ignore[call-overload]
    return np.asarray(middles, np.float32)


def _signature(rows: NDArray[np.uint8], words: Floats) -> Floats:
    """(words * 128,) of a photo's descriptors."""
    if not len(rows):
        return np.zeros(words.size, np.float32)
    points = rows.astype(np.float32)
    # argmin |r - w|^2 = argmax r.w - |w|^2 / 2
    nearest = (points @ words.T - 0.5 * (words**2).sum(axis=1)).argmax(axis=1)
    own = (nearest[:, None] == np.arange(len(words))).astype(np.float32)
    away = own.T @ points - own.sum(axis=0)[:, None] * words
    # Each word counts alike, however often a repeated thing (a bolt hole, a seam) shows it.
    away /= np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-6)
    return np.asarray(away.ravel() / max(float(np.linalg.norm(away)), 1e-6), np.float32)


def _some(rows: NDArray[Any], count: int, rng: np.random.Generator) -> NDArray[Any]:
    if len(rows) <= count:
        return rows
    return rows[np.sort(rng.choice(len(rows), count, replace=False))]
