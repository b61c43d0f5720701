"""sRGB's curve, both ways."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from walltopo.images.colour import (
    linear32_from_srgb8,
    linear_from_srgb,
    linear_from_srgb8,
    srgb8_from_linear,
    srgb_from_linear,
)

CODES = np.arange(256, dtype=np.uint8)


def test_every_code_comes_back() -> None:
    np.testing.assert_array_equal(srgb8_from_linear(linear_from_srgb8(CODES)), CODES)
    assert linear32_from_srgb8(CODES).dtype == np.float32
    np.testing.assert_allclose(linear32_from_srgb8(CODES), linear_from_srgb8(CODES), rtol=1e-7)


def test_known_values() -> None:
    # IEC 61966-2-1: mid grey 0.5 is 0.2140 of white's light.
    known = linear_from_srgb(np.array([0.0, 0.5, 1.0]))
    np.testing.assert_allclose(known, [0.0, 0.21404, 1.0], atol=1e-5)
    assert srgb8_from_linear(np.array([-0.2, 1.7])).tolist() == [0, 255]


@given(st.floats(0, 1), st.floats(0, 1))
def test_the_curve_rises_and_its_inverse_undoes_it(one: float, other: float) -> None:
    low, high = linear_from_srgb(np.array(sorted((one, other))))
    assert low <= high
    # The two pieces of the standard's curve miss each other by 1e-7 where they meet.
    assert srgb_from_linear(linear_from_srgb(np.array(one))) == pytest.approx(one, abs=1e-6)
