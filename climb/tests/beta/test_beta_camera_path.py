"""The camera of a clip: of a phone that stands, that turns, and of another wall."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from walltopo.core import InputError, View
from walltopo.geometry.rays import Bvh
from walltopo.reconstruct.landmarks import find_landmarks
from walltopo.reconstruct.localise import Localiser
from walltopo.scans.folder import ScanFolder
from walltopo_climb.beta.camera_path import CameraTracker

Image = NDArray[np.uint8]
Floats = NDArray[np.float64]
FRAMES = 14


@pytest.fixture(scope="module")
def view(tiny_scan: Path) -> View:
    return ScanFolder.sparse.load(ScanFolder(tiny_scan)).views[0]


@pytest.fixture(scope="module")
def photo(tiny_scan: Path, view: View) -> Image:
    return ScanFolder.photos.load(ScanFolder(tiny_scan)).read_rgb(view.name)


@pytest.fixture(scope="module")
def localiser(tiny_scan: Path) -> Localiser:
    folder = ScanFolder(tiny_scan)
    photos = ScanFolder.photos.load(folder)
    views = ScanFolder.sparse.load(folder).views[1:]
    mesh = ScanFolder.mesh.load(folder)
    bvh = Bvh(mesh.vertices, mesh.faces)
    return Localiser(find_landmarks(views, bvh, photos.read_rgb), bvh)


def turned(view: View, photo: Image, angle: float) -> tuple[Image, View]:
    """Return the photo and the view of a camera that was turned by an angle, radians.

    A turn about the centre moves all pixels alike, whatever their depth; the small photo is
    enlarged, and its lens has next to no distortion.
    """
    cos, sin = np.cos(angle), np.sin(angle)
    turn = np.array([[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]])
    camera = view.camera.scaled(2).pinhole()
    matrix = camera.matrix() @ turn @ np.linalg.inv(view.camera.pinhole().matrix())
    size = (camera.width, camera.height)
    picture = cv2.warpPerspective(photo, matrix, size, borderMode=cv2.BORDER_REFLECT)
    return np.asarray(picture, np.uint8), View(view.name, camera, turn @ view.cam_from_world)


def test_a_phone_that_stands_has_one_pose(localiser: Localiser, view: View, photo: Image) -> None:
    tracker = CameraTracker(localiser)
    frame, there = turned(view, photo, 0.0)
    for number in range(FRAMES):
        tracker.observe(number / 10, frame)
    path = tracker.path()
    assert path.is_still
    assert path.is_placed.all()
    assert (path.cam_from_world == path.cam_from_world[:1]).all()
    assert _error(path.camera.project, path.cam_from_world[0], there) < 2.0


def test_a_phone_that_turns_is_followed(localiser: Localiser, view: View, photo: Image) -> None:
    tracker = CameraTracker(localiser)
    truth = []
    for number in range(FRAMES):
        frame, there = turned(view, photo, 0.006 * number)
        tracker.observe(number / 10, frame)
        truth.append(there)
    path = tracker.path()
    assert not path.is_still
    assert path.is_placed.all()
    errors = [
        _error(path.camera.project, pose, there)
        for pose, there in zip(path.cam_from_world, truth, strict=True)
    ]
    assert max(errors) < 3.0


def _error(project: object, pose: Floats, there: View) -> float:
    """Return the median distance of points before the camera in both views, pixels."""
    grid = np.stack(np.meshgrid(np.linspace(100, 860, 6), np.linspace(80, 640, 6)), -1)
    rays = (grid.reshape(-1, 2) - [there.camera.cx, there.camera.cy]) / there.camera.fx
    local = 3.0 * np.column_stack([rays, np.ones(len(rays))])
    rotation = there.cam_from_world[:, :3]
    points = (local - there.cam_from_world[:, 3]) @ rotation
    assert callable(project)
    seen = project(points @ pose[:, :3].T + pose[:, 3])
    return float(np.median(np.linalg.norm(seen - there.project(points), axis=1)))


def test_frames_in_between_that_show_nothing_are_bridged(
    localiser: Localiser, view: View, photo: Image
) -> None:
    tracker = CameraTracker(localiser)
    frame, _ = turned(view, photo, 0.0)
    grey = np.full_like(frame, 90)
    for number in range(21):
        tracker.observe(number / 10, grey if number in (5, 6) or number > 17 else frame)
    path = tracker.path()
    assert path.is_placed[:18].all()
    assert not path.is_placed[18:].any()
    assert path.cam_from_world[20] == pytest.approx(path.cam_from_world[17])


def test_another_wall_is_refused(localiser: Localiser) -> None:
    tracker = CameraTracker(localiser)
    rng = np.random.default_rng(1)
    for number in range(12):
        tracker.observe(number / 10, rng.integers(0, 255, (360, 480, 3)).astype(np.uint8))
    with pytest.raises(InputError, match="does not show this wall"):
        tracker.path()


def test_most_of_a_clip_has_to_show_the_wall(
    localiser: Localiser, view: View, photo: Image
) -> None:
    tracker = CameraTracker(localiser)
    frame, _ = turned(view, photo, 0.0)
    for number in range(12):
        tracker.observe(number / 10, frame if number < 4 else np.full_like(frame, 90))
    with pytest.raises(InputError, match="only 4 of 12 frames"):
        tracker.path()


def test_frames_of_changing_size_are_refused(localiser: Localiser) -> None:
    tracker = CameraTracker(localiser)
    tracker.observe(0.0, np.zeros((360, 480, 3), np.uint8))
    with pytest.raises(InputError, match="change their size"):
        tracker.observe(0.1, np.zeros((480, 360, 3), np.uint8))
