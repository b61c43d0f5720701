"""White, grey and black are decided by lightness and by the holds around."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion

from walltopo.describe.classify.achromatic import settle_achromatic
from walltopo.describe.classify.colour import HoldColour
from walltopo.describe.classify.observations import hold_views

Places = dict[int, NDArray[np.float64]]


def hold(name: str, grey: int) -> HoldColour:
    return HoldColour(name, (grey, grey, grey), 0.5)


def column(x: float, first: int) -> Places:
    """Six holds above each other, half a metre apart."""
    return {first + k: np.array([x, 0.0, 0.5 * k]) for k in range(6)}


def test_a_chalked_hold_gets_the_colour_of_its_route() -> None:
    places = column(0.0, 1) | column(3.0, 11)
    colours = {n: hold("black", 40) for n in range(1, 7)} | {
        n: hold("grey", 125) for n in range(11, 17)
    }
    colours[3] = hold("grey", 88)  # black with chalk
    settled = settle_achromatic(colours, places, upright=True)
    assert {settled[n].name for n in range(1, 7)} == {"black"}
    assert {settled[n].name for n in range(11, 17)} == {"grey"}
    assert 0 < settled[3].confidence < 1
    assert settled[1] == colours[1]


def test_a_hold_that_is_clearly_of_another_colour_keeps_it() -> None:
    colours = {n: hold("black", 40) for n in range(1, 7)} | {7: hold("white", 220)}
    places = column(0.0, 1) | {7: np.array([0.2, 0.0, 1.0])}
    assert settle_achromatic(colours, places, upright=True)[7].name == "white"


def test_numbers_of_clusters_go_and_other_colours_stay() -> None:
    colours = {1: hold("grey", 120), 2: hold("grey 2", 135), 3: HoldColour("red 2", (200, 0, 0), 1)}
    settled = settle_achromatic(colours, column(0.0, 1), upright=True)
    assert [settled[n].name for n in (1, 2, 3)] == ["grey", "grey", "red 2"]
    red = {3: colours[3]}
    assert settle_achromatic(red, column(0.0, 1), upright=True) == red
    assert settle_achromatic({}, {}, upright=False) == {}


def test_routes_go_up_only_where_up_is_known() -> None:
    """A doubtful hold lies as far below one route as beside another."""
    colours = {n: hold("black", 40) for n in (1, 2, 3)} | {n: hold("grey", 125) for n in (4, 5, 6)}
    colours[7] = hold("grey", 84)
    places = {n: np.array([0.0, 0.0, 0.7 + 0.1 * n]) for n in (1, 2, 3)}
    places |= {n: np.array([0.4 + 0.1 * n, 0.0, 0.0]) for n in (4, 5, 6)}
    places[7] = np.zeros(3)
    assert settle_achromatic(colours, places, upright=True)[7].name == "black"
    turned = {n: place[[2, 1, 0]] for n, place in places.items()}
    assert settle_achromatic(colours, turned, upright=True)[7].name == "grey"
    shares = [settle_achromatic(colours, p, upright=False)[7].confidence for p in (places, turned)]
    assert shares[0] == pytest.approx(shares[1])


def test_a_small_black_hold_takes_no_colour_from_the_wall() -> None:
    """Its rim is a mixture with the white wall, as in a photo that is not quite sharp."""
    row, column = np.mgrid[:40, :40]
    # A triangle whose 3 x 3 erosions have fewer pixels than a colour needs.
    inside = (row >= 16) & (row <= 22) & (abs(column - 20) <= (23 - row) / 1.8)
    rim = inside & ~binary_erosion(inside)
    picture = np.full((40, 40, 3), 230, np.uint8)
    picture[inside] = 20
    picture[rim] = 140
    depth = np.ones((40, 40), np.float32)
    (view,) = hold_views(0, picture, inside.astype(np.int32), depth, 2, 64)
    assert rim.sum() > 0.5 * inside.sum()
    assert view.linear.max() < 0.02
