"""Stickers tie photos: found, matched by their codes, put behind SIFT's keypoints, once."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.images.markers import STICKERS
from walltopo.reconstruct.sparse.colmap_worker import register_images
from walltopo.reconstruct.sparse.jobs import CameraEntry, ColmapJob, ImageEntry, Sift
from walltopo.reconstruct.sparse.stickers import POINTS, add_stickers, sticker_points

SIDE = 64  # px


def picture(stickers: dict[int, tuple[int, int]], twice: int = -1) -> NDArray[np.uint8]:
    """A grey picture (480, 640) with stickers, each given by its top left corner; x, y."""
    table = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, STICKERS))
    image = np.full((480, 640), 210, np.uint8)
    places = [*stickers.items(), *([(twice, (540, 380))] if twice >= 0 else [])]
    for code, (x, y) in places:
        image[y : y + SIDE, x : x + SIDE] = 0.8 * cv2.aruco.generateImageMarker(table, code, SIDE)
    return np.asarray(cv2.GaussianBlur(image, (0, 0), 0.7), np.uint8)


def test_the_points_of_a_sticker_are_a_grid_over_its_square() -> None:
    points = sticker_points(picture({17: (100, 50)}), "a.png")
    assert list(points) == [17]
    wanted = [(100 + SIDE / 2 * x, 50 + SIDE / 2 * y) for y in range(3) for x in range(3)]
    assert np.abs(points[17] - wanted).max() < 0.3


def test_a_code_that_is_there_twice_counts_for_none() -> None:
    assert list(sticker_points(picture({3: (60, 60), 4: (300, 60)}, twice=4), "a.png")) == [3]


def job_of(folder: Path, pictures: list[NDArray[np.uint8]]) -> tuple[Path, ColmapJob]:
    """Write the pictures and register them in a new database."""
    names = [f"{k}.png" for k in range(len(pictures))]
    for name, one in zip(names, pictures, strict=True):
        cv2.imwrite(str(folder / name), one)
    database = folder / "features.db"
    camera = CameraEntry("SIMPLE_RADIAL", 640, 480, (700.0, 320.0, 240.0, 0.0), False)
    images = tuple(ImageEntry(name, 0) for name in names)
    job = ColmapJob(str(database), str(folder), 1, 0, Sift(500, 0), 15, (camera,), images)
    register_images(database, job.cameras, job.images)
    return database, job


def test_photos_are_matched_by_the_codes_behind_their_other_features(tmp_path: Path) -> None:
    from walltopo.geometry.colmap import pycolmap

    a = picture({5: (100, 60), 9: (400, 300), 2: (100, 300)})
    b = picture({9: (300, 200), 5: (40, 40)})
    c = picture({7: (200, 200)})
    database, job = job_of(tmp_path, [a, b, c])
    with pycolmap.Database.open(database) as db:
        for number in (1, 2):
            db.write_keypoints(number, np.full((30, 2), number, np.float32))
            sift = pycolmap.FeatureDescriptors()
            sift.data = np.zeros((30, 128), np.uint8)
            db.write_descriptors(number, sift)
        db.write_matches(1, 2, np.array([[3, 4]], np.uint32))
    assert add_stickers(database, job) == [(1, 2)]
    with pycolmap.Database.open(database) as db:
        matches = np.asarray(db.read_matches(1, 2))
        points = [np.asarray(db.read_keypoints(number))[:, :2] for number in (1, 2)]
    assert matches[0].tolist() == [3, 4]
    assert len(matches) == 1 + 2 * POINTS
    found = sticker_points(a, "a"), sticker_points(b, "b")
    for code in (5, 9):
        for mine, others in zip(found[0][code], found[1][code], strict=True):
            both = [
                (points[0][m] == mine).all() and (points[1][n] == others).all() for m, n in matches
            ]
            assert sum(both) == 1


def test_a_job_that_goes_on_adds_nothing_twice(tmp_path: Path) -> None:
    from walltopo.geometry.colmap import pycolmap

    database, job = job_of(tmp_path, [picture({1: (50, 50)}), picture({1: (90, 90)})])
    assert add_stickers(database, job) == [(1, 2)]
    assert add_stickers(database, job) == []
    with pycolmap.Database.open(database) as db:
        assert db.num_keypoints_for_image(1) == POINTS
        assert len(np.asarray(db.read_matches(1, 2))) == POINTS
