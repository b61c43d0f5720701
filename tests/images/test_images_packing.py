"""Rectangles in a square picture."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from walltopo.core import StageError
from walltopo.images.packing import fit_scale

side = st.floats(0.001, 200)


@settings(max_examples=40, deadline=None)
@given(
    extents=st.lists(st.tuples(side, side), min_size=1, max_size=60),
    pad=st.integers(0, 3),
    max_scale=st.sampled_from([1.0, 1000.0]),
    fixed=st.integers(0, 60),
)
def test_packed_rectangles_do_not_overlap(
    extents: list[tuple[float, float]], pad: int, max_scale: float, fixed: int
) -> None:
    scale, sizes, places = fit_scale(np.array(extents), 512, pad, max_scale, fixed=fixed)
    assert 0 < scale <= max_scale
    assert len(sizes) == len(extents) + (fixed > 0)
    assert (sizes[: len(extents)] >= np.array(extents) * scale + 2 * pad).all()
    assert (places >= 0).all()
    assert (places + sizes <= 512).all()
    taken = np.zeros((512, 512), np.int32)
    for (w, h), (x, y) in zip(sizes.tolist(), places.tolist(), strict=True):
        taken[y : y + h, x : x + w] += 1
    assert taken.max() <= 1


def test_what_fits_as_it_is_stays_as_it_is() -> None:
    assert fit_scale(np.full((4, 2), 20.0), 64, 2, max_scale=1.0)[0] == 1.0


def test_the_scale_is_the_largest_to_one_per_cent() -> None:
    # A square's picture is its extent rounded up and one pixel more.
    assert fit_scale(np.full((1, 2), 10.0), 513, 0, max_scale=1e6)[0] == pytest.approx(
        51.2, rel=0.01
    )


@pytest.mark.parametrize(("count", "least"), [(5000, 0.0), (40, 0.5)])
def test_too_many_charts_are_an_error(count: int, least: float) -> None:
    with pytest.raises(StageError, match="do not fit"):
        fit_scale(np.full((count, 2), 20.0), 64, 0, max_scale=1.0, min_scale=least)
