"""Learned features: found again in a moved picture, matched, and put behind SIFT's."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from walltopo.reconstruct.sparse.colmap_worker import register_images
from walltopo.reconstruct.sparse.feature_sets import Features
from walltopo.reconstruct.sparse.jobs import CameraEntry, ColmapJob, ImageEntry, LearnedTask, Sift
from walltopo.reconstruct.sparse.learned_features import XFeat, add_learned, partners

TURN = np.array([[0.95, -0.12, 30.0], [0.12, 0.95, -20.0]])


@pytest.fixture(scope="module")
def network() -> XFeat:
    return XFeat()


def speckled(seed: int) -> NDArray[np.uint8]:
    """A picture of blobs, (320, 448, 3)."""
    rng = np.random.default_rng(seed)
    picture = np.full((320, 448, 3), 170, np.uint8)
    for _ in range(160):
        x, y, r = int(rng.integers(448)), int(rng.integers(320)), int(rng.integers(4, 22))
        colour = [int(v) for v in rng.integers(0, 255, 3)]
        cv2.ellipse(
            picture, (x, y), (r, r // 2 + 1), float(rng.uniform(0, 180)), 0, 360, colour, -1
        )
    return cv2.GaussianBlur(picture, (0, 0), 0.8).astype(np.uint8)


def turned(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    size = (picture.shape[1], picture.shape[0])
    return cv2.warpAffine(picture, TURN, size, borderValue=(170, 170, 170)).astype(np.uint8)


def test_matches_follow_the_picture(network: XFeat) -> None:
    picture = speckled(0)
    a, b = network.find(picture, 600), network.find(turned(picture), 600)
    matches = network.match(a, b)
    assert len(matches) > 150
    # Pixel centres: COLMAP's are half a pixel off OpenCV's.
    there = (a.xy[matches[:, 0]] - 0.5) @ TURN[:, :2].T + TURN[:, 2] + 0.5
    away = np.linalg.norm(there - b.xy[matches[:, 1]], axis=1)
    assert np.median(away) < 2
    assert (away < 5).mean() > 0.95


def test_large_photos_are_reduced_and_reported_in_their_own_pixels(
    network: XFeat,
) -> None:
    picture = speckled(1)
    large = cv2.resize(picture, (448 * 5, 320 * 5), interpolation=cv2.INTER_CUBIC).astype(np.uint8)
    found = network.find(large, 300)
    assert found.size == (2240, 1600)
    assert found.xy.max(axis=0)[0] > 1800
    assert np.allclose(np.linalg.norm(found.descriptors, axis=1), 1, atol=1e-4)


def test_a_plain_picture_has_no_features_and_matches_nothing(network: XFeat) -> None:
    plain = network.find(np.full((96, 128, 3), 128, np.uint8), 300)
    some = network.find(speckled(0), 300)
    assert len(plain.xy) == 0
    assert network.match(plain, some).shape == network.match(some, plain).shape == (0, 2)


def test_each_photo_gets_the_partners_that_are_most_like_it(network: XFeat) -> None:
    one, two = speckled(2), speckled(3)
    pictures = {1: one, 4: two, 6: turned(one), 9: turned(two)}
    found = {number: network.find(picture, 300) for number, picture in pictures.items()}
    assert partners(found, 1) == [(1, 6), (4, 9)]
    nothing = Features(np.zeros((0, 2), np.float32), np.zeros((0, 64), np.float32), (10, 10))
    assert partners({1: nothing, 2: nothing}, 3) == []


def test_learned_features_stand_behind_those_that_were_there(tmp_path: Path) -> None:
    from walltopo.geometry.colmap import pycolmap

    one = speckled(4)
    for name, picture in (("a.png", one), ("b.png", turned(one))):
        cv2.imwrite(str(tmp_path / name), picture)
    images = (ImageEntry("a.png", 0), ImageEntry("b.png", 0))
    camera = CameraEntry("SIMPLE_RADIAL", 448, 320, (400.0, 224.0, 160.0, 0.0), prior=True)
    database = tmp_path / "f.db"
    register_images(database, [camera], images)
    rng = np.random.default_rng(0)
    old = {k: rng.uniform(0, 300, (7, 6)).astype(np.float32) for k in (1, 2)}
    with pycolmap.Database.open(database) as db:
        for number, rows in old.items():
            db.write_keypoints(number, rows)
        db.write_matches(1, 2, np.array([[0, 3], [2, 5]], np.uint32))
    learned = LearnedTask((1, 2), 400, 1)
    job = ColmapJob(
        database=str(database),
        image_root=str(tmp_path),
        threads=1,
        seed=0,
        sift=Sift(100, 0),
        min_matches=15,
        cameras=(camera,),
        images=images,
        learned=learned,
    )
    output: list[dict[str, object]] = []
    assert add_learned(database, job, learned, lambda **fields: output.append(fields)) == [(1, 2)]
    assert [event for event in output if "step" in event] == [
        {"step": "turns", "total": 2},
        {"step": "learned", "total": 2},
        {"step": "learned matches", "total": 1},
    ]
    with pycolmap.Database.open(database) as db:
        for number, rows in old.items():
            keypoints = np.asarray(db.read_keypoints(number))
            assert np.array_equal(keypoints[:7, :2], rows[:, :2])
            assert len(keypoints) > 200
        matches = np.asarray(db.read_matches(1, 2))
        assert np.array_equal(matches[:2], [[0, 3], [2, 5]])
        assert len(matches) > 100
        assert matches[2:].min() >= 7
