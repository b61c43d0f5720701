"""A photo drawn from the triangles that may lie in it shows what the whole mesh does."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from walltopo.core import Camera, Mesh
from walltopo.geometry.zbuffer import faces_in_view, render_culled, render_ids, submesh

CAMERAS = [
    Camera("PINHOLE", 64, 48, (50.0, 52.0, 32.0, 24.0)),
    Camera("SIMPLE_RADIAL", 64, 48, (40.0, 32.0, 24.0, -0.15)),
    Camera("OPENCV_FISHEYE", 64, 48, (20.0, 20.0, 32.0, 24.0, 0.05, 0.0, 0.0, 0.0)),
]


def hall(seed: int, count: int = 3000) -> Mesh:
    """Small triangles at random, some metres around the origin on all sides."""
    rng = np.random.default_rng(seed)
    centres = rng.normal(0, 1, (count, 1, 3))
    centres *= rng.uniform(2, 6, (count, 1, 1)) / np.linalg.norm(centres, axis=2, keepdims=True)
    corners = centres + rng.normal(0, 0.08, (count, 3, 3))
    return Mesh(corners.reshape(-1, 3), np.arange(3 * count, dtype=np.int32).reshape(-1, 3))


def pose(rng: np.random.Generator) -> np.ndarray:
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    rotation = q * np.sign(np.diag(r))
    rotation[2] *= np.sign(np.linalg.det(rotation))
    return np.column_stack([rotation, rng.normal(0, 0.5, 3)])


@pytest.mark.parametrize("camera", CAMERAS, ids=lambda camera: camera.model)
@given(seed=st.integers(0, 10_000))
@settings(max_examples=15, deadline=None)
def test_the_part_shows_what_the_whole_does(camera: Camera, seed: int) -> None:
    mesh, view = hall(seed), pose(np.random.default_rng(seed + 1))
    face, depth = render_culled(mesh, camera, view)
    whole_face, whole_depth = render_ids(mesh.vertices, mesh.faces, camera, view)
    # A triangle cut at the near plane is cut at that of what is drawn.
    same = face == whole_face
    assert same.mean() > 0.999
    np.testing.assert_allclose(depth[same], whole_depth[same], rtol=1e-6)


def test_few_triangles_of_a_hall_are_before_a_photo() -> None:
    mesh = hall(3)
    rows = faces_in_view(mesh, CAMERAS[0], np.eye(4)[:3])
    assert 0 < len(rows) < 0.4 * len(mesh.faces)
    vertices, faces = submesh(mesh, rows)
    assert len(vertices) == 3 * len(rows)
    np.testing.assert_array_equal(vertices[faces], mesh.vertices[mesh.faces[rows]])


def test_a_mesh_without_triangles_shows_nothing() -> None:
    empty = Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32))
    face, depth = render_culled(empty, CAMERAS[0], np.eye(4)[:3])
    assert (face == -1).all()
    assert np.isinf(depth).all()
