"""Thin gaps in a mesh are sewn up; wider ones and the rim stay, and the mesh stays manifold."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.geometry.graphs import duplicate_faces
from walltopo.geometry.mesh_check import check_mesh
from walltopo.geometry.topology import boundary_loops, compact_vertices, split_fans
from walltopo.reconstruct.dense.gaps import sew_gaps

Floats = NDArray[np.float64]

EDGE = 0.01
WIDEST = 0.025


def sheet(columns: int = 60, rows: int = 40) -> Mesh:
    """A flat grid in x and y, each square cut into two faces that look along z."""
    x, y = np.meshgrid(np.arange(columns + 1) * EDGE, np.arange(rows + 1) * EDGE)
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    a = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    over = a + columns + 1
    faces = np.vstack([np.column_stack([a, a + 1, over + 1]), np.column_stack([a, over + 1, over])])
    return Mesh(points, faces.astype(np.int32))


def torn(mesh: Mesh, gone: NDArray[np.bool_]) -> Mesh:
    return split_fans(Mesh(*compact_vertices(mesh.vertices, mesh.faces[~gone])))


def slot(mesh: Mesh, low: tuple[float, float], high: tuple[float, float]) -> NDArray[np.bool_]:
    """Faces whose centroid lies in a box of x and y."""
    middle = mesh.centroids[:, :2]
    return np.asarray(((middle > low) & (middle < high)).all(axis=1))


def test_a_long_thin_gap_is_closed_and_a_wide_one_and_the_rim_are_not() -> None:
    whole = sheet()
    thin, wide = slot(whole, (0.05, 0.05), (0.55, 0.07)), slot(whole, (0.1, 0.2), (0.5, 0.25))
    sewn = sew_gaps(torn(whole, thin | wide), WIDEST)
    assert check_mesh(sewn).defects == []
    # The ball does not reach into the corners of the wide one: a triangle each.
    left = 0.4 * 0.05 - 4 * EDGE**2 / 2
    assert sewn.areas.sum() == pytest.approx(whole.areas.sum() - left, rel=1e-6)
    assert sorted(len(loop) for loop in boundary_loops(sewn.faces)) == [86, 200]


def test_a_gap_that_leads_out_over_the_rim_is_closed() -> None:
    whole = sheet()
    sewn = sew_gaps(torn(whole, slot(whole, (-1, 0.2), (2, 0.22))), WIDEST)
    assert len(boundary_loops(sewn.faces)) == 1
    assert sewn.areas.sum() == pytest.approx(whole.areas.sum(), rel=1e-6)


def test_two_walls_that_pass_each_other_are_not_joined() -> None:
    front = sheet(20, 20)
    behind = Mesh(front.vertices + [0.0, 0.15, -0.02], front.faces)
    both = Mesh(
        np.concatenate([front.vertices, behind.vertices]),
        np.concatenate([front.faces, behind.faces + len(front.vertices)]).astype(np.int32),
    )
    assert len(sew_gaps(both, WIDEST).faces) == len(both.faces)


def test_a_width_of_zero_closes_nothing() -> None:
    whole = sheet(20, 20)
    open_ = torn(whole, slot(whole, (0.05, 0.05), (0.15, 0.06)))
    assert np.array_equal(sew_gaps(open_, 0.0).faces, open_.faces)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10**6), share=st.floats(0.01, 0.6), rough=st.floats(0, 0.5))
def test_however_a_sheet_is_torn_it_stays_manifold_and_never_overlaps(
    seed: int, share: float, rough: float
) -> None:
    rng = np.random.default_rng(seed)
    whole = sheet(24, 24)
    moved = whole.vertices + rough * EDGE * rng.uniform(-0.5, 0.5, whole.vertices.shape) * [1, 1, 0]
    open_ = torn(Mesh(moved, whole.faces), rng.random(len(whole.faces)) < share)
    sewn = sew_gaps(open_, WIDEST)
    report = check_mesh(sewn)
    assert report.flipped_edges == report.edges_of_many_faces == report.vertices_of_many_fans == 0
    assert not duplicate_faces(sewn.faces).any()
    assert open_.areas.sum() <= sewn.areas.sum()
    assert np.array_equal(sewn.faces, sew_gaps(open_, WIDEST).faces)
    # Flat as it is, no spot may be covered twice: new faces lie in the gaps only.
    corners = sewn.vertices[sewn.faces]
    turned = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2]
    assert (turned > 0).all()
    assert sewn.areas.sum() <= Mesh(moved, whole.faces).areas.sum() * (1 + 1e-9)
