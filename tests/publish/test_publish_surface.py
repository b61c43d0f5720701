"""Splitting at hold borders and simplification that never mixes two holds."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from walltopo.core import Mesh
from walltopo.publish.surface import mixed_triangles, simplify, split_at_borders


def grid(cells: int, seed: int, labels: int) -> tuple[Mesh, Any, Any]:
    """A rough sheet with blobs of labels and a texture with one seam down the middle."""
    rng = np.random.default_rng(seed)
    axis = np.linspace(0, 1, cells + 1)
    gx, gy = np.meshgrid(axis, axis)
    vertices = np.stack([gx, gy, 0.02 * rng.random(gx.shape)], -1).reshape(-1, 3)
    a = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    faces = np.vstack(
        [np.stack([a, a + 1, a + cells + 2], 1), np.stack([a, a + cells + 2, a + cells + 1], 1)]
    ).astype(np.int32)
    middle = vertices[faces].mean(axis=1)[:, :2]
    seeds = rng.random((labels + 1, 2))
    nearest = ((middle[:, None] - seeds[None]) ** 2).sum(-1).argmin(1).astype(np.int32)
    uv = vertices[faces][..., :2].astype(np.float32) / 2
    uv[middle[:, 0] > 0.5] += 0.5
    return Mesh(vertices, faces), nearest, uv


@settings(max_examples=15, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    cells=st.integers(4, 24),
    labels=st.integers(0, 9),
    share=st.floats(0.02, 0.9),
    textured=st.booleans(),
)
def test_no_triangle_mixes_ids_at_any_level(
    seed: int, cells: int, labels: int, share: float, textured: bool
) -> None:
    mesh, ids, uv = grid(cells, seed, labels)
    surface = split_at_borders(mesh, ids, uv if textured else None)
    assert mixed_triangles(surface) == 0
    coarse = simplify(surface, max(1, int(share * len(mesh.faces))))
    assert mixed_triangles(coarse) == 0
    assert len(coarse.triangles) <= len(mesh.faces)
    assert coarse.triangles.max() < len(coarse.positions)


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10**6), cells=st.integers(2, 12), labels=st.integers(0, 6))
def test_split_keeps_every_corner(seed: int, cells: int, labels: int) -> None:
    mesh, ids, uv = grid(cells, seed, labels)
    surface = split_at_borders(mesh, ids, uv)
    corner = surface.triangles
    np.testing.assert_allclose(surface.positions[corner], mesh.vertices[mesh.faces], atol=1e-6)
    np.testing.assert_array_equal(surface.feature[corner], np.repeat(ids[:, None], 3, axis=1))
    assert surface.uv is not None
    np.testing.assert_allclose(surface.uv[corner], uv, atol=1 / 65535)


def test_simplified_borders_stay_closed() -> None:
    """Both sides of a split border end up at the same places: no cracks."""
    mesh, ids, _ = grid(40, 3, 6)
    coarse = simplify(split_at_borders(mesh, ids), 600)
    places, merged = np.unique(coarse.positions, axis=0, return_inverse=True)
    edges = np.sort(merged[coarse.triangles][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    kinds, counts = np.unique(edges, axis=0, return_counts=True)
    single = places[kinds[counts == 1]]  # edges with one triangle: only on the sheet's rim
    rim = (np.isclose(single[..., :2], 0) | np.isclose(single[..., :2], 1)).any(axis=(1, 2))
    assert rim.all()
    (ax, ay), (bx, by) = np.diff(coarse.positions[coarse.triangles][..., :2], axis=1).transpose(
        1, 2, 0
    )
    assert (ax * by - ay * bx).sum() / 2 == pytest.approx(1.0, rel=0.01)


def test_vertex_colours_survive() -> None:
    mesh, ids, _ = grid(6, 1, 2)
    painted = Mesh(mesh.vertices, mesh.faces, (mesh.vertices * 200).astype(np.uint8))
    surface = split_at_borders(painted, ids)
    assert surface.colours is not None
    assert painted.vertex_colours is not None
    np.testing.assert_array_equal(
        surface.colours[surface.triangles], painted.vertex_colours[mesh.faces]
    )


def test_normals_are_means_by_area_and_point_up_without_any() -> None:
    mesh, ids, _ = grid(6, 3, 0)
    mesh = Mesh(np.vstack([mesh.vertices, [[9.0, 9.0, 9.0]]]), mesh.faces)
    total = np.zeros_like(mesh.vertices)
    for corner in mesh.faces.T:
        np.add.at(total, corner, mesh.normals * mesh.areas[:, None])
    expected = total[:-1] / np.linalg.norm(total[:-1], axis=1, keepdims=True)
    flat = Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]], dtype=np.int32))
    np.testing.assert_allclose(split_at_borders(mesh, ids).normals, expected, atol=1e-6)
    alone = split_at_borders(flat, np.zeros(1, np.int32)).normals
    np.testing.assert_array_equal(alone, [[0.0, 0.0, 1.0]] * 3)
