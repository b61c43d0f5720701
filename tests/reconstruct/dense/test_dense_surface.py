"""Marching cubes, cleaning and checking: the surface is manifold whatever the distances are."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from walltopo.core import Mesh, View
from walltopo.core.view import Camera
from walltopo.geometry.mesh_check import check_mesh
from walltopo.geometry.topology import boundary_loops, edges_of, split_fans
from walltopo.reconstruct.dense.marching_cubes import cube_table, extract
from walltopo.reconstruct.dense.remesh import (
    collapse_short_edges,
    drop_fragments,
    fill_holes,
    make_manifold,
    smooth,
)
from walltopo.reconstruct.dense.tsdf import BLOCK, Volume

Floats = NDArray[np.float64]


def volume_of(distance: Callable[[Floats], Floats], blocks_per_side: int = 3) -> Volume:
    """A volume over [-1, 1]^3 that holds a distance function."""
    n = blocks_per_side
    voxel = 2.0 / (n * BLOCK - 1)
    blocks = np.argwhere(np.ones((n, n, n))).astype(np.int32)
    grid = np.arange(n**3, dtype=np.int32).reshape(n, n, n)
    corner = np.indices((BLOCK,) * 3).reshape(3, -1).T
    points: Floats = ((blocks[:, None] * BLOCK + corner[None]) * voxel - 1.0).astype(np.float64)
    values = np.clip(distance(points), -1, 1).reshape(-1, BLOCK, BLOCK, BLOCK).astype(np.float32)
    own = len(blocks)
    return Volume(np.full(3, -1.0), voxel, 1.0, blocks, own, grid, values, np.ones_like(values))


def ball(radius: float = 0.7) -> Mesh:
    return extract([volume_of(lambda p: np.linalg.norm(p, axis=-1) - radius)], 0.5)


def enclosed(mesh: Mesh) -> float:
    """Volume inside a closed mesh, negative if its normals point inwards."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return float((a * np.cross(b, c)).sum() / 6.0)


def test_the_table_covers_every_configuration() -> None:
    table = cube_table()
    counts = (table >= 0).sum(axis=1)
    assert table.shape == (256, 15)
    assert counts[0] == counts[255] == 0
    assert (counts[1:255] >= 3).all()
    assert (counts % 3 == 0).all()


def test_a_ball_is_closed_and_turned_outwards() -> None:
    mesh = ball()
    report = check_mesh(mesh)
    assert report.defects == []
    assert report.border_edges == 0
    assert enclosed(mesh) == pytest.approx(4 / 3 * np.pi * 0.7**3, rel=0.02)


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 10**6), holes=st.booleans())
def test_noise_gives_a_manifold(seed: int, holes: bool) -> None:
    rng = np.random.default_rng(seed)
    volume = volume_of(lambda p: rng.normal(size=p.shape[:-1]), 2)
    if holes:
        volume.weight[rng.random(volume.weight.shape) < 0.1] = 0.0
    report = check_mesh(split_fans(extract([volume], 0.5)))
    assert report.edges_of_many_faces == 0
    assert report.vertices_of_many_fans == 0
    assert report.flipped_edges == 0


def test_collapsing_short_edges_keeps_the_surface() -> None:
    mesh = ball()
    before = check_mesh(mesh)
    shortest = before.edge_length_median * 0.7
    after = collapse_short_edges(mesh, shortest)
    report = check_mesh(after)
    assert report.defects == []
    assert report.border_edges == 0
    assert report.edge_length_p05 > 2 * before.edge_length_p05
    assert np.linalg.norm(after.vertices, axis=1) == pytest.approx(0.7, abs=0.02)


def test_collapsing_leaves_the_rim_of_a_sheet() -> None:
    mesh = ball()
    sheet = Mesh(mesh.vertices, mesh.faces[mesh.centroids[:, 2] > 0.1])
    after = collapse_short_edges(split_fans(sheet), 0.06)
    assert check_mesh(after).defects == []
    assert len(boundary_loops(after.faces)) == 1


def test_small_holes_are_closed_and_large_ones_stay() -> None:
    mesh = ball()
    near = np.linalg.norm(mesh.centroids - [0.7, 0, 0], axis=1) < 0.12
    far = np.linalg.norm(mesh.centroids - [-0.7, 0, 0], axis=1) < 0.5
    torn = split_fans(Mesh(mesh.vertices, mesh.faces[~near & ~far]))
    whole = fill_holes(torn, 0.5)
    assert len(boundary_loops(torn.faces)) == 2
    assert len(boundary_loops(whole.faces)) == 1
    assert check_mesh(whole).flipped_edges == 0


def test_crumbs_go_and_doubled_faces_go() -> None:
    mesh = ball()
    crumb = Mesh(mesh.vertices * 0.01 + 2.0, mesh.faces)
    count = len(mesh.vertices)
    both = Mesh(
        np.concatenate([mesh.vertices, crumb.vertices]),
        np.concatenate([mesh.faces, crumb.faces + count, mesh.faces[:5], [[1, 1, 2]]]),
    )
    clean = drop_fragments(make_manifold(both), 0.1)
    assert len(clean.faces) == len(mesh.faces)
    assert check_mesh(clean).defects == []


def test_three_faces_at_an_edge_become_two() -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 0.1]], dtype=float)
    fin = Mesh(vertices, np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]], dtype=np.int32))
    assert check_mesh(fin).edges_of_many_faces == 1
    clean = make_manifold(fin)
    assert len(clean.faces) == 2
    assert edges_of(clean.faces).count.max() == 2


def test_smoothing_flattens_noise_without_shrinking() -> None:
    mesh = ball()
    rng = np.random.default_rng(1)
    rough = Mesh(mesh.vertices + rng.normal(scale=0.01, size=mesh.vertices.shape), mesh.faces)
    radii = np.linalg.norm(smooth(rough, 5).vertices, axis=1)
    assert radii.std() < 0.7 * np.linalg.norm(rough.vertices, axis=1).std()
    assert radii.mean() == pytest.approx(0.7, abs=0.01)


def test_the_check_sees_each_fault() -> None:
    mesh = ball()
    flipped = mesh.faces.copy()
    flipped[0] = flipped[0, ::-1]
    assert check_mesh(Mesh(mesh.vertices, flipped)).flipped_edges == 3
    doubled = np.concatenate([mesh.faces, mesh.faces[:2]])
    assert check_mesh(Mesh(mesh.vertices, doubled)).doubled_faces == 2
    flat = np.concatenate([mesh.faces, [[0, 0, 1]]]).astype(np.int32)
    assert check_mesh(Mesh(mesh.vertices, flat)).degenerate_faces == 1


def test_the_check_tells_which_side_the_cameras_were() -> None:
    mesh = ball()
    camera = Camera("PINHOLE", 100, 100, (100.0, 100.0, 50.0, 50.0))
    pose = np.column_stack([np.eye(3), [0, 0, 3.0]])
    front = Mesh(mesh.vertices, mesh.faces[mesh.centroids[:, 2] < -0.2])
    inside_out = Mesh(front.vertices, front.faces[:, ::-1])
    view = View("a.jpg", camera, pose)
    assert check_mesh(front, [view]).inward_share == pytest.approx(0.0, abs=0.1)
    assert "normals point away" in check_mesh(inside_out, [view]).defects[-1]
