"""The choice of pairs to match."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from walltopo.reconstruct.sparse.jobs import Pairing
from walltopo.reconstruct.sparse.pairs import choose_pairs, exhaustive, in_tiles, sequential


def test_exhaustive_and_sequential() -> None:
    assert exhaustive([1, 2, 3]) == {(1, 2), (1, 3), (2, 3)}
    assert sequential([1, 2, 3, 4], 2) == {(1, 2), (1, 3), (2, 3), (2, 4), (3, 4)}


@given(st.sets(st.tuples(st.integers(1, 99), st.integers(1, 99)), max_size=60))
def test_tiles_keep_every_pair_once(pairs: set[tuple[int, int]]) -> None:
    ordered = in_tiles(pairs)
    assert len(ordered) == len(pairs)
    assert set(ordered) == pairs


class _Database:
    """Descriptors of two places, by image id; what `choose_pairs` reads of pycolmap's."""

    def __init__(self, count: int) -> None:
        rng = np.random.default_rng(1)
        places = [rng.integers(0, 256, (64, 128)).astype(np.uint8) for _ in range(2)]
        self.rows = {k: places[k % 2] for k in range(1, count + 1)}

    def read_descriptors(self, number: int) -> NDArray[np.uint8]:
        return self.rows[number]


def _pairing(new: list[int], reference: list[int], most: int) -> Pairing:
    return Pairing(
        tuple(new),
        tuple(reference),
        exhaustive_max=most,
        sequential=1,
        retrieved=3,
        reference_retrieved=2,
    )


def test_few_photos_are_matched_exhaustively_and_many_by_likeness() -> None:
    database = _Database(12)
    ids = list(range(1, 13))
    assert choose_pairs(database, _pairing(ids, [], 12), 0) == exhaustive(ids)
    many = choose_pairs(database, _pairing(ids, [], 5), 0)
    assert sequential(ids, 1) <= many
    assert all((a - b) % 2 == 0 for a, b in many - sequential(ids, 1))


def test_new_photos_meet_only_the_likely_ones_of_the_reference() -> None:
    pairs = choose_pairs(_Database(12), _pairing([1, 2], list(range(3, 13)), 50), 0)
    across = {(a, b) for a, b in pairs if a <= 2 < b}
    assert len(across) == 4
    assert all((a - b) % 2 == 0 for a, b in across)
    assert pairs - across == {(1, 2)}
