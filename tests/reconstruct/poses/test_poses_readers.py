"""Poses of other programs: each layout, written from its documentation, read back."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image
from written_poses import SIZE, WRITERS, view_at, write_polycam  # type: ignore[import-not-found]

from walltopo.core import InputError, View
from walltopo.reconstruct.poses.formats import read_poses
from walltopo.scans.poses import GivenPoses

METRIC = ("polycam", "record3d")
LETTERS = "0123"  # Record3D names its photos by numbers


def photos_in(folder: Path, count: int, size: tuple[int, int] = SIZE) -> list[Path]:
    folder.mkdir(parents=True, exist_ok=True)
    files = [folder / f"{LETTERS[k]}.jpg" for k in range(count)]
    for file in files:
        Image.new("RGB", size).save(file)
    return files


def assert_same(found: GivenPoses, views: Sequence[View]) -> None:
    assert [photo.source for photo in found.photos] == [view.name for view in views]
    for photo, view in zip(found.photos, views, strict=True):
        np.testing.assert_allclose(photo.view.cam_from_world, view.cam_from_world, atol=1e-6)
        assert (photo.width, photo.height) == SIZE
        camera = photo.view.camera
        np.testing.assert_allclose(camera.matrix(), view.camera.matrix(), atol=1e-6)
        assert camera.is_pinhole


angles = st.tuples(st.floats(-180, 180), st.floats(-80, 80), st.floats(-180, 180))
places = st.tuples(*[st.floats(-50, 50)] * 3)


@pytest.mark.parametrize("name", WRITERS)
def test_random_cameras_are_read_back(name: str, tmp_path_factory: pytest.TempPathFactory) -> None:
    photos = photos_in(tmp_path_factory.mktemp("photos"), 2)

    @settings(max_examples=20, deadline=None)
    @given(st.lists(st.tuples(angles, places), min_size=2, max_size=2), st.floats(300, 900))
    def check(poses: list[tuple[tuple[float, ...], tuple[float, ...]]], focal: float) -> None:
        folder = tmp_path_factory.mktemp("export")
        views = [
            view_at(photo.name, *pose, focal) for photo, pose in zip(photos, poses, strict=True)
        ]
        WRITERS[name](folder, views)
        found = read_poses(folder, photos)
        assert found.app == name.partition("-")[0]
        assert found.metric == (name in METRIC)
        assert found.up == ((0.0, 1.0, 0.0) if name in METRIC else None)
        assert_same(found, views)

    check()


def two_views() -> list[View]:
    return [view_at(f"{k}.jpg", (10, 20 * k, 5), (k, 0.5, 2), 500.0) for k in range(2)]


def test_a_camera_that_looks_at_the_horizon_is_upright_in_arkit(tmp_path: Path) -> None:
    """ARKit's identity: at the origin, y up, the camera looks along -z."""
    photos = photos_in(tmp_path / "images", 1)
    cameras = tmp_path / "keyframes" / "cameras"
    cameras.mkdir(parents=True)
    entry: dict[str, float] = {
        "fx": 500,
        "fy": 500,
        "cx": 320,
        "cy": 240,
        "width": 640,
        "height": 480,
    }
    entry |= {f"t_{i}{j}": float(i == j) for i in range(3) for j in range(4)}
    (cameras / "0.json").write_text(json.dumps(entry), "utf-8")
    (view,) = (photo.view for photo in read_poses(tmp_path, photos).photos)
    assert view.direction.tolist() == [0, 0, -1]
    # A point above the one ahead is in the upper half of the photo.
    assert view.project(np.array([0.0, 1.0, -5.0]))[1] < 240


def test_polycams_mesh_is_in_a_frame_of_its_own(tmp_path: Path) -> None:
    photos = photos_in(tmp_path / "images", 2)
    write_polycam(tmp_path, two_views())
    matrix = np.eye(4)
    matrix[:3, 3] = (1, 2, 3)
    text = json.dumps({"alignmentTransform": matrix.T.ravel().tolist()})
    (tmp_path / "mesh_info.json").write_text(text, "utf-8")
    frame = read_poses(tmp_path, photos).mesh_frame
    assert frame is not None
    assert frame.similarity.apply(np.zeros(3)).tolist() == [1, 2, 3]
    (tmp_path / "mesh_info.json").write_text('{"alignmentTransform": [1, 2]}', "utf-8")
    with pytest.raises(InputError, match=r"mesh_info\.json"):
        read_poses(tmp_path, photos)


@pytest.mark.parametrize("orientation", [3, 6, 8])
def test_a_pose_turns_with_the_photo_that_exif_turns(orientation: int, tmp_path: Path) -> None:
    """`ingest` turns such photos upright; a point's pixel turns with them."""
    photo = tmp_path / "images" / "0.jpg"
    photos_in(photo.parent, 1)
    exif = Image.Exif()
    exif[0x0112] = orientation
    point = np.array([0.3, -0.2, 6.0])
    views = two_views()[:1]
    stored = views[0].project(point)
    marked = np.zeros((SIZE[1], SIZE[0], 3), dtype=np.uint8)
    column, row = (round(float(x)) for x in stored)
    marked[row - 6 : row + 7, column - 6 : column + 7] = 255
    Image.fromarray(marked).save(photo, exif=exif, quality=95)
    WRITERS["nerfstudio"](tmp_path, views)
    (found,) = read_poses(tmp_path, [photo]).photos
    from PIL import ImageOps

    upright = np.asarray(ImageOps.exif_transpose(Image.open(photo)).convert("L"))
    rows, columns = np.nonzero(upright > 128)
    assert (found.width, found.height) == upright.shape[::-1]
    expected = (columns.mean(), rows.mean())
    np.testing.assert_allclose(found.view.project(point), expected, atol=1.5)


def test_poses_of_other_photos_are_counted(tmp_path: Path) -> None:
    photos = photos_in(tmp_path / "images", 2)
    write_polycam(tmp_path, [*two_views(), view_at("7.jpg", (0, 0, 0), (0, 0, 0), 500.0)])
    found = read_poses(tmp_path, photos)
    assert (len(found.photos), found.others) == (2, 1)
    with pytest.raises(InputError, match="none of its 3 poses"):
        read_poses(tmp_path, [tmp_path / "another.jpg"])


BAD = {
    "polycam": ("keyframes/corrected_cameras/0.json", '{"fx": 1}', "0.json"),
    "record3d": ("metadata", '{"poses": []}', "metadata"),
    "nerfstudio": ("transforms.json", '{"frames": []}', "no frames"),
    "colmap": ("sparse/0/images.txt", "1 2 x\n\n", "unreadable"),
    "realityscan-xmp": ("0.xmp", '<a n="capturingreality.com">', "not valid XML"),
    "realityscan-csv": ("cameras.csv", "#name,x,heading\n0.jpg,1,2\n", "lacks y, alt, pitch"),
    "metashape": ("cameras.xml", "<document><chunk></document>", "not valid XML"),
}


@pytest.mark.parametrize("name", WRITERS)
def test_a_damaged_file_is_named(name: str, tmp_path: Path) -> None:
    photos = photos_in(tmp_path / "images", 2)
    WRITERS[name](tmp_path, two_views())
    file, text, message = BAD[name]
    (tmp_path / file).write_text(text, "utf-8")
    with pytest.raises(InputError, match=message) as failure:
        read_poses(tmp_path, photos)
    assert Path(file).parts[0] in str(failure.value)


def test_entities_are_not_read(tmp_path: Path) -> None:
    photos = photos_in(tmp_path / "images", 2)
    text = '<!DOCTYPE d [<!ENTITY a "b">]><document><chunk>&a;</chunk></document>'
    (tmp_path / "cameras.xml").write_text(text, "utf-8")
    with pytest.raises(InputError, match="entities"):
        read_poses(tmp_path, photos)


def test_a_folder_without_poses_says_what_is_known(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no camera poses") as failure:
        read_poses(tmp_path, [])
    assert "Polycam" in failure.value.hint
    with pytest.raises(InputError, match="no such file"):
        read_poses(tmp_path / "nothing", [])


@pytest.mark.parametrize("name", [name for name in WRITERS if name not in METRIC])
def test_map_coordinates_are_shifted_to_a_local_origin(name: str, tmp_path: Path) -> None:
    photos = photos_in(tmp_path / "images", 2)
    far = np.array([691_000.0, 5_335_000.0, 520.0])
    near = two_views()
    away = [view_at(f"{k}.jpg", (10, 20 * k, 5), far + (k, 0.5, 2), 500.0) for k in range(2)]
    WRITERS[name](tmp_path, away)
    found = read_poses(tmp_path, photos)
    found.save(tmp_path / "poses-kept.json")
    assert GivenPoses.load(tmp_path / "poses-kept.json") == found
    for photo, view in zip(found.photos, near, strict=True):
        centre = photo.view.centre + found.origin - far
        np.testing.assert_allclose(centre, view.centre, atol=1e-6)
        assert np.abs(photo.view.centre).max() < 100
    assert found.mesh_frame is not None
    there = found.mesh_frame.similarity.apply(np.zeros(3))
    np.testing.assert_allclose(there, found.origin)
