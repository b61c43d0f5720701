"""Choose pairs of photos to match: all, neighbours by name, and the most similar by VLAD
vectors."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.reconstruct.sparse.jobs import Pairing

Pair = tuple[int, int]

_TILE = 10


def exhaustive(ids: Sequence[int]) -> set[Pair]:
    """Return every pair of the ids, smaller first."""
    return {(a, b) for k, a in enumerate(ids) for b in ids[k + 1 :]}


def sequential(ids: Sequence[int], window: int) -> set[Pair]:
    """Return each id paired with the `window` ids that follow it."""
    return {(a, b) for k, a in enumerate(ids) for b in ids[k + 1 : k + 1 + window]}


def in_tiles(pairs: Iterable[Pair]) -> list[Pair]:
    """Return the pairs in tiles, so that consecutive pairs reuse the same photos' costly
    indices."""
    return sorted(pairs, key=lambda p: (p[0] // _TILE, p[1] // _TILE, p))


def choose_pairs(database: Any, pairing: Pairing, seed: int) -> set[Pair]:
    """Return the pairs of image ids to match.

    Parameters
    ----------
    database : an open `pycolmap.Database` that holds the features.
    pairing : `new` and `reference` (image ids), `exhaustive_max`, `sequential`, `retrieved`,
        `reference_retrieved` (counts).
    seed : random seed of the VLAD vectors.
    """
    new, reference = pairing.new, pairing.reference
    few = len(new) <= pairing.exhaustive_max
    few_reference = len(reference) <= pairing.reference_retrieved
    if few and few_reference:
        return exhaustive(new) | {_ordered(a, b) for a in new for b in reference}
    vectors = vlad_vectors(lambda number: _descriptors(database, number), [*new, *reference], seed)
    own, others = vectors[: len(new)], vectors[len(new) :]
    pairs = exhaustive(new) if few else sequential(new, pairing.sequential)
    if not few:
        pairs |= nearest_pairs(new, own, new, own, pairing.retrieved)
    if reference:
        pairs |= nearest_pairs(new, own, reference, others, pairing.reference_retrieved)
    return pairs


def nearest_pairs(
    ids: Sequence[int],
    vectors: NDArray[np.float32],
    others: Sequence[int],
    other_vectors: NDArray[np.float32],
    count: int,
) -> set[Pair]:
    """Return each id paired with the `count` others with the most similar VLAD vector (cosine)."""
    similarity = vectors @ other_vectors.T
    similarity[np.asarray(ids)[:, None] == np.asarray(others)[None, :]] = -np.inf
    order = np.argsort(-similarity, axis=1, kind="stable")[:, :count]
    return {
        _ordered(a, others[k])
        for a, row in zip(ids, order.tolist(), strict=True)
        for k in row
        if others[k] != a
    }


def _descriptors(database: Any, image_id: int) -> NDArray[np.uint8]:
    found = database.read_descriptors(image_id)
    return np.asarray(getattr(found, "data", found))


def _ordered(a: int, b: int) -> Pair:
    return (a, b) if a < b else (b, a)


Floats = NDArray[np.float32]

_WORDS = 256

_SAMPLE = 60_000  # descriptors that the visual words are learned from

_PER_PHOTO = 2000  # maximum number of descriptors used per photo


def vlad_vectors(
    descriptors: Callable[[int], NDArray[np.uint8]], ids: Sequence[int], seed: int
) -> Floats:
    """Return one VLAD vector per photo; similar photos have a large dot product.

    Only one photo's descriptors are in memory at a time.

    Parameters
    ----------
    descriptors : returns a photo's descriptors (n, 128) uint8 by its image id.
    ids : image ids.
    seed : random seed of the samples.

    Returns
    -------
    (photos, words * 128) float32, unit rows (zeros for a photo without features).
    """
    words = _visual_words(descriptors, ids, seed)
    rows = np.zeros((len(ids), words.size), np.float32)
    for place, number in enumerate(ids):
        rng = np.random.default_rng([seed, number])
        rows[place] = _vlad_vector(_random_rows(descriptors(number), _PER_PHOTO, rng), words)
    return rows


def _visual_words(
    descriptors: Callable[[int], NDArray[np.uint8]], ids: Sequence[int], seed: int
) -> Floats:
    """Return (words, 128) k-means centres of a sample of all descriptors."""
    import cv2

    rng = np.random.default_rng(seed)
    share = max(1, _SAMPLE // max(1, len(ids)))
    sample = np.concatenate([_random_rows(descriptors(number), share, rng) for number in ids])
    count = min(_WORDS, max(1, len(sample) // 8))
    cv2.setRNGSeed(seed)
    stop = (cv2.TERM_CRITERIA_MAX_ITER + cv2.TERM_CRITERIA_EPS, 12, 1e-3)
    points = sample.astype(np.float32)
    _, _, centres = cv2.kmeans(points, count, None, stop, 1, cv2.KMEANS_RANDOM_CENTERS)  # type: ignore[call-overload]
    return np.asarray(centres, np.float32)


def _vlad_vector(rows: NDArray[np.uint8], words: Floats) -> Floats:
    """Return the (words * 128,) VLAD vector of a photo's descriptors."""
    if not len(rows):
        return np.zeros(words.size, np.float32)
    points = rows.astype(np.float32)
    # argmin |r - w|^2 = argmax r.w - |w|^2 / 2
    nearest = (points @ words.T - 0.5 * (words**2).sum(axis=1)).argmax(axis=1)
    own = (nearest[:, None] == np.arange(len(words))).astype(np.float32)
    away = own.T @ points - own.sum(axis=0)[:, None] * words
    # Normalise each word, so that repeated features (bolt holes, seams) do not dominate.
    away /= np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-6)
    return np.asarray(away.ravel() / max(float(np.linalg.norm(away)), 1e-6), np.float32)


def _random_rows(rows: NDArray[Any], count: int, rng: np.random.Generator) -> NDArray[Any]:
    """Return at most `count` rows, chosen at random."""
    if len(rows) <= count:
        return rows
    return rows[np.sort(rng.choice(len(rows), count, replace=False))]
