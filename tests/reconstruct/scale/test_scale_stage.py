"""The scale stage on a small synthetic model: which way is taken, and what is written."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from walltopo.core import Camera, InputError, Silent, StageError, View
from walltopo.core.files import hash_path
from walltopo.geometry.similarity import rotation_with_z
from walltopo.pipeline.runner import run_stage
from walltopo.reconstruct.scale.world_frame import TYPICAL_DISTANCE, rotated_photos, up_from_cameras
from walltopo.reconstruct.settings import ScaleSettings
from walltopo.scans.colmap_model import read_views
from walltopo.scans.folder import ScanFolder
from walltopo.scans.scale import Aligned, Frame, Scale

CAMERA = Camera("SIMPLE_RADIAL", 320, 240, (250.0, 160.0, 120.0, 0.02))


def views_along_a_wall(pitch: float = 0.3) -> list[View]:
    """Level cameras 1 unit from a wall in the plane y = 0, pitched up by `pitch`."""
    views = []
    for k, x in enumerate(np.linspace(0, 2, 5)):
        ahead = np.array([-0.2 * (k - 2), 1.0, pitch])
        ahead /= np.linalg.norm(ahead)
        rotation = rotation_with_z(ahead, np.cross(ahead, [0, 0, 1.0]))
        eye = np.array([x, -1.0, 0.2])
        views.append(View(f"p-{k}.jpg", CAMERA, np.c_[rotation, -rotation @ eye]))
    return views


@pytest.fixture
def scan(tmp_path: Path) -> ScanFolder:
    """A scan folder with a model in `work/sparse` and plain photos."""
    from walltopo.geometry.colmap import pycolmap

    folder = ScanFolder(tmp_path / "scan")
    folder.photos.mkdir(parents=True)
    model = pycolmap.Reconstruction()
    camera = pycolmap.Camera(
        model=CAMERA.model, width=320, height=240, params=CAMERA.params, camera_id=1
    )
    model.add_camera_with_trivial_rig(camera)
    points = np.random.default_rng(0).uniform([-0.5, 0, 0], [2.5, 0.05, 1], (60, 3))
    for number, view in enumerate(views_along_a_wall(), start=1):
        image = pycolmap.Image(
            name=view.name, keypoints=view.project(points), camera_id=1, image_id=number
        )
        pose = pycolmap.Rigid3d(
            pycolmap.Rotation3d(view.cam_from_world[:, :3]), view.cam_from_world[:, 3]
        )
        model.add_image_with_trivial_frame(image, pose)
        grey = np.full((240, 320), 127, np.uint8)
        cv2.imwrite(str(folder.photos / view.name), grey)
    for k, point in enumerate(points):
        track = pycolmap.Track([pycolmap.TrackElement(n, k) for n in (1, 2, 3)])
        model.add_point3D(point, track, np.zeros(3, np.uint8))
    folder.sparse_raw.mkdir(parents=True)
    model.write(folder.sparse_raw)
    return folder


class Notes(Silent):
    def __init__(self) -> None:
        self.lines: list[str] = []

    def note(self, message: str) -> None:
        self.lines.append(message)


def scaled(scan: ScanFolder, **settings: Any) -> tuple[Scale, dict[str, View]]:
    run_stage(scan, "scale", ScaleSettings(**settings))
    return Scale.load(scan.scale), {view.name: view for view in read_views(scan.sparse)}


def test_without_a_measure_it_goes_on_unscaled_and_says_so(scan: ScanFolder) -> None:
    notes = Notes()
    metrics = run_stage(scan, "scale", ScaleSettings(), notes)
    assert metrics["metric"] is False
    assert any("UNSCALED" in line for line in notes.lines)
    record = Scale.load(scan.scale)
    assert (record.method, record.up_known, record.floor_known) == ("none", False, False)
    assert record.notes == tuple(notes.lines)
    views = read_views(scan.sparse)
    # Level again although every photo looks up; the wall about 3 m away.
    assert np.degrees(np.arccos(up_from_cameras(views)[2])) < 1e-3
    assert abs(views[0].centre[2] - views[4].centre[2]) < 1e-6
    wall = np.array([p.xyz for p in _points(scan)])
    assert np.median(views[2].to_camera(wall)[:, 2]) == pytest.approx(TYPICAL_DISTANCE, rel=0.35)


def _points(scan: ScanFolder) -> list[Any]:
    from walltopo.geometry.colmap import pycolmap

    return list(pycolmap.Reconstruction(scan.sparse).points3D.values())


def test_distance_of_two_photos(scan: ScanFolder) -> None:
    record, views = scaled(scan, distance="p-0-p-4.jpg=5.0")
    apart = np.linalg.norm(views["p-0.jpg"].centre - views["p-4.jpg"].centre)
    assert apart == pytest.approx(5.0)
    assert (record.metric, record.method, record.up_known) == (True, "distance", False)


def test_distance_of_two_marked_points(scan: ScanFolder, tmp_path: Path) -> None:
    views = {view.name: view for view in views_along_a_wall()}
    places = {"left": np.array([0.8, 0.0, 0.4]), "top-right": np.array([1.3, 0.0, 0.7])}
    text = ""
    for name, place in places.items():
        text += f'["{name}"]\n'
        for photo in ("p-1.jpg", "p-2.jpg", "p-3.jpg"):
            x, y = views[photo].project(place)
            text += f'"{photo}" = [{x:.3f}, {y:.3f}]\n'
    file = tmp_path / "points.toml"
    file.write_text(text, encoding="utf-8")
    record, _ = scaled(scan, distance="left-top-right=1.0", points=str(file))
    assert record.scale == pytest.approx(1 / np.hypot(0.5, 0.3), rel=1e-4)
    for wrong, output in (
        ("[20.0, 200.0]", "do not meet in one"),
        ("[900, 1]", "outside its photo"),
    ):
        line = next(line for line in text.splitlines() if line.startswith('"p-1.jpg"'))
        file.write_text(text.replace(line, f'"p-1.jpg" = {wrong}'), encoding="utf-8")
        with pytest.raises(InputError, match=output):
            scaled(scan, distance="left-top-right=1.0", points=str(file))


@pytest.mark.parametrize(
    ("distance", "output"),
    [
        ("p-0", "expected A-B=METRES"),
        ("p-0-p-1=-2", "expected A-B=METRES"),
        ("p-0-p-0=2", "does not name two different"),
        ("p-0-nobody=2", "does not name two different"),
    ],
)
def test_a_wrong_distance_is_reported(scan: ScanFolder, distance: str, output: str) -> None:
    with pytest.raises(InputError, match=output):
        scaled(scan, distance=distance)
    assert not scan.scale.exists()


def test_insisting_on_the_measure_fails_without_one(scan: ScanFolder) -> None:
    with pytest.raises(StageError, match="no plate is seen"):
        scaled(scan, method="measure")
    assert not scan.sparse.exists()


def test_a_reference_frame_is_kept_to_the_last_bit(scan: ScanFolder) -> None:
    frame = Frame(metric=True, up_known=True, floor_known=True)
    Aligned(
        reference="old", align="constrained", reference_moved=0.0, shared_points=100, frame=frame
    ).save(scan.aligned)
    record, views = scaled(scan)
    assert (record.method, record.frame) == ("reference", frame)
    for view in read_views(scan.sparse_raw):
        assert np.array_equal(view.cam_from_world, views[view.name].cam_from_world)


def test_a_rerun_replaces_the_old_result(scan: ScanFolder) -> None:
    scaled(scan)
    record, views = scaled(scan, distance="p-0-p-1=1.0")
    assert record.method == "distance"
    assert np.linalg.norm(views["p-0.jpg"].centre - views["p-1.jpg"].centre) == pytest.approx(1)


def test_a_failing_rerun_leaves_the_old_result(scan: ScanFolder) -> None:
    scaled(scan, distance="p-0-p-1=1.0")
    before = hash_path(scan.scale), hash_path(scan.sparse)
    with pytest.raises(StageError, match="no plate is seen"):
        scaled(scan, method="measure")
    assert (hash_path(scan.scale), hash_path(scan.sparse)) == before


def test_a_photo_on_its_side_has_no_say_about_up() -> None:
    views = views_along_a_wall()
    quarter = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    on_side = [View(f"side-{v.name}", v.camera, quarter @ v.cam_from_world) for v in views[:2]]
    mixed = [*on_side, *views]
    assert np.allclose(up_from_cameras(mixed), up_from_cameras(views))
    assert rotated_photos(mixed, up_from_cameras(mixed)) == ["side-p-0.jpg", "side-p-1.jpg"]
