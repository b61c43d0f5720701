"""Nearest surface: against brute force and against trimesh."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from walltopo.core import InputError
from walltopo_lab.evaluate.surface import Surface, distance_to_triangles, sample_faces

TRIANGLE = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])


@pytest.mark.parametrize(
    ("point", "distance"),
    [
        ((0.2, 0.2, 0.5), 0.5),  # above the inside
        ((-3.0, 0.0, 4.0), 5.0),  # beyond a corner
        ((0.5, -2.0, 0.0), 2.0),  # beyond an edge
        ((1.0, 1.0, 0.0), np.sqrt(0.5)),  # beyond the long edge
        ((0.25, 0.25, 0.0), 0.0),  # on it
    ],
)
def test_distance_by_hand(point: tuple[float, ...], distance: float) -> None:
    found = distance_to_triangles(np.array([point]), TRIANGLE[None])
    assert found[0] == pytest.approx(distance, abs=1e-12)


def test_triangle_without_area_is_its_edges() -> None:
    line = np.array([[[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]])
    assert distance_to_triangles(np.array([[1.5, 3.0, 0.0]]), line)[0] == pytest.approx(3.0)


@given(seed=st.integers(0, 10_000))
@settings(max_examples=60, deadline=None)
def test_distance_is_no_more_than_to_any_sample(seed: int) -> None:
    rng = np.random.default_rng(seed)
    corners, point = rng.normal(size=(3, 3)), rng.normal(size=3)
    samples, _ = sample_faces(corners, np.array([[0, 1, 2]], np.int32), 0.02)
    nearest = np.linalg.norm(samples - point, axis=1).min()
    exact = distance_to_triangles(point[None], corners[None])[0]
    assert exact <= nearest + 1e-12
    assert nearest <= exact + 0.02


def test_large_and_small_triangles_together() -> None:
    vertices = np.array([[0.0, 0, 0], [9, 0, 0], [0, 9, 0], [0, 0, 1], [0.01, 0, 1], [0, 0.01, 1]])
    surface = Surface(vertices, np.array([[0, 1, 2], [3, 4, 5]], np.int32))
    face, distance = surface.nearest(np.array([[2.0, 2, 0.2], [0, 0, 0.9], [0, 0, -5]]), within=1)
    assert face.tolist() == [0, 1, -1]
    assert distance[:2] == pytest.approx([0.2, 0.1])
    assert np.isinf(distance[2])


def test_no_triangles_are_refused() -> None:
    with pytest.raises(InputError, match="triangles"):
        Surface(np.zeros((3, 3)), np.zeros((0, 3), np.int32))


def test_sphere_distance() -> None:
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=4, radius=1.0)
    rng = np.random.default_rng(1)
    points = rng.normal(size=(200, 3))
    points *= (0.7 + 0.6 * rng.random((200, 1))) / np.linalg.norm(points, axis=1, keepdims=True)
    surface = Surface(np.asarray(ball.vertices), np.asarray(ball.faces, np.int32), 0.02)
    _, distance = surface.nearest(points)
    expected = np.abs(np.linalg.norm(points, axis=1) - 1)
    assert np.abs(distance - expected).max() < 0.003  # the ball's facets are up to 2 mm inside
