"""Tiles go to the network together, but never more than memory takes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from walltopo.segment.detect.tiles import in_batches, run_batched


@given(
    st.lists(st.sampled_from([(8, 8, 3), (8, 16, 3)]), max_size=30),
    st.integers(0, 5),
    st.integers(0, 400_000),
)
def test_every_tile_once_in_order(shapes: list[tuple[int, int, int]], most: int, free: int) -> None:
    inputs = [np.zeros(shape, np.uint8) for shape in shapes]
    batches = list(in_batches(inputs, most, free))
    assert [k for batch in batches for k in batch] == list(range(len(inputs)))
    for batch in batches:
        assert len({inputs[k].shape for k in batch}) == 1
        assert len(batch) <= (most or 16)
        if not most and len(batch) > 1:
            assert len(batch) * inputs[batch[0]].size / 3 * 160 <= free / 2


def test_what_a_gpu_cannot_hold_is_halved() -> None:
    sizes: list[int] = []

    def run(values: np.ndarray) -> list[np.ndarray]:
        sizes.append(len(values))
        if len(values) > 2:
            raise RuntimeError("Failed to allocate memory for requested buffer")
        return [values.astype(np.float32).mean(axis=(1, 2, 3))]

    inputs = [np.full((4, 4, 3), k, np.uint8) for k in range(7)]
    outputs = run_batched(run, inputs, 7)
    assert [float(made) for (made,) in outputs] == list(range(7))
    assert sizes[0] == 7
    with pytest.raises(RuntimeError, match="something else"):
        run_batched(broken, inputs, 7)


def broken(values: np.ndarray) -> list[np.ndarray]:
    raise RuntimeError("something else")
