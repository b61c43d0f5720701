"""COCO, COLMAP and PLY files: there and back, and broken ones."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from walltopo.core import InputError, Mask, Mesh
from walltopo.geometry.colmap import pycolmap
from walltopo.geometry.mesh_files import read_mesh, write_ply
from walltopo.scans.coco_import import read_coco_masks
from walltopo.scans.colmap_model import read_views
from walltopo.scans.detections import Detections


def _mask(seed: int, label: int, score: float) -> Mask:
    bitmap = np.random.default_rng(seed).random((20, 30)) > 0.5
    return Mask.from_full(bitmap, label, score)


def test_coco_there_and_back(tmp_path: Path) -> None:
    masks = {"ä b.jpg": (_mask(0, 1, 0.5), _mask(1, 2, 1.0))}
    sizes = {"ä b.jpg": (30, 20), "none.jpg": (30, 20)}
    Detections(masks, sizes, {1: "hold", 2: "volume"}).save(tmp_path / "d.json")
    read, classes = read_coco_masks(tmp_path / "d.json")
    assert classes == {1: "hold", 2: "volume"}
    assert read["none.jpg"] == ()
    for before, after in zip(masks["ä b.jpg"], read["ä b.jpg"], strict=True):
        np.testing.assert_array_equal(before.full(), after.full())
        assert (before.label, before.score) == (after.label, after.score)


def test_coco_polygons_and_plain_rle(tmp_path: Path) -> None:
    annotation: dict[str, Any] = {"id": 1, "image_id": 1, "category_id": 1}
    square = [2, 2, 6, 2, 6, 6, 2, 6]
    counts = [0, 3, 97]
    data = {
        "images": [{"id": 1, "file_name": "a.jpg", "width": 10, "height": 10}],
        "categories": [{"id": 1, "name": "hold"}],
        "annotations": [
            annotation | {"segmentation": [square]},
            annotation | {"segmentation": {"size": [10, 10], "counts": counts}},
        ],
    }
    path = tmp_path / "c.json"
    path.write_text(json.dumps(data))
    polygon, rle = read_coco_masks(path)[0]["a.jpg"]
    assert polygon.box == (2, 2, 4, 4)
    assert rle.area == 3
    data["annotations"][0]["segmentation"] = "nonsense"
    path.write_text(json.dumps(data))
    with pytest.raises(InputError, match=r"annotations\[0\]"):
        read_coco_masks(path)


def test_ply_there_and_back(tmp_path: Path) -> None:
    vertices = np.random.default_rng(0).normal(size=(4, 3)).astype(np.float32).astype(float)
    colours = np.arange(12, dtype=np.uint8).reshape(4, 3)
    mesh = Mesh(vertices, np.array([[0, 1, 2], [2, 1, 3]], dtype=np.int32), colours)
    write_ply(tmp_path / "m.ply", mesh)
    read = read_mesh(tmp_path / "m.ply")
    np.testing.assert_array_equal(read.vertices, mesh.vertices)
    np.testing.assert_array_equal(read.faces, mesh.faces)
    assert read.vertex_colours is not None
    np.testing.assert_array_equal(read.vertex_colours, colours)
    assert read.guessed is None


def test_guesses_there_and_back(tmp_path: Path) -> None:
    corners = np.eye(4, 3)
    mesh = Mesh(corners, np.array([[0, 1, 2], [2, 1, 3], [0, 2, 3]], dtype=np.int32), None)
    mesh = replace(mesh, guessed=np.array([False, True, True]))
    write_ply(tmp_path / "m.ply", mesh)
    read = read_mesh(tmp_path / "m.ply")
    assert read.measured.tolist() == [True, False, False]
    alone = read.without_guesses()
    assert alone.guessed is None
    np.testing.assert_array_equal(alone.vertices, corners[:3])
    np.testing.assert_array_equal(alone.faces, [[0, 1, 2]])
    assert replace(mesh, guessed=np.zeros(3, np.bool_)).guessed is None
    with pytest.raises(InputError, match="guessed"):
        replace(mesh, guessed=np.array([True]))


def test_a_list_of_guesses_is_reported(tmp_path: Path) -> None:
    path = tmp_path / "m.ply"
    path.write_text(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
        "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
        "property list uchar int guessed\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 2 1 1\n"
    )
    with pytest.raises(InputError, match=r"m\.ply"):
        read_mesh(path)


@pytest.mark.parametrize("content", [b"", b"not a mesh", b"ply\nformat ascii 1.0\nend_header\n"])
def test_broken_meshes_are_reported(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "m.ply"
    path.write_bytes(content)
    with pytest.raises(InputError, match=str(path)):
        read_mesh(path)


def test_colmap_views_project_like_pycolmap(gym_a: Path) -> None:
    views = read_views(gym_a / "lift" / "cameras")
    assert len(views) == 60
    truth = np.load(gym_a / "gt.npz")["cam_from_world"]
    np.testing.assert_allclose(views[7].cam_from_world, truth[7], atol=1e-6)


def test_empty_colmap_folder_is_reported(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="COLMAP"):
        read_views(tmp_path)
    pycolmap.Reconstruction().write(str(tmp_path))
    with pytest.raises(InputError, match="registered"):
        read_views(tmp_path)
