"""Every picture from outside goes through one door, and few formats through that."""

from __future__ import annotations

import io
import os
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from walltopo.core import InputError
from walltopo.images.files import open_picture, read_grey, read_rgb, read_stored

ROOT = Path(__file__).parents[2]
PICTURE = Image.fromarray(
    np.random.default_rng(0).integers(0, 256, (40, 60, 3), dtype=np.uint8), "RGB"
)
OPENS = re.compile(r"\b(Image\.open|imread\w*|imdecode\w*|VideoCapture|open_heif)\(")


def test_nothing_else_opens_pictures() -> None:
    sources = [*(ROOT / "src").rglob("*.py"), *(ROOT / "lab" / "src").rglob("*.py")]
    assert len(sources) > 200
    found = {file.name for file in sources if OPENS.search(file.read_text(encoding="utf-8"))}
    # augment.py and texture_image.py decode what they encoded themselves.
    assert found == {"files.py", "texture_image.py", "augment.py"}


def _bytes(image_format: str) -> bytes:
    stream = io.BytesIO()
    PICTURE.save(stream, image_format)
    return stream.getvalue()


@pytest.mark.parametrize("image_format", ["JPEG", "PNG", "WEBP", "TIFF", "BMP", "AVIF", "HEIF"])
def test_what_cameras_write_is_let_in(tmp_path: Path, image_format: str) -> None:
    import pillow_heif

    pillow_heif.register_heif_opener()
    data = _bytes(image_format)
    with open_picture(data) as opened:
        assert opened.convert("RGB").size == (60, 40)
    (tmp_path / "a.jpg").write_bytes(data)
    with open_picture(tmp_path / "a.jpg") as opened:
        assert opened.format == image_format


@pytest.mark.parametrize(
    "image_format", ["EPS", "GIF", "JPEG2000", "ICO", "PPM", "TGA", "PCX", "SGI", "PDF", "DDS"]
)
@pytest.mark.parametrize("read", [read_rgb, read_grey, read_stored])
def test_all_else_is_not(tmp_path: Path, image_format: str, read: object) -> None:
    assert callable(read)
    data = _bytes(image_format)
    with pytest.raises(InputError, match="not an image that is read here"), open_picture(data):
        raise AssertionError("it was opened")
    (tmp_path / "a.jpg").write_bytes(data)
    with pytest.raises(InputError, match=r"a\.jpg: not an image that is read here"):
        read(tmp_path / "a.jpg")


@pytest.mark.slow
def test_too_many_pixels_are_refused_and_pillows_own_bound_stays(tmp_path: Path) -> None:
    bound = Image.MAX_IMAGE_PIXELS
    Image.new("1", (30_000, 30_000)).save(tmp_path / "a.png")
    for read in (read_rgb, read_grey, read_stored):
        with pytest.raises(InputError, match="30000x30000 pixels, too large"):
            read(tmp_path / "a.png")
    # Pillow warns of 90 million pixels and refuses 180: a phone's photo has 200.
    Image.new("1", (16_320, 12_240)).save(tmp_path / "b.png")
    with open_picture(tmp_path / "b.png") as opened:
        assert opened.size == (16_320, 12_240)
    assert bound == Image.MAX_IMAGE_PIXELS


@pytest.mark.parametrize("error", [RuntimeError("x"), IndexError(), SyntaxError("x"), KeyError(1)])
def test_whatever_a_decoder_raises_is_damage(error: Exception) -> None:
    with pytest.raises(InputError, match="damaged or cut off"), open_picture(_bytes("PNG")):
        raise error


def test_a_pipe_is_not_opened(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "a.jpg")
    with pytest.raises(InputError, match="not a file"), open_picture(tmp_path / "a.jpg"):
        raise AssertionError("it was opened")


def test_a_file_that_would_be_read_whole_is_bounded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("walltopo.images.files._MAX_WHOLE_BYTES", 100)
    with pytest.raises(InputError, match="too large"), open_picture(_bytes("WEBP")):
        raise AssertionError("it was opened")
