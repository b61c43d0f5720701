"""Undistortion and triangulation."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from walltopo.core import Camera, View
from walltopo.geometry.similarity import rotation_with_z
from walltopo.reconstruct.scale.known_distance import (
    mark_point,
    named_points,
    triangulate,
    undistort,
    write_points,
)

CAMERA = Camera("SIMPLE_RADIAL", 1280, 960, (950.0, 640.0, 480.0, 0.035))


def looking_at(target: NDArray[np.float64], eye: NDArray[np.float64], name: str) -> View:
    """A level camera at `eye` that looks at `target` (z up)."""
    ahead = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(ahead, [0, 0, 1.0])
    frame = rotation_with_z(ahead, right)
    rotation = np.stack([frame[0], frame[1], frame[2]])
    return View(name, CAMERA, np.c_[rotation, -rotation @ eye])


def ring(count: int = 5, radius: float = 2.0) -> list[View]:
    angles = np.linspace(0, 1.5, count)
    eyes = [np.array([radius * np.cos(a), radius * np.sin(a), 1.5]) for a in angles]
    return [looking_at(np.zeros(3), eye, f"{k}.jpg") for k, eye in enumerate(eyes)]


@pytest.mark.parametrize(
    ("model", "extra"),
    [
        ("SIMPLE_RADIAL", (0.035,)),
        ("RADIAL", (-0.1, 0.02)),
        ("OPENCV", None),
        ("SIMPLE_PINHOLE", ()),
    ],
)
def test_undistort_inverts_project(model: str, extra: tuple[float, ...] | None) -> None:
    params = (900.0, 910.0, 640.0, 480.0, -0.1, 0.02, 1e-3, -2e-3)
    if extra is not None:
        params = (900.0, 640.0, 480.0, *extra)  # type: ignore[assignment]
    camera = Camera(model, 1280, 960, params)
    pixels = np.random.default_rng(0).uniform([0, 0], [1280, 960], (50, 2))
    uv = undistort(camera, pixels)
    back = camera.project(np.column_stack([uv, np.ones(len(uv))]))
    assert np.abs(back - pixels).max() < 1e-6


@given(st.tuples(*[st.floats(-0.4, 0.4)] * 3))
def test_exact_pixels_give_the_exact_point(place: tuple[float, float, float]) -> None:
    views, point = ring(), np.array(place)
    found = triangulate(views, np.array([view.project(point) for view in views]))
    assert found is not None
    assert np.abs(found.point - point).max() < 1e-6
    assert found.inliers.all()


def test_a_wrong_observation_is_left_out() -> None:
    views, point = ring(), np.array([0.1, -0.2, 0.3])
    pixels = np.array([view.project(point) for view in views])
    pixels[2] += [40, -25]
    found = triangulate(views, pixels)
    assert found is not None
    assert found.inliers.tolist() == [True, True, False, True, True]
    assert np.abs(found.point - point).max() < 1e-6


def test_one_ray_or_parallel_rays_give_nothing() -> None:
    views = ring()
    pixel = views[0].project(np.zeros(3))
    assert triangulate(views[:1], pixel[None]) is None
    assert triangulate([views[0], views[0]], np.stack([pixel, pixel])) is None


@given(st.tuples(*[st.floats(-3, 3)] * 3))
def test_a_marked_point_is_found_again_by_other_units(place: tuple[float, float, float]) -> None:
    """Pixels stand for a point, also where a later model has another unit."""
    views, point = ring(), np.array(place)
    marks = mark_point(point, views)
    for name, pixel in marks.items():
        view = views[int(name[0])]
        assert (np.array(pixel) >= 0).all()
        assert (pixel <= np.array([1280, 960])).all()
        assert view.to_camera(point)[2] > 0
    if len(marks) < 2:
        return
    larger = [
        View(v.name, v.camera, np.c_[v.cam_from_world[:, :3], 3 * v.cam_from_world[:, 3]])
        for v in views
    ]
    with tempfile.TemporaryDirectory() as folder:
        write_points({"a": marks}, Path(folder) / "points.toml")
        found = named_points(Path(folder) / "points.toml", larger)
    assert np.abs(found["a"] - 3 * point).max() < 1e-5


def test_few_photos_stand_for_many() -> None:
    assert 10 <= len(mark_point(np.zeros(3), ring(90))) <= 20
