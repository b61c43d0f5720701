"""People in photos: found, outlined, hidden, and left out of features and detections."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from drawn_people import wall, with_person  # type: ignore[import-not-found]
from hypothesis import given
from hypothesis import strategies as st
from made_files import ingested, picture  # type: ignore[import-not-found]
from msgspec.structs import replace
from PIL import Image

from walltopo.core import InputError, Mask, Silent
from walltopo.images.files import read_rgb
from walltopo.images.fill import hide_pixels
from walltopo.images.people import find_people, people_mask
from walltopo.pipeline.runner import ScanResult, run_stage, scan
from walltopo.pipeline.settings import load_settings
from walltopo.reconstruct.settings import IngestSettings, SparseSettings
from walltopo.reconstruct.sparse.feature_sets import Features
from walltopo.reconstruct.sparse.jobs import (
    CameraEntry,
    ImageEntry,
    features_job,
    run_worker,
    write_masks,
)
from walltopo.reconstruct.sparse.learned_features import outside_mask
from walltopo.scans.people import PEOPLE, HiddenPeople, PeopleList
from walltopo.scans.photos import PhotoSet
from walltopo.segment.detect.photo_detections import PhotoDetections
from walltopo.segment.detect.photos import without_people


@pytest.mark.parametrize("height", [60, 120, 400])
def test_a_person_is_found_and_covered(height: int) -> None:
    photo, truth = with_person(wall(0), 500, 400, height)
    people = find_people(photo)
    assert len(people) == 1
    mask = people_mask(photo, people)
    assert (mask & truth).sum() > 0.95 * truth.sum()
    assert mask.sum() < 4 * truth.sum()


def test_two_people_are_two() -> None:
    photo, _ = with_person(wall(1), 200, 300, 300)
    photo, _ = with_person(photo.astype(float), 800, 300, 300)
    assert len(find_people(photo)) == 2


def test_a_wall_without_people_has_none() -> None:
    assert find_people(wall(2).astype(np.uint8)) == []
    assert find_people(np.asarray(picture(0))) == []


def test_small_and_long_photos_are_looked_at_too() -> None:
    assert find_people(wall(3, 300, 200).astype(np.uint8)) == []
    assert find_people(wall(3, 1600, 400).astype(np.uint8)) == []


@given(seed=st.integers(0, 1000), width=st.integers(1, 90), height=st.integers(1, 90))
def test_hidden_pixels_do_not_depend_on_what_they_showed(
    seed: int, width: int, height: int
) -> None:
    rng = np.random.default_rng(seed)
    photo = rng.integers(0, 256, (height, width, 3), dtype=np.uint8)
    mask = rng.random((height, width)) < rng.random()
    other = np.where(mask[..., None], 255 - photo, photo)
    hidden = hide_pixels(photo, mask)
    assert np.array_equal(hidden, hide_pixels(other, mask))
    assert np.array_equal(hidden[~mask], photo[~mask])


def test_hidden_people_leave_the_colours_of_the_wall() -> None:
    photo, _ = with_person(wall(4), 500, 400, 300)
    mask = people_mask(photo, find_people(photo))
    hidden = hide_pixels(photo, mask)
    assert np.abs(hidden[mask].astype(float) - 150).max() < 25
    assert find_people(hidden) == []


def write_wall(folder: Path, with_people: bool) -> None:
    folder.mkdir()
    for k in range(3):
        photo, _ = with_person(wall(k, 800, 600), 300, 200, 300)
        if k != 1 or not with_people:
            photo = wall(k, 800, 600).astype(np.uint8)
        Image.fromarray(photo).save(folder / f"p{k}.jpg", quality=95)


def test_ingest_hides_people_and_lists_them(tmp_path: Path) -> None:
    write_wall(tmp_path / "in", with_people=True)
    made = ingested(tmp_path, tmp_path / "in")
    photos = PhotoSet.load(made.photos)
    assert [entry.photo for entry in photos.people.photos] == ["p1.jpg"]
    assert photos.people_mask("p0.jpg") is None
    mask = photos.people_mask("p1.jpg")
    assert mask is not None
    assert mask.shape == (600, 800)
    assert find_people(photos.read_rgb("p1.jpg")) == []
    half = photos.people_mask("p1.jpg", 400, 300)
    assert half is not None
    assert half.shape == (300, 400)
    assert run_stage(made, "ingest", IngestSettings())["with_people"] == 1


def test_people_stay_if_the_settings_say_so(tmp_path: Path) -> None:
    write_wall(tmp_path / "in", with_people=True)
    made = ingested(tmp_path, tmp_path / "in", hide_people=False)
    assert not (made.photos / PEOPLE).exists()
    assert len(find_people(read_rgb(made.photos / "p1.jpg"))) == 1


def test_a_scan_notices_the_switch(tmp_path: Path) -> None:
    write_wall(tmp_path / "in", with_people=True)

    def run(hide: str) -> ScanResult:
        settings = load_settings(None, [f"ingest.hide_people={hide}"])
        return scan(tmp_path / "in", tmp_path / "scan", settings, to_stage="ingest")

    assert run("true").metrics["ingest"]["with_people"] == 1
    assert run("true").ran == ()
    assert run("false").ran == ("ingest",)
    assert not (tmp_path / "scan" / "photos" / PEOPLE).exists()


def test_photos_without_people_are_the_same_bytes(tmp_path: Path) -> None:
    write_wall(tmp_path / "in", with_people=False)
    (tmp_path / "on").mkdir()
    (tmp_path / "off").mkdir()
    on = ingested(tmp_path / "on", tmp_path / "in")
    off = ingested(tmp_path / "off", tmp_path / "in", hide_people=False)
    for made in (on, off):
        assert sorted(path.name for path in made.photos.iterdir()) == ["p0.jpg", "p1.jpg", "p2.jpg"]
    for path in on.photos.iterdir():
        assert path.read_bytes() == (off.photos / path.name).read_bytes()


def listed(folder: Path, name: str, mask: np.ndarray) -> PhotoSet:
    PeopleList(photos=(HiddenPeople.of(name, 1, mask),)).save(folder / PEOPLE)
    return PhotoSet(folder)


def test_a_damaged_list_is_named(tmp_path: Path) -> None:
    (tmp_path / PEOPLE).write_text('{"photos": [{"photo": "a.jpg"}]}', encoding="utf-8")
    with pytest.raises(InputError, match=r"people\.json"):
        PhotoSet(tmp_path).people_mask("a.jpg")


def test_colmap_finds_no_features_on_people(tmp_path: Path) -> None:
    photos = tmp_path / "photos"
    photos.mkdir()
    for k in range(2):
        picture(k).save(photos / f"{k}.jpg", quality=95)
    mask = np.zeros((480, 640), dtype=np.bool_)
    mask[:, 200:400] = True
    folder = listed(photos, "0.jpg", mask)
    camera = CameraEntry("SIMPLE_RADIAL", 640, 480, (700.0, 320.0, 240.0, 0.0), False)
    images = [ImageEntry(f"{k}.jpg", 0) for k in range(2)]
    database = tmp_path / "work" / "features.db"
    job = features_job(database, photos, SparseSettings(threads=1), [camera], images, [1, 2])
    run_worker(replace(job, masks=write_masks({"": folder}, tmp_path / "masks")), Silent())
    from walltopo.geometry.colmap import pycolmap

    with pycolmap.Database.open(database) as db:
        masked, whole = (np.asarray(db.read_keypoints(k))[:, 0] for k in (1, 2))
    assert len(masked) > 100
    assert not ((masked > 200) & (masked < 400)).any()
    assert ((whole > 200) & (whole < 400)).any()


def test_without_people_there_are_no_masks(tmp_path: Path) -> None:
    assert write_masks({"": PhotoSet(tmp_path)}, tmp_path / "masks") == ""


def test_learned_features_on_people_are_dropped(tmp_path: Path) -> None:
    xy = np.array([[10.5, 10.5], [50.5, 10.5]], dtype=np.float32)
    features = Features(xy, np.eye(2, 64, dtype=np.float32), (100, 20))
    allowed = np.full((20, 100), 255, dtype=np.uint8)
    allowed[:, 40:60] = 0
    cv2.imwrite(str(tmp_path / "a.jpg.png"), allowed)
    kept = outside_mask(features, tmp_path / "a.jpg.png")
    assert kept.xy.tolist() == [[10.5, 10.5]]
    assert outside_mask(features, tmp_path / "b.jpg.png") is features


def test_detections_on_people_go() -> None:
    people = np.zeros((100, 100), dtype=np.bool_)
    people[:, :50] = True
    masks = tuple(
        Mask(np.ones((10, 10), dtype=np.bool_), x, 20, 100, 100, 1, 0.9) for x in (10, 44, 48, 70)
    )
    boxes = np.array([[m.x, 20, m.x + 10, 30] for m in masks], dtype=float)
    for given_masks in (masks, ()):
        found = PhotoDetections(
            100, 100, boxes, np.full(4, 0.9), np.ones(4, dtype=np.int64), given_masks
        )
        assert without_people(found, people).boxes[:, 0].tolist() == [48, 70]
