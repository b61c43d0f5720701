"""Holds of two colours: the network's picture and back, the order of the paints, the names."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from walltopo.describe.classify.colour import HoldColour, HoldPaint
from walltopo.describe.classify.observations import HoldView
from walltopo.describe.classify.palette import REFERENCE, Entry
from walltopo.describe.classify.two_colours import (
    CHANNELS,
    SIDE,
    _colours_by_area,
    frame_view,
    from_square,
    probability,
    second_colours,
    shipped_model,
    square_of,
)
from walltopo.images.colour import linear_from_srgb8
from walltopo.scans.pictures import SceneLight

LIGHT = SceneLight(np.zeros((1, 3)), np.zeros((0, 3)), np.zeros((0, 3)), white=1.0)
SCALE = {"spread": 0.09, "lightness_weight": 0.6}
RED, WHITE, BLUE = ((200, 30, 40), (225, 225, 220), (30, 85, 185))


def linear(*rgb: tuple[int, int, int]) -> np.ndarray:
    return linear_from_srgb8(np.array(rgb, dtype=np.uint8))


def oval(height: int, width: int) -> np.ndarray:
    y, x = np.mgrid[-1 : 1 : height * 1j, -1 : 1 : width * 1j]
    return (x * x + y * y) <= 1.0


def view(crop: np.ndarray, mask: np.ndarray) -> HoldView:
    return HoldView(0, 7, int(mask.sum()), 0.0, np.full(3, 0.2), 100.0, False, crop, mask)


def hold_of(left: tuple[int, int, int], right: tuple[int, int, int], seed: int = 0) -> HoldView:
    """Return a shaded, grainy hold whose right third has another colour."""
    rng = np.random.default_rng(seed)
    mask = oval(60, 90)
    paint = np.where((np.arange(90) < 55)[None, :, None], linear(left), linear(right))
    shade = np.linspace(1.0, 0.45, 60)[:, None, None] * np.exp(rng.normal(0, 0.05, (60, 90, 1)))
    coded = np.where(paint * shade <= 0.0031308, 0, 1.055 * (paint * shade) ** (1 / 2.4) - 0.055)
    crop = np.clip(np.round(coded * 255), 0, 255).astype(np.uint8)
    return view(crop, mask)


@settings(max_examples=40, deadline=None)
@given(st.integers(6, 120), st.integers(6, 120))
def test_a_layer_comes_back_to_its_own_pixels(height: int, width: int) -> None:
    mask = np.pad(oval(height, width), ((3, 5), (2, 7)))
    values = np.broadcast_to(np.linspace(0, 1, mask.shape[1]), mask.shape)
    square = square_of(values[..., None], mask)
    assert square.shape == (2, SIDE, SIDE)
    back = from_square(square[0], mask)
    inner = mask & (np.abs(back) > 0)
    # A pixel of the square is several of the photo's, and its rim is mixed with nothing.
    step = max(mask.shape) / SIDE / mask.shape[1]
    assert np.median(np.abs(back - values)[inner]) < 0.02 + step


def test_the_picture_of_a_view_is_its_paint_under_one_light() -> None:
    one = hold_of(RED, RED)
    dark = SceneLight(np.full((1, 3), np.log(0.5)), LIGHT.points, LIGHT.colour, white=0.5)
    picture = frame_view(one, LIGHT)
    assert picture.shape == (CHANNELS, SIDE, SIDE)
    np.testing.assert_allclose(frame_view(one, dark), picture, atol=1e-5)
    assert picture[3].max() == pytest.approx(1.0)
    assert (picture[:3, 0, 0] == 0).all()


def test_the_network_tells_two_colours_from_one() -> None:
    rows = {1: [hold_of(RED, WHITE)] * 3, 2: [hold_of(RED, RED)] * 3, 3: [hold_of(BLUE, BLUE)] * 3}
    found = shipped_model().two_paints(rows, LIGHT)
    assert list(found) == [1]
    first, second = found[1].first.mean(axis=0), found[1].second.mean(axis=0)
    assert np.argmax(first) == 0
    assert first[1] < 0.3 * first[0]
    assert second[1] > 0.7 * second[0]
    assert 0.2 < found[1].share < 0.5


def test_a_hold_too_small_to_tell_has_one_colour() -> None:
    mask = oval(5, 6)
    crop = np.zeros((5, 6, 3), np.uint8)
    crop[:, :3], crop[:, 3:] = RED, WHITE
    assert shipped_model().two_paints({1: [view(crop, mask)]}, LIGHT) == {}


def test_the_parts_of_all_views_are_the_same_parts() -> None:
    """A view may call either part the first; the larger one comes first in the end."""
    red, white = linear(RED)[0], linear(WHITE)[0]
    views = [(red, white, 0.3, 1.0), (white, red, 0.7, 1.0), (red * 0.8, white * 0.8, 0.4, 2.0)]
    found = _colours_by_area(views)
    np.testing.assert_allclose(found.first[0], white)
    np.testing.assert_allclose(found.first[1], white)
    np.testing.assert_allclose(found.second[1], red)
    assert found.share == pytest.approx((0.3 + 0.3 + 2 * 0.4) / 4)


def test_views_of_one_side_do_not_hide_the_other_colour() -> None:
    assert probability(np.array([6.0, 5.0, -9.0, -8.0], np.float32)) > 0.99
    assert probability(np.array([6.0, -5.0, -9.0, -8.0], np.float32)) < 0.7


def test_a_second_colour_has_another_name_than_the_first() -> None:
    palette = [Entry("red", REFERENCE["red"]), Entry("white", REFERENCE["white"])]
    rows = {
        number: HoldPaint(linear(rgb)[0], linear(rgb), np.ones(1))
        for number, rgb in ((1, WHITE), (2, RED), (3, REFERENCE["blue"]))
    }
    colours = {number: HoldColour("red", RED, 1.0) for number in rows}
    named = second_colours(rows, colours, palette, **SCALE)
    # Blue is far from each colour of this gym, and keeps its plain name.
    assert {number: colour.name for number, colour in named.items()} == {1: "white", 3: "blue"}
