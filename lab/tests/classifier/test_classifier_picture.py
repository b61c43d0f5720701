"""The square picture of a hold, and what classes mean."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from walltopo.core import InputError
from walltopo_lab.classifier.cutout_classifier import (
    GREY,
    Meaning,
    judge_cutouts,
    meanings_from_json,
    meanings_of,
    read_classes,
    square_cutout,
    to_json,
)


@given(st.integers(1, 90), st.integers(1, 90), st.integers(32, 96))
def test_any_mask_fills_its_square(height: int, width: int, side: int) -> None:
    crop = np.full((height + 6, width + 4, 3), 9, np.uint8)
    mask = np.zeros(crop.shape[:2], np.bool_)
    mask[3 : 3 + height, 2 : 2 + width] = True
    picture = square_cutout(crop, mask, side)
    assert picture.shape == (side, side, 3)
    rows, columns = np.nonzero((picture != GREY).all(axis=2))
    assert max(np.ptp(rows), np.ptp(columns)) + 1 == pytest.approx(0.9 * side, abs=2)
    assert abs(rows.mean() - (side - 1) / 2) < 1.5
    assert abs(columns.mean() - (side - 1) / 2) < 1.5


def test_what_is_outside_the_mask_does_not_show() -> None:
    crop = np.zeros((20, 20, 3), np.uint8)
    crop[:, :10] = 250
    mask = np.zeros((20, 20), np.bool_)
    mask[:, 10:] = True
    assert square_cutout(crop, mask, 64).max() == GREY


def test_cutouts_that_cannot_be_shown_are_errors() -> None:
    crop = np.zeros((8, 8, 3), np.uint8)
    with pytest.raises(InputError, match="empty"):
        square_cutout(crop, np.zeros((8, 8), np.bool_), 64)
    with pytest.raises(InputError, match="mask"):
        square_cutout(crop, np.ones((4, 4), np.bool_), 64)


def test_classes_say_type_colour_and_role(tmp_path: Path) -> None:
    path = tmp_path / "classes.toml"
    path.write_text(
        '[[class]]\nname = "acme red jug"\ntype = "jug"\ncolour = "red"\n'
        '[[class]]\nname = "big grey"\nrole = "downclimb"\n'
    )
    given = read_classes(path)
    names = ["acme red jug", "big grey", "crimp", "volume", "downclimb"]
    assert meanings_of(names, given) == [
        Meaning("jug", "red", "hold"),
        Meaning("big grey", role="downclimb"),
        Meaning("crimp"),
        Meaning("volume", role="volume"),
        Meaning("downclimb", role="downclimb"),
    ]
    assert meanings_from_json(to_json(given), path) == given


@pytest.mark.parametrize(
    ("text", "output"),
    [
        ("[[class]]\nname = 'a'\nrole = 'start'", "'start'.*role"),
        ("[[class]]\nname = 'a'\nsize = 'xl'", "`size`"),
        ("[[class]]\nname = 'a'\ntype = 3", r"class\[0\]\.type"),
        ("[[class]]\ntype = 'jug'", "`name`"),
        ("[[class]]\nname = 'a'\n[[class]]\nname = 'a'", "is there twice"),
        ("", "holds no \\[\\[class\\]\\]"),
        ("[[class", "not valid TOML"),
    ],
)
def test_broken_class_files_are_named(tmp_path: Path, text: str, output: str) -> None:
    path = tmp_path / "classes.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=output) as error:
        read_classes(path)
    assert str(path) in error.value.message


def test_confidences_are_summed_by_weight() -> None:
    """Two small cutouts say jug, a large one says crimp: the large one wins, with doubt."""
    shown = np.array([[0.9, 0.1], [0.8, 0.2], [0.2, 0.8]])
    verdict = judge_cutouts(shown, np.array([100.0, 100.0, 800.0]), ["jug", "crimp"])
    assert verdict.name == "crimp"
    sums = np.array([100, 100, 800]) @ shown / 1000
    assert verdict.confidence == pytest.approx((sums[1] - sums[0]) * 0.8)
    assert judge_cutouts(shown, np.ones(3), ["jug", "crimp"]).name == "jug"
    assert judge_cutouts(shown, np.zeros(3), ["jug", "crimp"]).name == "jug"


def test_one_class_has_no_rival() -> None:
    assert judge_cutouts(np.array([[1.0]]), np.ones(1), ["jug"]).confidence == pytest.approx(1.0)
