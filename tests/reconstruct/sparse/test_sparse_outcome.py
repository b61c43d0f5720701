"""Why photos are not in the model; models rebuilt from a choice of images."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from walltopo.core import InputError
from walltopo.reconstruct.scale.plates import built_in_plates
from walltopo.reconstruct.scale.world_frame import plates_without
from walltopo.reconstruct.sparse.attempts import bridging_pair, why_unregistered
from walltopo.reconstruct.sparse.colmap_worker import register_images
from walltopo.reconstruct.sparse.jobs import CameraEntry, ImageEntry, camera_entries
from walltopo.reconstruct.sparse.models import match_keypoints
from walltopo.scans.photos import Photo


def database_with(folder: Path, features: list[int]) -> Path:
    """A feature database with as many keypoints per photo, and one verified pair 0-1."""
    from walltopo.geometry.colmap import pycolmap

    path = folder / "f.db"
    camera = CameraEntry("SIMPLE_RADIAL", 64, 48, (60.0, 32.0, 24.0, 0.0), prior=False)
    images = [ImageEntry(f"{k}.jpg", 0) for k in range(len(features))]
    register_images(path, [camera], images)
    with pycolmap.Database.open(path) as db:
        for number, count in enumerate(features, start=1):
            db.write_keypoints(number, np.zeros((count, 2), np.float32))
        geometry = pycolmap.TwoViewGeometry()
        geometry.inlier_matches = np.zeros((20, 2), np.uint32)
        db.write_two_view_geometry(1, 2, geometry)
    return path


def test_each_reason_names_what_was_found(tmp_path: Path) -> None:
    path = database_with(tmp_path, [900, 900, 12, 900])
    missing = {f"{k}.jpg": f"{k}.jpg" for k in range(4)}
    reasons = why_unregistered(path, missing, {"1.jpg": 5})
    assert "matches 1 other photo(s)" in reasons["0.jpg"]
    assert "separate group of 5 photos" in reasons["1.jpg"]
    assert "only 12 features" in reasons["2.jpg"]
    assert "nothing in it matches any other photo" in reasons["3.jpg"]


def test_groups_are_bridged_where_most_matches_are(tmp_path: Path) -> None:
    from walltopo.geometry.colmap import pycolmap

    path = database_with(tmp_path, [900, 900, 900, 900])
    with pycolmap.Database.open(path) as db:
        for first, second, count in ((1, 3, 4), (2, 3, 9), (2, 4, 6), (1, 2, 500)):
            db.write_matches(first, second, np.zeros((count, 2), np.uint32))
    assert bridging_pair(path, {"0.jpg", "1.jpg"}, {"2.jpg", "3.jpg"}) == ("1.jpg", "2.jpg")
    assert bridging_pair(path, {"2.jpg", "3.jpg"}, {"0.jpg", "1.jpg"}) == ("2.jpg", "1.jpg")
    assert bridging_pair(path, {"0.jpg"}, {"3.jpg"}) is None


def test_images_are_registered_once_and_in_order(tmp_path: Path) -> None:
    from walltopo.geometry.colmap import pycolmap

    path = tmp_path / "f.db"
    camera = CameraEntry("SIMPLE_PINHOLE", 64, 48, (60.0, 32.0, 24.0), prior=False)
    for _ in range(2):
        register_images(path, [camera], [ImageEntry(f"{k}.jpg", 0) for k in range(2)])
    with pycolmap.Database.open(path) as db:
        assert [(i.image_id, str(i.name)) for i in db.read_all_images()] == [
            (1, "0.jpg"),
            (2, "1.jpg"),
        ]


def test_photos_of_one_size_and_focal_share_a_camera() -> None:
    sizes = [(1280, 960, 998.0), (960, 1280, 998.0), (1280, 960, 998.0), (1280, 960, None)]
    photos = [
        Photo(f"{k}.jpg", width, height, focal, f"{k}.jpg", 100.0)
        for k, (width, height, focal) in enumerate(sizes)
    ]
    cameras, indices = camera_entries(photos)
    assert indices == [0, 1, 0, 2]
    assert [camera.prior for camera in cameras] == [True, True, False]
    assert cameras[2].params == (0.75 * 1280, 640, 480, 0.0)


def test_the_same_keypoints_keep_their_numbers_and_others_find_the_nearest() -> None:
    old = np.random.default_rng(0).uniform(0, 640, (50, 2))
    everything = np.ones(50, dtype=np.bool_)
    assert np.array_equal(match_keypoints(old, old.copy(), everything), np.arange(50))
    order = np.random.default_rng(1).permutation(50)[:40]
    found = match_keypoints(old, old[order] + 0.1, everything)
    assert np.array_equal(found[order], np.arange(40))
    assert (np.delete(found, order) == -1).all()
    assert (match_keypoints(old, old[order], ~everything) == -1).all()


def test_plates_can_be_left_out_by_their_lowest_id() -> None:
    plates = built_in_plates()
    left = plates_without(plates, " 0, 8")
    assert [min(plate.ids) for plate in left][:3] == [4, 12, 16]
    assert plates_without(plates, "") == plates
    with pytest.raises(InputError, match="ignore_plates"):
        plates_without(plates, "board")
