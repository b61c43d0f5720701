"""Colours: features, light, palette, assignment."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from walltopo.core import InputError
from walltopo.describe.classify.colour import HoldPaint, assign_colours, find_palette
from walltopo.describe.classify.light import solve_light
from walltopo.describe.classify.observations import WallLight, paint_of
from walltopo.describe.classify.palette import (
    REFERENCE,
    Entry,
    name_of,
    read_palette,
    write_palette,
)
from walltopo.describe.settings import ClassifySettings
from walltopo.images.colour import features, linear_from_srgb8, oklab_from_linear, srgb8_from_linear

SETTINGS = ClassifySettings()
SCALE = {"spread": SETTINGS.colour_spread, "lightness_weight": SETTINGS.lightness_weight}


def test_oklab_of_known_colours() -> None:
    # Ottosson's table: white (1, 0, 0), red (0.628, 0.225, 0.126).
    white, red = oklab_from_linear(np.array([[1.0, 1, 1], [1.0, 0, 0]]))
    np.testing.assert_allclose(white, [1, 0, 0], atol=1e-3)
    np.testing.assert_allclose(red, [0.628, 0.225, 0.126], atol=1e-3)


@given(st.tuples(*[st.floats(0.15, 1)] * 3), st.floats(0.5, 1))
def test_features_hardly_change_with_the_light(
    colour: tuple[float, float, float], light: float
) -> None:
    linear = np.array(colour)
    change = features(light * linear, 0.0) - features(linear, 0.0)
    assert np.linalg.norm(change) < 0.03


def test_paint_ignores_highlights_chalk_and_bolt() -> None:
    rng = np.random.default_rng(0)
    pixels = rng.integers(-6, 7, (1000, 3)) + np.array([190, 30, 40])
    pixels[:100] = 250  # highlight
    pixels[100:160] = (60, 60, 60)  # bolt
    linear, clipped = paint_of(pixels.astype(np.uint8))
    np.testing.assert_allclose(srgb8_from_linear(linear), [190, 30, 40], atol=8)
    assert clipped < 0.2


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000))
def test_light_finds_the_gains_of_the_photos(seed: int) -> None:
    rng = np.random.default_rng(seed)
    own = rng.normal(-1, 0.4, (60, 3))
    gain = rng.normal(0, 0.3, (9, 3))
    gain -= np.median(gain, axis=0)
    lights = []
    for photo in range(9):
        rows = np.sort(rng.choice(60, 35, replace=False))
        seen = own[rows] + gain[photo] + rng.normal(0, 0.01, (35, 3))
        seen[rng.random(35) < 0.1] += 1.0  # something stood in front of the wall
        lights.append(WallLight(photo, rows, seen))
    found = solve_light(lights, 9, rng.random((60, 3))).gain
    assert np.abs(found - gain).max() < 0.12


def test_photos_without_wall_have_no_gain() -> None:
    empty = WallLight(0, np.zeros(0, dtype=np.int64), np.zeros((0, 3)))
    light = solve_light([empty], 1, np.zeros((0, 3)))
    np.testing.assert_array_equal(light.gain, 0)


def gym(names: list[str], each: int, seed: int = 0) -> tuple[dict[int, HoldPaint], dict[int, str]]:
    """Holds of some colours under uneven light."""
    rng = np.random.default_rng(seed)
    paints, truth = {}, {}
    for number, name in enumerate(names * each, start=1):
        base = linear_from_srgb8(np.array(REFERENCE[name], dtype=np.uint8))
        views = base * np.exp(rng.normal(0, 0.12, (5, 1)) + rng.normal(0, 0.03, (5, 3)))
        paints[number] = HoldPaint(np.median(views, axis=0), views, np.ones(5))
        truth[number] = name
    return paints, truth


def test_palette_is_found_and_named() -> None:
    paints, truth = gym(["red", "blue", "yellow", "black", "white", "grey", "pink"], 8)
    palette = find_palette(paints, set(), **SCALE)
    found = assign_colours(paints, palette, **SCALE)
    right = sum(found[k].name == truth[k] for k in truth)
    assert right >= 0.97 * len(truth)
    assert len({entry.name for entry in palette}) == len(palette)


@pytest.mark.parametrize("name", ["red", "blue", "yellow", "purple", "green"])
def test_a_gym_with_one_colour(name: str) -> None:
    paints, _ = gym([name], 12)
    palette = find_palette(paints, set(), **SCALE)
    assert [entry.name for entry in palette] == [name]
    found = assign_colours(paints, palette, **SCALE)
    assert all(colour.name == name and colour.confidence == 1.0 for colour in found.values())


def test_volumes_do_not_shape_the_palette_of_holds() -> None:
    paints, _ = gym(["orange", "white", "wood"], 6)
    volumes = {k for k in paints if k % 3 == 0}  # the wooden ones
    palette = find_palette(paints, volumes, **SCALE)
    assert [entry.name for entry in palette][-1] == "wood"
    assert {entry.name for entry in palette[:-1]} == {"orange", "white"}


def test_no_holds_no_colours() -> None:
    assert find_palette({}, set(), **SCALE) == []
    assert assign_colours({}, [], **SCALE) == {}


def test_a_colour_far_from_a_given_palette_is_unknown() -> None:
    paints, _ = gym(["blue"], 2)
    found = assign_colours(paints, [Entry("yellow", REFERENCE["yellow"])], **SCALE)
    assert {colour.name for colour in found.values()} == {"unknown"}
    assert {colour.confidence for colour in found.values()} == {0.0}


def test_palette_file_round_trip(tmp_path: Path) -> None:
    entries = [
        Entry('the "old" red', (200, 30, 30)),
        Entry("grey", (120, 120, 120), "downclimb"),
    ]
    path = tmp_path / "palette.toml"
    write_palette(path, entries, [7, 2])
    assert read_palette(path, 0.7) == entries


def test_palette_entry_without_a_name_is_named_by_its_colour(tmp_path: Path) -> None:
    path = tmp_path / "palette.toml"
    path.write_text("[[colour]]\nrgb = [30, 85, 185]\n")
    assert read_palette(path, 0.7) == [Entry("blue", (30, 85, 185))]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "colour"),
        ("[[colour]]\nname = 'x'\n", "rgb"),
        ("[[colour]]\nrgb = [1, 2, 300]\n", "rgb"),
        ("[[colour]]\nrgb = [1, 2, 3]\nrole = 'boss'\n", "role"),
        ("[[colour]]\nrgb = [1, 2, 3]\nhue = 3\n", "unknown"),
        ("[[colour", "TOML"),
    ],
)
def test_broken_palettes_are_refused(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "palette.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        read_palette(path, 0.7)
    with pytest.raises(InputError, match=r"none\.toml"):
        read_palette(tmp_path / "none.toml", 0.7)


def test_every_basic_colour_is_called_by_its_name() -> None:
    for name, rgb in REFERENCE.items():
        assert name_of(rgb, SETTINGS.lightness_weight) == name
