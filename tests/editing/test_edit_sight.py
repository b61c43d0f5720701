"""A window of a photo is drawn from few triangles, and shows what all of them would."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_wall import SCAN  # type: ignore[import-not-found]

from walltopo.core import Camera, View
from walltopo.editing.view_crops import _crop_camera
from walltopo.geometry.rays import triangle_index_of
from walltopo.geometry.zbuffer import render_culled, render_ids

TURN = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # x right, y down, z forward
VIEW = View(
    "1.png",
    Camera("PINHOLE", 4, 4, (1.0, 1.0, 2.0, 2.0)),
    np.column_stack([TURN, [-2.5, 1.8, 2.0]]),
)
CAMERAS = [
    Camera("SIMPLE_PINHOLE", 640, 480, (480.0, 320.0, 240.0)),
    Camera("SIMPLE_RADIAL", 640, 480, (300.0, 320.0, 240.0, -0.2)),
    Camera("OPENCV_FISHEYE", 640, 480, (260.0, 260.0, 320.0, 240.0, 0.1, 0.0, 0.0, 0.0)),
]


@pytest.mark.parametrize("camera", CAMERAS, ids=lambda camera: camera.model)
@pytest.mark.parametrize("corner", [(0, 0), (280, 200), (520, 380)])
def test_a_window_shows_what_the_whole_mesh_does(camera: Camera, corner: tuple[int, int]) -> None:
    window = _crop_camera(camera, *corner, 120, 100)
    mesh = SCAN.mesh
    face, depth = render_culled(mesh, window, VIEW.cam_from_world)
    whole = render_ids(mesh.vertices, mesh.faces, window, VIEW.cam_from_world)
    np.testing.assert_array_equal(face, whole[0])
    np.testing.assert_array_equal(depth, whole[1])


@given(
    eye=st.tuples(*[st.floats(-1, 5)] * 3),
    to=st.integers(0, len(SCAN.mesh.faces) - 1),
    half_angle=st.floats(0.01, 1.5),
)
@settings(max_examples=40, deadline=None)
def test_a_cone_misses_no_triangle(
    eye: tuple[float, float, float], to: int, half_angle: float
) -> None:
    mesh, tip = SCAN.mesh, np.array(eye)
    axis = mesh.centroids[to] - tip
    length = float(np.linalg.norm(axis))
    if length < 1e-6:
        return
    axis /= length
    found = triangle_index_of(mesh).in_cone(tip, axis, half_angle)
    assert (np.diff(found) > 0).all()
    towards = mesh.vertices[mesh.faces] - tip
    away = np.linalg.norm(towards, axis=2)
    inside = ((towards @ axis) > np.cos(half_angle) * away + 1e-9).any(axis=1)
    inside[to] = True  # the axis meets its middle
    assert set(np.flatnonzero(inside)) <= set(found.tolist())
