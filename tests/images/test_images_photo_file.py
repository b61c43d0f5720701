"""Pictures as arrays: channels in order, upright, and one error for what is none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from walltopo.core import InputError
from walltopo.images.files import read_grey, read_rgb


def test_channels_are_red_green_blue_whatever_the_file_holds(tmp_path: Path) -> None:
    pixels = np.random.default_rng(0).integers(0, 256, (5, 7, 3), dtype=np.uint8)
    for name in ("a.png", "a.bmp", "a.tif"):
        Image.fromarray(pixels).save(tmp_path / name)
        np.testing.assert_array_equal(read_rgb(tmp_path / name), pixels)
    Image.fromarray(pixels).convert("RGBA").save(tmp_path / "alpha.png")
    np.testing.assert_array_equal(read_rgb(tmp_path / "alpha.png"), pixels)
    # ITU-R BT.601, as OpenCV weighs.
    grey = np.rint(pixels @ [0.299, 0.587, 0.114])
    np.testing.assert_allclose(read_grey(tmp_path / "a.png"), grey, atol=1)


def test_a_photo_is_turned_upright(tmp_path: Path) -> None:
    picture = Image.new("RGB", (40, 20), (200, 0, 0))
    exif = picture.getexif()
    exif[0x0112] = 6  # the camera was turned: rotate by 90 degrees to look at it
    picture.save(tmp_path / "turned.jpg", exif=exif)
    assert read_rgb(tmp_path / "turned.jpg").shape == (40, 20, 3)
    assert read_grey(tmp_path / "turned.jpg").shape == (40, 20)


@pytest.mark.parametrize("read", [read_rgb, read_grey])
def test_what_is_no_picture_is_named(tmp_path: Path, read: object) -> None:
    assert callable(read)
    (tmp_path / "words.jpg").write_text("words")
    for name in ("words.jpg", "absent.jpg"):
        with pytest.raises(InputError, match=name):
            read(tmp_path / name)
