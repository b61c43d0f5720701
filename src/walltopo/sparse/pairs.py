"""Which pairs of photos are matched.

Up to a few hundred photos every pair; beyond, neighbours in name order (phones number photos as
they are taken) and the photos that look most alike. Likeness is a bag of visual words over the
SIFT descriptors themselves, so that no vocabulary has to be shipped or fetched, and photos
stripped of their GPS can still be paired.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.sparse.job import Pairing

__all__ = ["bags_of_words", "choose_pairs", "exhaustive", "in_tiles", "nearest_pairs", "sequential"]

Pair = tuple[int, int]
_WORDS = 1024
_SAMPLE = 60_000  # descriptors that the words are learned from
_PER_PHOTO = 2000
_TILE = 10


def exhaustive(ids: Sequence[int]) -> set[Pair]:
    """Every pair of the ids, smaller first."""
    return {(a, b) for k, a in enumerate(ids) for b in ids[k + 1 :]}


def sequential(ids: Sequence[int], window: int) -> set[Pair]:
    """Each id with the `window` that follow it."""
    return {(a, b) for k, a in enumerate(ids) for b in ids[k + 1 : k + 1 + window]}


def in_tiles(pairs: Iterable[Pair]) -> list[Pair]:
    """The pairs ordered so that consecutive ones share few photos (whose index is costly)."""
    return sorted(pairs, key=lambda p: (p[0] // _TILE, p[1] // _TILE, p))


def choose_pairs(database: Any, pairing: Pairing, seed: int) -> set[Pair]:
    """Pairs of image ids to match.

    Parameters
    ----------
    database : an open `pycolmap.Database` that holds the features.
    pairing : `new` and `reference` (image ids), `exhaustive_max`, `sequential`, `retrieved`,
        `reference_retrieved` (counts).
    seed : of the visual words.
    """
    new, reference = pairing.new, pairing.reference
    few = len(new) <= pairing.exhaustive_max
    few_reference = len(reference) <= pairing.reference_retrieved
    if few and few_reference:
        return exhaustive(new) | {_ordered(a, b) for a in new for b in reference}
    bags = bags_of_words([_descriptors(database, number) for number in [*new, *reference]], seed)
    bags_new, bags_reference = bags[: len(new)], bags[len(new) :]
    pairs = exhaustive(new) if few else sequential(new, pairing.sequential)
    if not few:
        pairs |= nearest_pairs(new, bags_new, new, bags_new, pairing.retrieved)
    if reference:
        pairs |= nearest_pairs(
            new, bags_new, reference, bags_reference, pairing.reference_retrieved
        )
    return pairs


def nearest_pairs(
    ids: Sequence[int],
    bags: NDArray[np.float32],
    others: Sequence[int],
    other_bags: NDArray[np.float32],
    count: int,
) -> set[Pair]:
    """Each id paired with the `count` others of the most similar bag (cosine)."""
    likeness = bags @ other_bags.T
    likeness[np.asarray(ids)[:, None] == np.asarray(others)[None, :]] = -np.inf
    order = np.argsort(-likeness, axis=1, kind="stable")[:, :count]
    return {
        _ordered(a, others[k])
        for a, row in zip(ids, order.tolist(), strict=True)
        for k in row
        if others[k] != a
    }


def bags_of_words(descriptors: Sequence[NDArray[np.uint8]], seed: int) -> NDArray[np.float32]:
    """Unit tf-idf vectors over words learned from these descriptors.

    Parameters
    ----------
    descriptors : per photo (n, 128) uint8, strongest features of any order.
    seed : of the sample that the words are learned from.

    Returns
    -------
    (photos, words) float32, rows of length 1 (0 for a photo without features).

    Source: Sivic & Zisserman, "Video Google" (ICCV 2003).
    """
    import cv2

    rng = np.random.default_rng(seed)
    picked = [_some(rows, _PER_PHOTO, rng).astype(np.float32) for rows in descriptors]
    everything = np.concatenate(picked)
    sample = _some(everything, _SAMPLE, rng)
    words = min(_WORDS, max(1, len(sample) // 8))
    cv2.setRNGSeed(seed)
    stop = (cv2.TERM_CRITERIA_MAX_ITER + cv2.TERM_CRITERIA_EPS, 8, 1e-3)
    _, _, centres = cv2.kmeans(sample, words, None, stop, 1, cv2.KMEANS_RANDOM_CENTERS)  # type: ignore[call-overload]
    counts = np.stack([_histogram(rows, centres) for rows in picked])
    seen_in = (counts > 0).sum(axis=0)
    bags = np.sqrt(counts) * np.log((1 + len(counts)) / (1 + seen_in))
    lengths = np.linalg.norm(bags, axis=1, keepdims=True)
    return (bags / np.where(lengths > 0, lengths, 1)).astype(np.float32)


def _histogram(rows: NDArray[np.float32], centres: NDArray[np.float32]) -> NDArray[np.float64]:
    # argmin |r - c|² = argmax r·c - |c|²/2
    if not len(rows):
        return np.zeros(len(centres))
    nearest = (rows @ centres.T - 0.5 * (centres**2).sum(axis=1)).argmax(axis=1)
    return np.bincount(nearest, minlength=len(centres)).astype(np.float64)


def _some(rows: NDArray[Any], count: int, rng: np.random.Generator) -> NDArray[Any]:
    if len(rows) <= count:
        return rows
    return rows[np.sort(rng.choice(len(rows), count, replace=False))]


def _descriptors(database: Any, image_id: int) -> NDArray[np.uint8]:
    found = database.read_descriptors(image_id)
    return np.asarray(getattr(found, "data", found))


def _ordered(a: int, b: int) -> Pair:
    return (a, b) if a < b else (b, a)
