"""Files that are read, or left out, for what they hold and not for their name."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_files import (  # type: ignore[import-not-found]
    ingested,
    picture,
    skipped_reasons,
    write_film,
    write_photos,
)
from PIL import Image

from walltopo.images.hdr import Transfer, to_srgb8
from walltopo.reconstruct.ingest.decoding import MemoryBudget
from walltopo.reconstruct.ingest.image_file import decoded_photo
from walltopo.reconstruct.ingest.sources import find_sources
from walltopo.reconstruct.ingest.video import sharpest_frames
from walltopo.reconstruct.settings import IngestSettings
from walltopo.scans.folder import ScanFolder
from walltopo.scans.photos import PhotoList

GPANO = (
    b'<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:Description '
    b'GPano:ProjectionType="equirectangular"/></x:xmpmeta>'
)
TO_2020 = np.array([[0.6274, 0.3293, 0.0433], [0.0691, 0.9195, 0.0114], [0.0164, 0.0880, 0.8956]])


def photos_of(scan: ScanFolder) -> int:
    return len(PhotoList.load(scan.photo_list).photos)


@pytest.mark.parametrize(
    ("suffix", "kind"),
    [
        (".jfif", "JPEG"),
        (".jpe", "JPEG"),
        (".bmp", "BMP"),
        (".avif", "AVIF"),
        (".HIF", "HEIF"),
        (".JPG_original", "JPEG"),
        ("", "PNG"),
    ],
)
def test_good_pictures_of_any_name_are_read(tmp_path: Path, suffix: str, kind: str) -> None:
    import pillow_heif

    pillow_heif.register_heif_opener()
    folder = tmp_path / "in"
    write_photos(folder)
    picture(9).save(folder / f"more{suffix}", kind)
    assert photos_of(ingested(tmp_path, folder)) == 4


def test_an_archive_says_so_and_text_is_neither(tmp_path: Path) -> None:
    write_photos(tmp_path)
    with zipfile.ZipFile(tmp_path / "wall.zip", "w") as archive:
        archive.write(tmp_path / "p0.jpg")
    (tmp_path / "list.txt").write_text("photos of the cave")
    reasons = {item.source: item.reason for item in find_sources([tmp_path]).skipped}
    assert "unpack it" in reasons["wall.zip"]
    assert reasons["list.txt"] == "neither a photo nor a video"


def test_stitched_photos_are_left_out(tmp_path: Path) -> None:
    folder = tmp_path / "in"
    write_photos(folder)
    picture(5, (1280, 640)).save(folder / "sphere.jpg", xmp=GPANO)
    exif = Image.Exif()
    exif.get_ifd(0x8769)[0xA401] = 6  # CustomRendered: Apple's panorama
    picture(6, (1280, 640)).save(folder / "stitched.jpg", exif=exif)
    reasons = skipped_reasons(ingested(tmp_path, folder))
    assert "360-degree" in reasons["sphere.jpg"]
    assert "stitched by the phone" in reasons["stitched.jpg"]


def test_the_moving_part_of_live_photos_is_left_out(tmp_path: Path) -> None:
    folder = tmp_path / "in"
    write_photos(folder, 5)
    for number in range(4):
        write_film(folder / f"P{number}.MOV", 45, step=12 + number)
    write_film(folder / "walk.mov", 45)
    scan = ingested(tmp_path, folder)
    reasons = skipped_reasons(scan)
    assert {name for name, why in reasons.items() if "Live Photo" in why} == {
        f"P{number}.MOV" for number in range(4)
    }
    assert any("walk" in photo.source for photo in PhotoList.load(scan.photo_list).photos)


@pytest.mark.slow
def test_a_long_film_of_a_photos_name_is_a_film(tmp_path: Path) -> None:
    folder = tmp_path / "in"
    write_photos(folder)
    write_film(folder / "p0.mov", 120)
    assert photos_of(ingested(tmp_path, folder)) > 3


def signal(rgb: tuple[int, int, int], transfer: Transfer) -> list[float]:
    """Return the HDR signal of an sRGB colour, with white at 203 cd/m2 (BT.2100, inverted)."""
    share = np.array(rgb) / 255.0
    linear = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    nits = 203.0 * (TO_2020 @ linear)
    if transfer == "pq":
        y = (nits / 10_000) ** 0.1593017578125
        coded = ((0.8359375 + 18.8515625 * y) / (1 + 18.6875 * y)) ** 78.84375
        return [float(v) for v in coded]
    display = nits / 1000.0
    scene = display * max(float(display @ [0.2627, 0.6780, 0.0593]), 1e-9) ** (-0.2 / 1.2)
    low = np.sqrt(3 * scene)
    high = 0.17883277 * np.log(np.maximum(12 * scene - 0.28466892, 1e-9)) + 0.55991073
    return [float(v) for v in np.where(scene <= 1 / 12, low, high)]


_BT2020 = 9  # code point of the matrix and of the primaries in H.273
COLOURS = [(254, 0, 0), (30, 200, 90), (20, 60, 220), (128, 128, 128), (240, 200, 20)]


@pytest.mark.parametrize("transfer", ["pq", "hlg"])
@pytest.mark.parametrize("rgb", COLOURS)
def test_hdr_becomes_the_srgb_it_was(rgb: tuple[int, int, int], transfer: Transfer) -> None:
    coded = np.rint(np.array(signal(rgb, transfer)) * 65535).astype(np.uint16)
    found = to_srgb8(np.broadcast_to(coded, (130, 2, 3)), transfer)
    assert np.abs(found.astype(int) - rgb).max() <= 0.03 * 255


@pytest.mark.parametrize(("transfer", "code"), [("pq", 16), ("hlg", 18)])
def test_a_film_in_hdr_keeps_its_colours(tmp_path: Path, transfer: Transfer, code: int) -> None:
    write_hdr_film(tmp_path / "walk.mov", transfer, code)
    frame = next(sharpest_frames(tmp_path / "walk.mov", MemoryBudget(), [])).pixels
    for column, rgb in enumerate(COLOURS):
        middle = frame[100:140, column * 128 + 54 : column * 128 + 74].reshape(-1, 3)
        assert np.abs(np.median(middle, axis=0) - rgb).max() <= 0.03 * 255, rgb


def write_hdr_film(path: Path, transfer: Transfer, code: int) -> None:
    """Write a film of five coloured stripes as a phone writes HDR: HEVC, 10 bit, BT.2020."""
    import av

    stripes = np.array([signal(rgb, transfer) for rgb in COLOURS])
    pixels = np.rint(np.repeat(stripes, 128, axis=0) * 65535).astype(np.uint16)
    image = np.ascontiguousarray(np.broadcast_to(pixels, (240, 640, 3)))
    with av.open(str(path), "w") as container:
        stream: Any = container.add_stream("libx265", rate=30)
        stream.width, stream.height, stream.pix_fmt = 640, 240, "yuv420p10le"
        stream.options = {"x265-params": "log-level=none"}
        context = stream.codec_context
        context.color_primaries, context.color_trc, context.colorspace = _BT2020, code, _BT2020
        for _ in range(12):
            frame = av.VideoFrame.from_ndarray(image, "rgb48le").reformat(
                format="yuv420p10le", dst_colorspace=_BT2020
            )
            frame.color_trc, frame.color_primaries, frame.colorspace = code, _BT2020, _BT2020
            container.mux(stream.encode(frame))
        container.mux(stream.encode())


@pytest.mark.parametrize(("transfer", "code"), [("pq", 16), ("hlg", 18)])
def test_a_heif_in_hdr_keeps_its_colours(tmp_path: Path, transfer: Transfer, code: int) -> None:
    import pillow_heif

    pillow_heif.register_heif_opener()
    stripes = np.array([signal(rgb, transfer) for rgb in COLOURS])
    pixels = np.rint(np.repeat(stripes, 128, axis=0) * 255).astype(np.uint8)
    Image.fromarray(np.ascontiguousarray(np.broadcast_to(pixels, (480, 640, 3)))).save(
        tmp_path / "a.heic",
        quality=98,
        chroma=444,
        save_nclx_profile=True,
        color_primaries=9,
        transfer_characteristics=code,
        matrix_coefficients=9,
    )
    with decoded_photo(tmp_path / "a.heic", IngestSettings(), MemoryBudget()) as photo:
        found = np.asarray(photo.image)
    for column, rgb in enumerate(COLOURS):
        middle = found[200:280, column * 128 + 54 : column * 128 + 74].reshape(-1, 3)
        assert np.abs(np.median(middle, axis=0) - rgb).max() <= 0.05 * 255, rgb
