"""Huge photos are decoded small: nearly the same pixels as by the long way, strip by strip."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from made_files import picture  # type: ignore[import-not-found]
from PIL import Image

from walltopo.reconstruct.ingest.decoding import MemoryBudget
from walltopo.reconstruct.ingest.image_file import decoded_photo
from walltopo.reconstruct.settings import IngestSettings

SETTINGS = IngestSettings(max_side=800)


def _decoded(path: Path) -> tuple[Image.Image, float | None]:
    with decoded_photo(path, SETTINGS, MemoryBudget()) as photo:
        return photo.image.copy(), photo.focal_px


@pytest.mark.parametrize("name", ["a.jpg", "a.png", "a.heic", "a.tif", "a.webp", "alpha.png"])
def test_reduced_as_if_it_were_whole(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    import pillow_heif

    pillow_heif.register_heif_opener()
    image = picture(3, (3000, 2000), 100)
    if name.startswith("alpha"):
        image.putalpha(Image.linear_gradient("L").resize(image.size))
    exif = Image.Exif()
    exif[0x0112] = 6
    exif.get_ifd(0x8769)[0xA405] = 26
    if name.endswith(".heic"):
        image.info["exif"] = exif.tobytes()  # the turn is then the file's own, as phones write it
        image.save(tmp_path / name)
    else:
        image.save(tmp_path / name, exif=exif)
    whole, focal = _decoded(tmp_path / name)
    monkeypatch.setattr("walltopo.reconstruct.ingest.image_file._EXACT_PIXELS", 1_000_000)
    monkeypatch.setattr("walltopo.reconstruct.ingest.image_file._STRIP_PIXELS", 500_000)
    reduced, reduced_focal = _decoded(tmp_path / name)
    assert reduced.size == whole.size == (533, 800)
    difference = np.abs(np.asarray(whole, dtype=float) - np.asarray(reduced, dtype=float))
    assert difference.mean() < 2.0
    assert reduced_focal == pytest.approx(focal)
    assert focal is None or focal == pytest.approx(26 / 43.267 * 3606 * 800 / 3000, rel=1e-3)


def test_strips_do_not_change_a_photo(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Depth, palette, transparency and profile are dealt with pixel by pixel."""
    from PIL import ImageCms

    deep = np.asarray(picture(2).convert("L")).astype(np.uint16) * 257
    deep[:100] = deep[:100] // 300  # the top strip alone looks like 8 bits
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    files = {
        "deep.png": (Image.fromarray(deep), b""),
        "cmyk.jpg": (picture(1).convert("CMYK"), b""),
        "palette.png": (picture(3).convert("P"), b""),
        "profile.png": (picture(4), profile),
    }
    for name, (image, icc) in files.items():
        image.save(tmp_path / name, **({"icc_profile": icc} if icc else {}))
    before = {name: np.asarray(_decoded(tmp_path / name)[0]) for name in files}
    monkeypatch.setattr("walltopo.reconstruct.ingest.image_file._STRIP_PIXELS", 640 * 7)
    for name, pixels in before.items():
        np.testing.assert_array_equal(pixels, np.asarray(_decoded(tmp_path / name)[0]))


def test_200_megapixels_pass(tmp_path: Path) -> None:
    blocks = picture(5, (2040, 1530), 10).convert("L")
    image = blocks.resize((16320, 12240), Image.Resampling.NEAREST)
    image.save(tmp_path / "a.jpg", quality=50)
    with decoded_photo(tmp_path / "a.jpg", IngestSettings(), MemoryBudget()) as photo:
        assert photo.image.size == (3200, 2400)
        small = np.asarray(photo.image.convert("L").resize((204, 153)), dtype=float)
    expected = np.asarray(blocks.resize((204, 153)), dtype=float)
    assert np.abs(small - expected).mean() < 6
