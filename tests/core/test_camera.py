"""Camera models against pycolmap's own projection."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from walltopo.core import Camera, InputError
from walltopo.geometry.colmap import pycolmap

MODELS = {
    "SIMPLE_PINHOLE": (900.0, 640.0, 480.0),
    "PINHOLE": (900.0, 910.0, 640.0, 480.0),
    "SIMPLE_RADIAL": (900.0, 640.0, 480.0, 0.035),
    "RADIAL": (900.0, 640.0, 480.0, 0.035, -0.01),
    "OPENCV": (900.0, 910.0, 640.0, 480.0, 0.03, -0.01, 0.001, -0.002),
    "FULL_OPENCV": (900.0, 910.0, 640.0, 480.0, 0.1, -0.05, 1e-3, -2e-3, 0.01, 0.08, -0.03, 0.01),
    "OPENCV_FISHEYE": (500.0, 510.0, 640.0, 480.0, 0.02, -0.01, 0.001, 0.002),
}


@pytest.mark.parametrize("model", MODELS)
def test_projection_equals_pycolmap(model: str) -> None:
    generator = np.random.default_rng(0)
    points = generator.uniform((-1, -0.8, 1.5), (1, 0.8, 6.0), (200, 3))
    camera = Camera(model, 1280, 960, MODELS[model])
    theirs = pycolmap.Camera(model=model, width=1280, height=960, params=list(MODELS[model]))
    expected = np.array([theirs.img_from_cam(p) for p in points])
    np.testing.assert_allclose(camera.project(points), expected, atol=1e-6)


def test_points_behind_are_nan() -> None:
    camera = Camera("PINHOLE", 100, 100, (50.0, 50.0, 50.0, 50.0))
    pixels = camera.project(np.array([[0.0, 0, 1], [0, 0, -1], [0, 0, 0]]))
    assert np.isnan(pixels).tolist() == [[False, False], [True, True], [True, True]]


@given(st.floats(0.25, 4.0), st.sampled_from(sorted(MODELS)))
def test_scaled_camera_scales_pixels(factor: float, model: str) -> None:
    camera = Camera(model, 1280, 960, MODELS[model])
    scaled = camera.scaled(factor)
    point = np.array([[0.3, -0.2, 2.0]])
    ratio = np.array([scaled.width / 1280, scaled.height / 960])
    # Sizes are rounded; models with one focal length cannot follow a stretch by half a pixel.
    np.testing.assert_allclose(scaled.project(point), camera.project(point) * ratio, atol=0.3)


@pytest.mark.parametrize(
    ("model", "params", "message"),
    [
        ("FOV", (1.0,), "supported"),
        ("PINHOLE", (1.0, 2.0), "4 parameters"),
        ("SIMPLE_PINHOLE", (-1.0, 2.0, 2.0), "focal"),
        ("SIMPLE_PINHOLE", (float("nan"), 2.0, 2.0), "finite"),
    ],
)
def test_bad_cameras_are_refused(model: str, params: tuple[float, ...], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Camera(model, 10, 10, params)
