"""Photos of one place look alike."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from walltopo.reconstruct.sparse.pairs import nearest_pairs, vlad_vectors

IDS = list(range(1, 10))


def _photos(seed: int) -> dict[int, NDArray[np.uint8]]:
    """Nine photos of three places, each of two thirds of its place's features, with noise."""
    rng = np.random.default_rng(seed)
    places = [rng.integers(0, 256, (300, 128)) for _ in range(3)]
    noisy = {
        k: places[k % 3][rng.permutation(300)[:200]] + rng.integers(-3, 4, (200, 128)) for k in IDS
    }
    return {k: np.clip(rows, 0, 255).astype(np.uint8) for k, rows in noisy.items()}


@given(seed=st.integers(0, 1000))
@settings(max_examples=10, deadline=None)
def test_photos_of_one_place_are_each_others_nearest(seed: int) -> None:
    looks = vlad_vectors(_photos(seed).__getitem__, IDS, seed=seed)
    assert np.allclose(np.linalg.norm(looks, axis=1), 1, atol=1e-5)
    for a, b in nearest_pairs(IDS, looks, IDS, looks, 2):
        assert (a - b) % 3 == 0


def test_signatures_are_the_same_again_and_in_any_order() -> None:
    photos = _photos(0)
    first = vlad_vectors(photos.__getitem__, IDS, seed=1)
    np.testing.assert_array_equal(first, vlad_vectors(photos.__getitem__, IDS, seed=1))
    # Features come in the order that threads found them in: it must not matter much.
    turned = vlad_vectors(lambda k: photos[k][::-1], IDS, seed=1)
    assert ((first * turned).sum(axis=1) > 0.5).all()


def test_a_photo_without_features_is_like_none() -> None:
    some = np.random.default_rng(0).integers(0, 256, (100, 128)).astype(np.uint8)
    rows = {1: some, 2: np.zeros((0, 128), np.uint8)}
    looks = vlad_vectors(rows.__getitem__, [1, 2], seed=0)
    assert np.isfinite(looks).all()
    assert not looks[1].any()
