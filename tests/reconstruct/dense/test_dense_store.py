"""Depth maps on disk come back as they were, a part of them too."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from walltopo.core import Camera, View
from walltopo.reconstruct.dense.depth_maps import DepthMap, DepthMapStore


def made(number: int, height: int, width: int) -> DepthMap:
    rng = np.random.default_rng(number)
    depth, weight = rng.random((2, height, width)).astype(np.float32)
    camera = Camera("PINHOLE", width, height, (10.0, 10.0, width / 2, height / 2))
    pairs = rng.integers(0, 9, (height, width), dtype=np.uint8)
    return DepthMap(depth, weight, pairs, View(f"{number}.jpg", camera, np.eye(4)[:3]))


def same(one: DepthMap, other: DepthMap) -> bool:
    names = ("depth", "weight", "pairs")
    arrays = [(getattr(one, name), getattr(other, name)) for name in names]
    return one.view is other.view and all(
        a.dtype == b.dtype and np.array_equal(a, b) for a, b in arrays
    )


@given(st.lists(st.tuples(st.integers(1, 90), st.integers(1, 90)), max_size=6))
def test_maps_come_back_as_they_were(sizes: list[tuple[int, int]]) -> None:
    maps = [made(k, *size) for k, size in enumerate(sizes)]
    store = DepthMapStore(iter(maps))
    assert len(store) == len(maps)
    assert all(same(a, b) for a, b in zip(store, maps, strict=True))
    assert all(same(a, b) for a, b in zip(store[1:], maps[1:], strict=True))


def test_what_is_written_to_a_map_stays_with_it(tmp_path: Path) -> None:
    item = made(0, 40, 60)
    store = DepthMapStore([item], tmp_path)
    store[0].depth[:] = 7.0
    assert same(store[0], item)
    assert list(tmp_path.iterdir()) == [], "the file has no name, and is gone with the store"


def test_a_folder_that_is_not_there_is_reported(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        DepthMapStore([], tmp_path / "none")
