"""Similarities, mean rotations and planes: exactness, group axioms, robustness."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from walltopo.core import InputError, Mesh
from walltopo.geometry.similarity import (
    Similarity,
    fit_plane,
    fit_similarity,
    fit_similarity_robust,
    mean_rotation,
    rotation_with_z,
)

numbers = st.floats(-5, 5, allow_nan=False)


@st.composite
def similarities(draw: st.DrawFn) -> Similarity:
    vector = [draw(st.floats(-3, 3)) for _ in range(3)]
    shift = np.array([draw(numbers) for _ in range(3)])
    return Similarity(draw(st.floats(0.1, 10)), Rotation.from_rotvec(vector).as_matrix(), shift)


def cloud(seed: int, count: int = 12) -> NDArray[np.float64]:
    return np.random.default_rng(seed).normal(size=(count, 3))


@given(similarities(), similarities(), st.integers(0, 99))
def test_after_is_doing_one_and_then_the_other(a: Similarity, b: Similarity, seed: int) -> None:
    points = cloud(seed)
    assert np.allclose(b.after(a).apply(points), b.apply(a.apply(points)), atol=1e-8)


@given(similarities(), st.integers(0, 99))
def test_inverse_undoes(a: Similarity, seed: int) -> None:
    points = cloud(seed)
    assert np.allclose(a.inverse().apply(a.apply(points)), points, atol=1e-8)


@given(similarities(), similarities(), similarities(), st.integers(0, 99))
def test_the_order_of_brackets_does_not_matter(
    a: Similarity, b: Similarity, c: Similarity, seed: int
) -> None:
    points = cloud(seed)
    one, other = c.after(b).after(a), c.after(b.after(a))
    assert np.allclose(one.apply(points), other.apply(points), rtol=1e-9, atol=1e-6)


@given(similarities())
def test_a_mesh_keeps_its_faces_and_its_shape(a: Similarity) -> None:
    mesh = Mesh(cloud(3), np.arange(12, dtype=np.int32).reshape(-1, 3))
    moved = a.mesh(mesh)
    np.testing.assert_array_equal(moved.faces, mesh.faces)
    assert np.allclose(moved.areas, a.scale**2 * mesh.areas)
    assert np.allclose(moved.normals, mesh.normals @ a.rotation.T)


@given(similarities(), st.integers(0, 99))
def test_fit_recovers_any_similarity(a: Similarity, seed: int) -> None:
    points = cloud(seed)
    found = fit_similarity(points, a.apply(points))
    assert found.scale == pytest.approx(a.scale, rel=1e-9)
    assert np.allclose(found.rotation, a.rotation, atol=1e-9)
    assert np.allclose(found.translation, a.translation, atol=1e-7)


@given(similarities(), st.integers(0, 99))
def test_fit_of_flat_points_never_mirrors(a: Similarity, seed: int) -> None:
    points = cloud(seed)
    points[:, 2] = 0
    assert np.linalg.det(fit_similarity(points, a.apply(points)).rotation) == pytest.approx(1)


def test_robust_fit_ignores_outliers() -> None:
    points = cloud(1, 40)
    truth = Similarity(2.0, Rotation.from_rotvec([0.2, -1.0, 0.4]).as_matrix(), np.ones(3))
    target = truth.apply(points)
    target[:15] += 1 + np.abs(cloud(2, 15))
    found, inliers = fit_similarity_robust(points, target, tolerance=0.01)
    assert found.scale == pytest.approx(2.0)
    assert not inliers[:15].any()
    assert inliers[15:].all()


@pytest.mark.parametrize(
    "points",
    [np.zeros((2, 3)), np.zeros((4, 3)), np.outer(np.arange(4.0), [1, 2, 3])],
    ids=["two", "one spot", "one line"],
)
def test_fit_refuses_what_tells_no_rotation(points: NDArray[np.float64]) -> None:
    with pytest.raises(InputError, match="similarity"):
        fit_similarity(points, points)


def test_mean_rotation_of_a_symmetric_bunch_is_its_middle() -> None:
    middle = Rotation.from_rotvec([0.5, 0.2, -1.1])
    bunch = [
        (Rotation.from_rotvec(d * axis) * middle).as_matrix()
        for axis in np.eye(3)
        for d in (-0.3, 0.3)
    ]
    assert np.allclose(mean_rotation(bunch), middle.as_matrix(), atol=1e-9)


def test_plane_is_total_not_vertical_least_squares() -> None:
    rng = np.random.default_rng(0)
    normal = np.array([0.95, 0.05, 0.3]) / np.linalg.norm([0.95, 0.05, 0.3])
    frame = rotation_with_z(normal, np.array([0.0, 0.0, 1.0]))
    local = np.column_stack([rng.uniform(-1, 1, (200, 2)), rng.normal(0, 1e-3, 200)])
    found, offset = fit_plane(local @ frame + 0.7 * normal)
    found, offset = (found, offset) if found @ normal > 0 else (-found, -offset)
    assert np.degrees(np.arccos(min(1, found @ normal))) < 0.05
    assert offset == pytest.approx(0.7, abs=1e-3)
