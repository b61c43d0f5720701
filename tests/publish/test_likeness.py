"""The loose comparison of screenshots: what it lets pass and what it does not."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import pytest
from likeness import alike, small  # type: ignore[import-not-found]
from PIL import Image, ImageChops, ImageEnhance, ImageFilter

REFERENCES = sorted((Path(__file__).parent / "references").glob("*/*.jpg"))


def blank(picture: Image.Image) -> Image.Image:
    """The picture as if most of the wall had not been drawn."""
    result = picture.copy()
    width, height = picture.size
    result.paste((238, 240, 243), (width // 3, 0, width, height * 2 // 3))
    return result


@pytest.mark.parametrize("path", REFERENCES, ids=lambda path: path.stem)
def test_small_changes_pass(path: Path) -> None:
    picture = small(path)
    assert alike(picture, ImageChops.offset(picture, 1, 0))
    assert alike(picture, picture.filter(ImageFilter.GaussianBlur(1)))
    assert alike(picture, ImageEnhance.Brightness(picture).enhance(1.01))


@pytest.mark.parametrize("path", REFERENCES, ids=lambda path: path.stem)
def test_faults_do_not_pass(path: Path) -> None:
    picture = small(path)
    width, height = picture.size
    assert not alike(picture, ImageChops.offset(picture, 20, 0)), "moved aside"
    assert not alike(picture, blank(picture)), "the wall is missing"
    assert not alike(picture, picture.resize((width, height * 3 // 4))), "of another shape"
    assert not alike(picture, ImageChops.invert(picture)), "dark for light"


def test_no_reference_passes_for_another() -> None:
    pictures = {path.stem: small(path) for path in REFERENCES}
    assert len(pictures) >= 10
    same = [pair for pair in combinations(pictures, 2) if alike(*(pictures[name] for name in pair))]
    assert not same
