"""Ingest: every kind of photo a phone writes, and every other kind of file."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest
from made_files import ingested, picture, skipped_reasons, write_photos  # type: ignore[import-not-found]
from PIL import Image

from walltopo.core import InputError
from walltopo.pipeline.runner import run_stage, write_sources
from walltopo.reconstruct.settings import IngestSettings
from walltopo.scans.folder import ScanFolder
from walltopo.scans.photos import Photo, PhotoList

GPS_IFD, ORIENTATION, EXIF_IFD, FOCAL_35MM = 0x8825, 0x0112, 0x8769, 0xA405


def photo_of(scan: ScanFolder, source: str) -> Photo:
    """The entry of the photo that was made from `source`."""
    return next(p for p in PhotoList.load(scan.photo_list).photos if p.source == source)


def test_orientation_focal_and_privacy(tmp_path: Path) -> None:
    folder = tmp_path / "in"
    write_photos(folder)
    exif = Image.Exif()
    exif[ORIENTATION] = 6  # turned by 90 degrees
    exif.get_ifd(EXIF_IFD)[FOCAL_35MM] = 26
    exif.get_ifd(GPS_IFD)[1] = "N"
    exif[0x010F] = "A phone with a serial number"
    picture(9).save(folder / "turned.jpg", exif=exif)
    scan = ingested(tmp_path, folder)
    record = photo_of(scan, "turned.jpg")
    assert (record.width, record.height) == (480, 640)
    assert record.focal_px == pytest.approx(26 / 43.267 * 800, rel=1e-3)
    for photo in scan.photos.iterdir():
        assert not dict(Image.open(photo).getexif())
        assert b"serial number" not in photo.read_bytes()


def test_formats(tmp_path: Path) -> None:
    import pillow_heif

    pillow_heif.register_heif_opener()
    folder = tmp_path / "in"
    folder.mkdir()
    picture(0).save(folder / "a.heic", quality=90)
    picture(1).convert("CMYK").save(folder / "b.jpg")
    deep = (np.asarray(picture(2).convert("L")).astype(np.uint16)) * 257
    Image.fromarray(deep).save(folder / "c.png")
    picture(3).convert("P").save(folder / "d.png")
    transparent = picture(4).convert("RGBA")
    transparent.putalpha(128)
    transparent.save(folder / "e.png")
    scan = ingested(tmp_path, folder)
    assert sorted(p.name for p in scan.photos.iterdir()) == [f"{c}.jpg" for c in "abcde"]
    grey = np.asarray(Image.open(scan.photos / "c.jpg"), dtype=float)
    assert np.abs(grey - np.asarray(picture(2).convert("RGB").convert("L"))[..., None]).mean() < 6


def test_what_is_skipped_and_why(tmp_path: Path) -> None:
    folder = tmp_path / "in"
    write_photos(folder)
    (folder / "text.jpg").write_text("I am not a photo")
    (folder / "notes.txt").write_text("neither")
    whole = (folder / "p0.jpg").read_bytes()
    (folder / "cut.jpg").write_bytes(whole[: len(whole) // 2])
    shutil.copy(folder / "p0.jpg", folder / "p9_copy.jpg")
    picture(0).save(folder / "z_again.png")
    picture(5, (200, 150)).save(folder / "tiny.png")
    picture(6, (3000, 600)).save(folder / "wide.png")
    Image.new("RGB", (640, 480), (90, 90, 90)).save(folder / "blank.png")
    (folder / "empty.jpg").write_bytes(b"")
    reasons = skipped_reasons(ingested(tmp_path, folder))
    expected = {
        "text.jpg": "not an image",
        "notes.txt": "neither a photo nor a video",
        "cut.jpg": "damaged or cut off",
        "p9_copy.jpg": "the same file as p0.jpg",
        "z_again.png": "shows the same as p0.jpg",
        "tiny.png": "smaller than 320 px",
        "wide.png": "panorama",
        "blank.png": "blurred",
        "empty.jpg": "not an image",
    }
    assert reasons.keys() == expected.keys()
    for name, reason in expected.items():
        assert reason in reasons[name]


def test_too_few_photos_lists_reasons_and_keeps_the_old_scan(tmp_path: Path) -> None:
    write_photos(tmp_path / "in")
    scan = ingested(tmp_path, tmp_path / "in")
    bad = tmp_path / "bad"
    write_photos(bad, 2)
    (bad / "x.jpg").write_text("no")
    write_sources(scan, [bad])
    with pytest.raises(InputError, match=r"2 usable photos, at least 3(.|\n)*x.jpg: not an image"):
        run_stage(scan, "ingest", IngestSettings())
    assert len(list(scan.photos.iterdir())) == 3


def test_names_are_safe_unique_and_natural(tmp_path: Path) -> None:
    first, second = tmp_path / "a", tmp_path / "b"
    for k, (folder, name) in enumerate(
        [(first, "IMG 10 ü.jpg"), (first, "IMG 2 ü.jpg"), (second, "IMG 2 ü.jpg")]
    ):
        folder.mkdir(exist_ok=True)
        picture(k).save(folder / name)
    scan = ingested(tmp_path, first, second)
    names = [p.name for p in PhotoList.load(scan.photo_list).photos]
    assert names == ["IMG_2_ü.jpg", "IMG_10_ü.jpg", "IMG_2_ü_2.jpg"]


def test_large_photos_are_reduced_with_their_focal(tmp_path: Path) -> None:
    folder = tmp_path / "in"
    write_photos(folder)
    exif = Image.Exif()
    exif.get_ifd(EXIF_IFD)[FOCAL_35MM] = 26
    picture(7, (4000, 3000)).save(folder / "big.jpg", exif=exif)
    scan = ingested(tmp_path, folder)
    record = photo_of(scan, "big.jpg")
    assert (record.width, record.height) == (3200, 2400)
    assert record.focal_px == pytest.approx(26 / 43.267 * 4000, rel=1e-3)


def view_files(folder: Path, names: Sequence[str]) -> None:
    """Write one view in four qualities under these names, from the worst to the best."""
    view = picture(11, (1280, 960))
    exif = Image.Exif()
    exif.get_ifd(0x8769)[0xA405] = 26
    view.resize((640, 480)).save(folder / names[0], "TIFF", exif=exif)
    view.save(folder / names[1], "JPEG", quality=98)
    view.save(folder / names[2], "JPEG", quality=60, exif=exif)
    view.save(folder / names[3], "JPEG", quality=90, exif=exif)


@pytest.mark.parametrize("order", list(permutations(range(4)))[::5])
def test_the_best_picture_of_a_view_is_kept_whatever_its_name(
    order: tuple[int, ...], tmp_path: Path
) -> None:
    folder = tmp_path / "in"
    write_photos(folder)
    names = [f"v{k}.{'DNG' if j == 0 else 'jpg'}" for j, k in enumerate(order)]
    view_files(folder, names)
    scan = ingested(tmp_path, folder)
    listed = {photo.source: photo for photo in PhotoList.load(scan.photo_list).photos}
    assert names[3] in listed
    assert not listed.keys() & set(names[:3])
    best = listed[names[3]]
    assert (best.width, best.height) == (1280, 960)
    assert best.focal_px == pytest.approx(26 / 43.267 * 1600, rel=1e-3)
    assert len(listed) == 4


@pytest.mark.parametrize("names", [("a.jpg", "b.jpg"), ("b.jpg", "a.jpg")])
def test_a_large_copy_without_exif_has_the_focal_length_of_the_small_one(
    names: tuple[str, str], tmp_path: Path
) -> None:
    folder = tmp_path / "in"
    write_photos(folder)
    view = picture(11, (1280, 960))
    exif = Image.Exif()
    exif.get_ifd(0x8769)[0xA405] = 26
    view.resize((640, 480)).save(folder / names[0], exif=exif, quality=95)
    view.save(folder / names[1], quality=95)
    scan = ingested(tmp_path, folder)
    listed = {photo.source: photo for photo in PhotoList.load(scan.photo_list).photos}
    assert listed[names[1]].focal_px == pytest.approx(26 / 43.267 * 1600, rel=1e-3)
    assert names[0] not in listed
