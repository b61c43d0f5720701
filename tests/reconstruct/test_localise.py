"""Pictures find their camera in a scan; pictures of something else find none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from walltopo.core import Camera, InputError, View
from walltopo.geometry.rays import Bvh
from walltopo.reconstruct.landmarks import (
    find_landmarks,
    landmarks_basis,
    read_landmarks,
    save_landmarks,
)
from walltopo.reconstruct.localise import MIN_INLIERS, Localiser, solve_pose
from walltopo.scans.folder import ScanFolder


@pytest.fixture(scope="module")
def views(tiny_scan: Path) -> tuple[View, ...]:
    return ScanFolder.sparse.load(ScanFolder(tiny_scan)).views


@pytest.fixture(scope="module")
def localiser(tiny_scan: Path, views: tuple[View, ...]) -> Localiser:
    """The scan without its first photo, which the tests look for."""
    folder = ScanFolder(tiny_scan)
    photos = ScanFolder.photos.load(folder)
    mesh = ScanFolder.mesh.load(folder)
    bvh = Bvh(mesh.vertices, mesh.faces)
    return Localiser(find_landmarks(views[1:], bvh, photos.read_rgb), bvh)


def test_a_photo_that_the_scan_lacks_is_found(
    tiny_scan: Path, views: tuple[View, ...], localiser: Localiser
) -> None:
    photo = ScanFolder.photos.load(ScanFolder(tiny_scan)).read_rgb(views[0].name)
    known = localiser.localise(localiser.find_features(photo), views[0].camera)
    assert known is not None
    assert np.linalg.norm(_centre(known.cam_from_world) - views[0].centre) < 0.03
    guessed = localiser.localise(localiser.find_features(photo))
    assert guessed is not None
    assert guessed.camera.fx == pytest.approx(views[0].camera.fx, rel=0.05)
    projected = guessed.camera.project(
        guessed.points @ guessed.cam_from_world[:, :3].T + guessed.cam_from_world[:, 3]
    )
    assert np.median(np.linalg.norm(projected - guessed.pixels, axis=1)) < 1.0


def _centre(pose: np.ndarray) -> np.ndarray:
    return np.asarray(-pose[:, :3].T @ pose[:, 3])


def test_features_in_hidden_pixels_do_not_count(
    tiny_scan: Path, views: tuple[View, ...], localiser: Localiser
) -> None:
    photo = ScanFolder.photos.load(ScanFolder(tiny_scan)).read_rgb(views[0].name)
    hidden = np.zeros(photo.shape[:2], np.bool_)
    hidden[:, : photo.shape[1] // 2] = True
    features = localiser.find_features(photo, hidden)
    assert len(features.xy)
    assert features.xy[:, 0].min() >= photo.shape[1] // 2
    assert localiser.localise(localiser.find_features(photo, np.ones_like(hidden))) is None


def test_another_picture_is_not_found(localiser: Localiser) -> None:
    rng = np.random.default_rng(0)
    noise = rng.integers(0, 255, (480, 640, 3)).astype(np.uint8)
    assert localiser.localise(localiser.find_features(noise)) is None


def test_points_that_agree_by_chance_are_no_camera() -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform(-1, 1, (MIN_INLIERS * 4, 3)) + [0, 0, 4]
    pixels = rng.uniform(0, 480, (len(points), 2))
    assert solve_pose(pixels, points, (640, 480), None) is None
    camera = Camera("SIMPLE_PINHOLE", 640, 480, (600.0, 320.0, 240.0))
    right = camera.project(points)
    found = solve_pose(right, points, (640, 480), camera)
    assert found is not None
    assert found.cam_from_world == pytest.approx(np.eye(4)[:3], abs=1e-6)
    assert solve_pose(right[: MIN_INLIERS - 1], points[: MIN_INLIERS - 1], (640, 480), None) is None


def test_a_scan_without_photos_is_refused(tiny_scan: Path) -> None:
    mesh = ScanFolder.mesh.load(ScanFolder(tiny_scan))
    with pytest.raises(InputError, match="no registered photos"):
        Localiser((), Bvh(mesh.vertices, mesh.faces))


def test_kept_landmarks_find_the_same_camera(
    tiny_scan: Path, views: tuple[View, ...], localiser: Localiser, tmp_path: Path
) -> None:
    folder, path = ScanFolder(tiny_scan), tmp_path / "landmarks.npz"
    basis = landmarks_basis(folder)
    assert read_landmarks(path, basis) is None
    save_landmarks(path, localiser.photos, basis)
    kept = read_landmarks(path, basis)
    assert kept is not None
    photo = localiser.find_features(ScanFolder.photos.load(folder).read_rgb(views[0].name))
    first, second = (one.localise(photo) for one in (localiser, Localiser(kept, localiser.bvh)))
    assert first is not None
    assert second is not None
    assert (first.cam_from_world == second.cam_from_world).all()
    assert read_landmarks(path, basis + "another mesh") is None
    path.write_bytes(b"no archive")
    with pytest.raises(InputError, match=r"landmarks\.npz"):
        read_landmarks(path, basis)
