"""The z-buffer against single rays, and its handling of awkward triangles."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from walltopo.core import Camera
from walltopo.geometry.rays import Bvh
from walltopo.geometry.screen import screen_vertices, valid_slope
from walltopo.geometry.zbuffer import render_ids

PINHOLE = Camera("PINHOLE", 64, 48, (50.0, 52.0, 32.0, 24.0))
IDENTITY = np.hstack([np.eye(3), np.zeros((3, 1))])


def soup(seed: int, count: int = 60) -> tuple[np.ndarray, np.ndarray]:
    """Random triangles around the origin, some behind the camera, some through its plane."""
    rng = np.random.default_rng(seed)
    centres = rng.uniform([-3, -3, -1], [3, 3, 6], (count, 1, 3))
    corners = centres + rng.normal(0, 0.8, (count, 3, 3))
    return corners.reshape(-1, 3), np.arange(3 * count, dtype=np.int32).reshape(-1, 3)


def pixel_rays(camera: Camera) -> np.ndarray:
    rows, cols = np.mgrid[: camera.height, : camera.width]
    pixels = np.stack([cols + 0.5, rows + 0.5, np.ones(rows.shape)], axis=-1).reshape(-1, 3)
    return pixels @ np.linalg.inv(camera.matrix()).T


@given(seed=st.integers(0, 10_000))
@settings(max_examples=40, deadline=None)
def test_every_pixel_agrees_with_its_ray(seed: int) -> None:
    vertices, faces = soup(seed)
    face_id, depth = render_ids(vertices, faces, PINHOLE, IDENTITY)
    rays = pixel_rays(PINHOLE)
    hit, t = Bvh(vertices, faces).first_hit(np.zeros_like(rays), rays)
    # Pixels may differ only on an outline (rounding) or within the near plane's sliver.
    same = face_id.ravel() == hit
    assert same.mean() > 0.995
    both = same & (hit >= 0)
    np.testing.assert_allclose(depth.ravel()[both], t[both], rtol=1e-3)
    assert np.isinf(depth[face_id < 0]).all()


def test_the_picture_does_not_depend_on_the_number_of_threads() -> None:
    import numba

    vertices, faces = soup(1, 500)
    before = numba.get_num_threads()
    pictures = []
    try:
        for threads in (1, before):
            numba.set_num_threads(threads)
            pictures.append(render_ids(vertices, faces, PINHOLE, IDENTITY)[0])
    finally:
        numba.set_num_threads(before)
    assert np.array_equal(pictures[0], pictures[-1])


def test_lowest_index_wins_among_duplicates() -> None:
    vertices = np.array([[-9, -9, 2], [9, -9, 2], [0, 9, 2.0]])
    faces = np.array([[0, 1, 2], [0, 1, 2], [2, 1, 0]], dtype=np.int32)
    face_id, _ = render_ids(vertices, faces, PINHOLE, IDENTITY)
    assert set(np.unique(face_id)) <= {-1, 0}


@pytest.mark.parametrize(
    "vertices",
    [
        np.array([[0, 0, -1], [1, 0, -1], [0, 1, -1.0]]),  # behind
        np.array([[0, 0, 1], [0, 0, 1], [0, 0, 1.0]]),  # a point
        np.array([[0, 0, 1], [1, 1, 1], [2, 2, 1.0]]),  # a line
        np.array([[900, 0, 1], [901, 0, 1], [900, 1, 1.0]]),  # outside
    ],
)
def test_nothing_is_drawn(vertices: np.ndarray) -> None:
    face_id, depth = render_ids(vertices, np.array([[0, 1, 2]], dtype=np.int32), PINHOLE, IDENTITY)
    assert (face_id == -1).all()
    assert np.isinf(depth).all()


def test_a_floor_that_passes_under_the_camera_fills_the_lower_half() -> None:
    vertices = np.array([[-50, 1, -50], [50, 1, -50], [50, 1, 50], [-50, 1, 50.0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)
    face_id, depth = render_ids(vertices, faces, PINHOLE, IDENTITY)
    assert (face_id[27:] >= 0).all()
    assert (face_id[:24] == -1).all()
    np.testing.assert_allclose(depth[47], 52.0 / 23.5, rtol=1e-5)  # z = fy * 1 / (47.5 - cy)


def test_an_empty_mesh_gives_an_empty_picture() -> None:
    nothing = np.zeros((0, 3))
    face_id, _ = render_ids(nothing, nothing.astype(np.int32), PINHOLE, IDENTITY)
    assert (face_id == -1).all()
    hit, t = Bvh(nothing, nothing.astype(np.int32)).first_hit(np.zeros((1, 3)), np.ones((1, 3)))
    assert hit[0] == -1
    assert np.isinf(t[0])


@pytest.mark.parametrize(
    "camera",
    [
        Camera("SIMPLE_RADIAL", 64, 48, (50.0, 32.0, 24.0, -0.2)),
        Camera("RADIAL", 64, 48, (50.0, 32.0, 24.0, 0.05, -0.02)),
        Camera("OPENCV", 64, 48, (50.0, 51.0, 32.0, 24.0, -0.1, 0.02, 0.003, -0.002)),
        Camera("OPENCV_FISHEYE", 64, 48, (30.0, 30.0, 32.0, 24.0, 0.01, -0.02, 0.0, 0.0)),
    ],
)
def test_distorted_pixels_agree_with_colmap(camera: Camera) -> None:
    from walltopo.geometry.colmap import pycolmap

    theirs = pycolmap.Camera(
        model=camera.model, width=camera.width, height=camera.height, params=camera.params
    )
    rng = np.random.default_rng(3)
    points = rng.uniform([-1, -1, 1], [1, 1, 4], (300, 3))
    points = points[np.hypot(points[:, 0], points[:, 1]) / points[:, 2] < valid_slope(camera)]
    expected = theirs.img_from_cam(points)
    np.testing.assert_allclose(screen_vertices(points, camera)[:, :2], expected, atol=1e-6)


def test_a_fold_of_the_distortion_model_is_not_drawn() -> None:
    folding = Camera("SIMPLE_RADIAL", 64, 48, (50.0, 32.0, 24.0, -0.3))
    assert valid_slope(folding) == pytest.approx(np.sqrt(1 / 0.9), abs=0.01)
    far_out = np.array([[1.7, 0, 1], [1.75, 0, 1], [1.72, 0.1, 1.0]])
    face_id, _ = render_ids(far_out, np.array([[0, 1, 2]], np.int32), folding, IDENTITY)
    assert (face_id == -1).all()


def test_rays_far_from_the_origin_keep_their_precision() -> None:
    offset = np.array([5e6, -3e6, 2e5])
    vertices = np.array([[0, 0, 2], [1, 0, 2], [0, 1, 2.0]]) + offset
    bvh = Bvh(vertices, np.array([[0, 1, 2]], dtype=np.int32))
    hit, t = bvh.first_hit(offset[None] + 0.2, np.array([[0, 0, 3.0]]))
    assert hit[0] == 0
    assert t[0] == pytest.approx(0.6, abs=1e-6)
