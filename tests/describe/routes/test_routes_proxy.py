"""The manifold stand-in of the wall and the paths on it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from walltopo.core import StageError
from walltopo.describe.routes.geodesic import Geodesics, flat_length, pair_lengths
from walltopo.describe.routes.proxy import build_proxy, fill_small_holes, manifold


def grid(columns: int, rows: int, step: float = 0.1) -> tuple[np.ndarray, np.ndarray]:
    """A flat wall in the xz plane, seen from -y."""
    x, z = np.meshgrid(np.arange(columns + 1) * step, np.arange(rows + 1) * step)
    vertices = np.column_stack([x.ravel(), np.zeros(x.size), z.ravel()])
    a = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    b, c, d = a + 1, a + columns + 1, a + columns + 2
    faces = np.vstack([np.column_stack([a, b, d]), np.column_stack([a, d, c])])
    return vertices, faces


def assert_manifold(vertices: np.ndarray, faces: np.ndarray) -> None:
    """Every edge has at most two triangles, in opposite directions; potpourri3d accepts it."""
    import potpourri3d

    n = len(vertices)
    directed = (faces * n + faces[:, [1, 2, 0]]).ravel()
    assert len(np.unique(directed)) == len(directed)
    assert set(np.unique(faces)) == set(range(n))
    potpourri3d.EdgeFlipGeodesicSolver(vertices, faces)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_any_triangle_soup_becomes_manifold(seed: int) -> None:
    rng = np.random.default_rng(seed)
    vertices = rng.normal(size=(int(rng.integers(4, 14)), 3))
    faces = rng.integers(len(vertices), size=(int(rng.integers(1, 40)), 3))
    points, triangles = manifold(vertices, faces)
    if len(triangles):
        assert_manifold(points, triangles)


def test_fin_on_a_wall_keeps_all_triangles() -> None:
    # A fin that stands on an edge of the wall: three triangles meet along that edge.
    vertices, faces = grid(4, 4)
    fin = len(vertices)
    vertices = np.vstack([vertices, [[0.15, -0.2, 0.2]]])
    faces = np.vstack([faces, [[11, 12, fin]]])
    points, triangles = manifold(vertices, faces)
    assert len(triangles) == len(faces)
    assert_manifold(points, triangles)


def test_small_holes_are_filled_and_the_outline_is_not() -> None:
    vertices, faces = grid(10, 10)
    holed = np.delete(faces, [44, 45, 144, 145], axis=0)
    points, triangles = manifold(vertices, holed)
    filled_points, filled = fill_small_holes(points, triangles)
    assert len(filled) > len(triangles)
    a, b, c = (filled_points[filled[:, k]] for k in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
    assert area == pytest.approx(1.0)


def test_path_on_a_flat_wall_is_straight() -> None:
    vertices, faces = grid(30, 30)
    anchors = np.array([[0.23, 0.0, 0.31], [2.71, 0.05, 2.22]])
    proxy = build_proxy(vertices, faces, anchors, 10_000)
    ends = proxy.vertices[proxy.anchors]
    np.testing.assert_allclose(ends[:, [0, 2]], anchors[:, [0, 2]], atol=2e-3)
    length = pair_lengths(proxy, [(0, 1)], 1.0)
    assert length[0] == pytest.approx(np.linalg.norm(ends[1] - ends[0]), rel=1e-6)
    flat = pair_lengths(proxy, [(0, 1)], 0.0)
    assert flat[0] == pytest.approx(2.48, abs=5e-3)


def test_path_around_an_arete_is_the_unfolded_line() -> None:
    # Two flat walls that meet at a right angle along x = 1.
    vertices, faces = grid(20, 10)
    bent = vertices.copy()
    beyond = vertices[:, 0] > 1.0
    bent[beyond] = np.column_stack(
        [np.ones(beyond.sum()), vertices[beyond, 0] - 1.0, vertices[beyond, 2]]
    )
    anchors = np.array([[0.51, 0.0, 0.22], [1.0, 0.63, 0.84]])
    proxy = build_proxy(bent, faces, anchors, 10_000)
    unfolded = np.hypot(0.49 + 0.63, 0.62)
    assert pair_lengths(proxy, [(0, 1)], 1.0)[0] == pytest.approx(unfolded, rel=3e-3)


def two_walls(gap: float) -> tuple[np.ndarray, np.ndarray]:
    vertices, faces = grid(10, 10)
    other = vertices + np.array([1.0 + gap, 0.0, 0.0])
    return np.vstack([vertices, other]), np.vstack([faces, faces + len(vertices)])


def test_loose_parts_are_bridged_within_the_gap_only() -> None:
    vertices, faces = two_walls(0.2)
    anchors = np.array([[0.5, 0.0, 0.5], [1.7, 0.0, 0.5]])
    proxy = build_proxy(vertices, faces, anchors, 10_000)
    assert pair_lengths(proxy, [(0, 1)], 1.0, bridge_gap=0.3)[0] == pytest.approx(1.2, abs=0.02)
    assert np.isinf(pair_lengths(proxy, [(0, 1)], 1.0, bridge_gap=0.1)[0])


def test_same_lengths_for_any_thread_count() -> None:
    vertices, faces = grid(30, 30)
    rng = np.random.default_rng(3)
    vertices[:, 1] = 0.1 * rng.random(len(vertices))
    anchors = vertices[rng.choice(len(vertices), 40, replace=False)] + 0.01
    proxy = build_proxy(vertices, faces, anchors, 10_000)
    pairs = np.column_stack(np.triu_indices(40, 1))
    one = pair_lengths(proxy, pairs, 0.5, threads=1)
    four = pair_lengths(proxy, pairs, 0.5, threads=4)
    np.testing.assert_array_equal(one, four)
    assert (one > 0).all()


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0, 1))
def test_path_is_never_shorter_than_the_straight_line(seed: int, ratio: float) -> None:
    rng = np.random.default_rng(seed)
    vertices, faces = grid(8, 8)
    vertices[:, 1] = 0.2 * rng.random(len(vertices))
    anchors = vertices[rng.choice(len(vertices), 6, replace=False)]
    proxy = build_proxy(vertices, faces, anchors, 10_000)
    solver = Geodesics(proxy)
    ends = proxy.vertices[proxy.anchors]
    for k in range(1, 6):
        path = solver.path(int(proxy.anchors[0]), int(proxy.anchors[k]))
        assert path is not None
        straight = np.linalg.norm((ends[k] - ends[0]) * [1, 1, ratio])
        assert flat_length(path, ratio) >= straight - 1e-9


def test_mesh_without_area_is_refused() -> None:
    with pytest.raises(StageError, match="triangle"):
        build_proxy(np.zeros((3, 3)), np.array([[0, 1, 2]]), np.zeros((1, 3)), 100)
