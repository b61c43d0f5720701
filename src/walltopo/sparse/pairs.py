"""Which pairs of photos are matched.

Of few photos every pair; beyond, neighbours in name order (phones number photos as
they are taken) and the photos that look most alike (`likeness`), so that photos stripped of their
GPS can still be paired.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.sparse.job import Pairing
from walltopo.sparse.likeness import signatures

__all__ = ["choose_pairs", "exhaustive", "in_tiles", "nearest_pairs", "sequential"]

Pair = tuple[int, int]
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
    seed : of the likeness.
    """
    new, reference = pairing.new, pairing.reference
    few = len(new) <= pairing.exhaustive_max
    few_reference = len(reference) <= pairing.reference_retrieved
    if few and few_reference:
        return exhaustive(new) | {_ordered(a, b) for a in new for b in reference}
    looks = signatures(lambda number: _descriptors(database, number), [*new, *reference], seed)
    own, others = looks[: len(new)], looks[len(new) :]
    pairs = exhaustive(new) if few else sequential(new, pairing.sequential)
    if not few:
        pairs |= nearest_pairs(new, own, new, own, pairing.retrieved)
    if reference:
        pairs |= nearest_pairs(new, own, reference, others, pairing.reference_retrieved)
    return pairs


def nearest_pairs(
    ids: Sequence[int],
    looks: NDArray[np.float32],
    others: Sequence[int],
    other_looks: NDArray[np.float32],
    count: int,
) -> set[Pair]:
    """Each id paired with the `count` others of the most similar signature (cosine)."""
    likeness = looks @ other_looks.T
    likeness[np.asarray(ids)[:, None] == np.asarray(others)[None, :]] = -np.inf
    order = np.argsort(-likeness, axis=1, kind="stable")[:, :count]
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
