"""`walltopo lift` on files of other programs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from walltopo.cli import main
from walltopo.core import InputError
from walltopo.geometry.mesh_files import read_mesh
from walltopo.segment.lift_files import read_cameras, read_masks
from walltopo.segment.lift_matching import attach_masks


def test_cameras_come_back_as_they_were(files: Path, three_bumps: Any) -> None:
    for got, view in zip(read_cameras(files / "transforms.json"), three_bumps[1], strict=True):
        assert got.name == view.name
        np.testing.assert_allclose(got.cam_from_world, view.cam_from_world, atol=1e-9)


def test_the_command_writes_instances_and_pictures(files: Path) -> None:
    given = ["--mesh", "mesh.ply", "--cameras", "transforms.json", "--masks", "ids", "-o", "out"]
    paths = [text if text.startswith("-") else str(files / text) for text in given]
    assert main(["lift", *paths, "--normalised"]) == 0
    found = json.loads((files / "out" / "instances.json").read_text())
    assert len(found["instances"]) == 3
    assert found["instances"][0]["class"] == "object"
    with np.load(files / "out" / "instances.npz") as arrays:
        assert sorted(np.unique(arrays["face_instance"])) == [0, 1, 2, 3]
    coloured = read_mesh(files / "out" / "instances.ply").vertex_colours
    assert coloured is not None
    assert len(np.unique(coloured, axis=0)) == 4
    assert (files / "out" / "instances.glb").stat().st_size > 1000


def test_the_command_refines_borders_beside_its_other_results(files: Path) -> None:
    given = ["--mesh", "mesh.ply", "--cameras", "transforms.json", "--masks", "ids", "-o", "out"]
    paths = [text if text.startswith("-") else str(files / text) for text in given]
    assert main(["lift", *paths, "--refine-borders", "1"]) == 0
    for folder, mesh in (("out", "mesh.ply"), ("out/refined", "out/refined/mesh.ply")):
        with np.load(files / folder / "instances.npz") as arrays:
            assert len(arrays["face_instance"]) == len(read_mesh(files / mesh).faces)
    finer = read_mesh(files / "out" / "refined" / "mesh.ply")
    assert len(finer.faces) > len(read_mesh(files / "mesh.ply").faces)


def test_masks_of_other_photos_are_refused(files: Path) -> None:
    views = read_cameras(files / "transforms.json")
    with pytest.raises(InputError, match="common"):
        attach_masks(views, {"another.jpg": ()})


def test_a_coloured_picture_of_masks_is_refused(tmp_path: Path) -> None:
    import cv2

    cv2.imwrite(str(tmp_path / "a.png"), np.zeros((4, 4, 3), dtype=np.uint8))
    with pytest.raises(InputError, match="channel"):
        read_masks(tmp_path)


def test_what_is_no_camera_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "transforms.json").write_text("{}")
    with pytest.raises(InputError, match="frames"):
        read_cameras(tmp_path / "transforms.json")
    with pytest.raises(InputError, match="COLMAP"):
        read_cameras(tmp_path / "cameras.txt")


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"transform_matrix": [[-1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]}, "mirrors"),
        ({"transform_matrix": [[0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]}, "is not a rotation"),
        ({"transform_matrix": [[1, 2, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]}, "rigid"),
        ({"transform_matrix": [[1, 0, 0, 1e300], [0, 1, 0, 0], [0, 0, 1, 0]]}, "transform_matrix"),
        ({"transform_matrix": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}, "transform_matrix"),
        ({"w": 2**31}, "w"),
        ({"fl_x": -5}, "focal"),
        ({"file_path": ""}, "name"),
        ({"file_path": 3}, "file_path"),
    ],
)
def test_cameras_that_are_none_are_named(
    files: Path, change: dict[str, object], named: str
) -> None:
    path = files / "transforms.json"
    data = json.loads(path.read_text())
    data["frames"][2] |= change
    path.write_text(json.dumps(data))
    with pytest.raises(InputError, match=rf"transforms\.json: frame 2: .*{named}"):
        read_cameras(path)


def test_two_photos_of_one_name_are_refused(files: Path) -> None:
    path = files / "transforms.json"
    data = json.loads(path.read_text())
    data["frames"].append(data["frames"][0])
    path.write_text(json.dumps(data))
    with pytest.raises(InputError, match="occurs twice"):
        read_cameras(path)
