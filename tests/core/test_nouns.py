"""Mask, View, Mesh, Instances: what they accept, refuse and compute."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from walltopo.core import Camera, InputError, Instance, Instances, Mask, Mesh, View

CAMERA = Camera("PINHOLE", 100, 80, (90.0, 90.0, 50.0, 40.0))


@given(hnp.arrays(np.bool_, st.tuples(st.integers(1, 30), st.integers(1, 30))))
def test_mask_crop_and_back(bitmap: np.ndarray) -> None:
    mask = Mask.from_full(bitmap, label=1)
    np.testing.assert_array_equal(mask.full(), bitmap)
    assert mask.area == bitmap.sum()


@pytest.mark.parametrize(
    ("kwargs", "message"),
    [
        ({"label": 0}, "label"),
        ({"score": 0.0}, "score"),
        ({"score": 1.5}, "score"),
        ({"x": 8}, "extends beyond"),
        ({"bitmap": np.zeros((2, 2))}, "bool"),
    ],
)
def test_bad_masks_are_refused(kwargs: dict[str, object], message: str) -> None:
    values: dict[str, object] = {
        "bitmap": np.ones((4, 4), dtype=np.bool_),
        "x": 0,
        "y": 0,
        "width": 10,
        "height": 10,
        "label": 1,
        "score": 1.0,
    }
    with pytest.raises(InputError, match=message):
        Mask(**(values | kwargs))  # type: ignore[arg-type]


def test_view_centre_and_direction() -> None:
    pose = np.hstack([np.diag([1.0, -1.0, -1.0]), [[1.0], [2.0], [3.0]]])
    view = View("a.jpg", CAMERA, pose)
    np.testing.assert_allclose(view.centre, [-1, 2, 3])
    np.testing.assert_allclose(view.direction, [0, 0, -1])
    np.testing.assert_allclose(view.project(view.centre + 2 * view.direction), [50, 40])


def test_view_refuses_a_sheared_pose() -> None:
    with pytest.raises(InputError, match="rigid"):
        View("a.jpg", CAMERA, np.hstack([np.eye(3) * 2, np.zeros((3, 1))]))


def test_mesh_areas_normals_centroids() -> None:
    mesh = Mesh(np.array([[0, 0, 0], [2, 0, 0], [0, 1, 0.0]]), np.array([[0, 1, 2], [0, 0, 1]]))
    np.testing.assert_allclose(mesh.areas, [1, 0])
    np.testing.assert_allclose(mesh.normals, [[0, 0, 1], [0, 0, 0]])
    np.testing.assert_allclose(mesh.centroids[0], [2 / 3, 1 / 3, 0])


@pytest.mark.parametrize(
    ("vertices", "faces", "message"),
    [
        (np.array([[np.nan, 0, 0]]), np.zeros((0, 3), int), "NaN"),
        (np.zeros((2, 3)), np.array([[0, 1, 2]]), "indices"),
        (np.zeros((2, 2)), np.zeros((0, 3), int), "vertices"),
    ],
)
def test_bad_meshes_are_refused(vertices: np.ndarray, faces: np.ndarray, message: str) -> None:
    with pytest.raises(InputError, match=message):
        Mesh(vertices, faces)


def test_instances_refuse_ids_without_record() -> None:
    faces = np.array([0, 1, 2], dtype=np.int32)
    with pytest.raises(InputError, match=r"\[2\]"):
        Instances(faces, np.zeros(3, np.float32), (Instance(1, 1, 1.0),))
