"""Edges, neighbours, face_components, fans and holes: against plain loops on triangle soups."""

from __future__ import annotations

from collections import defaultdict

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.geometry.graphs import components, duplicate_faces, renumber
from walltopo.geometry.mesh_check import check_mesh
from walltopo.geometry.topology import (
    boundary_loops,
    bounds_by_group,
    close_loops,
    compact_vertices,
    edges_of,
    face_components,
    face_neighbours,
    glued_fans,
    opposite_half_edges,
    patches,
    split_fans,
    vertex_components,
)

Faces = NDArray[np.int32]


@st.composite
def soups(draw: st.DrawFn) -> Faces:
    """Triangles of three different vertices among few, so that they often meet."""
    count = draw(st.integers(3, 8))
    rows = draw(st.lists(st.permutations(range(count)), min_size=1, max_size=14))
    return np.array([row[:3] for row in rows], dtype=np.int32)


def sides(face: NDArray[np.int32]) -> list[tuple[int, int]]:
    a, b, c = face.tolist()
    return [(a, b), (b, c), (c, a)]


@given(soups())
def test_edges_know_their_faces(faces: Faces) -> None:
    edges = edges_of(faces)
    for f, face in enumerate(faces):
        for k, side in enumerate(sides(face)):
            assert sorted(side) == edges.pairs[edges.of_face[f, k]].tolist()
    np.testing.assert_array_equal(edges.count, np.bincount(edges.of_face.ravel()))


@settings(deadline=None)
@given(soups())
def test_neighbours_share_the_edge(faces: Faces) -> None:
    at = defaultdict(list)
    for f, face in enumerate(faces):
        for side in sides(face):
            at[frozenset(side)].append(f)
    for f, face in enumerate(faces):
        for k, side in enumerate(sides(face)):
            others = [other for other in at[frozenset(side)] if other != f]
            assert face_neighbours(faces)[f, k] == (others[0] if others else -1)


@settings(deadline=None)
@given(soups(), st.data())
def test_patches_are_regions_of_one_label(faces: Faces, data: st.DataObject) -> None:
    label = np.array(
        data.draw(st.lists(st.integers(-1, 1), min_size=len(faces), max_size=len(faces))),
        dtype=np.int32,
    )
    neighbours = face_neighbours(faces)
    face, corner = np.nonzero(neighbours >= 0)
    other = neighbours[face, corner]
    same = label[face] == label[other]
    patch, first = patches(neighbours, label)
    np.testing.assert_array_equal(patch, components(len(faces), face[same], other[same]))
    np.testing.assert_array_equal(first, np.unique(patch, return_index=True)[1])


@settings(deadline=None)
@given(soups())
def test_parts_share_edges_or_vertices(faces: Faces) -> None:
    part = face_components(faces)
    edge, order = edges_of(faces).of_face.ravel(), np.arange(3 * len(faces)) // 3
    link = components(len(faces) + int(edge.max()) + 1, order, edge + len(faces))
    np.testing.assert_array_equal(part, link[: len(faces)])
    of_vertex = vertex_components(faces, int(faces.max()) + 1)
    assert (of_vertex[faces] == of_vertex[faces[:, :1]]).all()
    # Faces that share an edge share vertices: face_components by edges are at least as many.
    assert len(np.unique(of_vertex[faces])) <= part.max() + 1


@given(soups())
def test_doubled_faces_are_those_that_came_before(faces: Faces) -> None:
    seen: set[frozenset[int]] = set()
    for face, again in zip(faces.tolist(), duplicate_faces(faces).tolist(), strict=True):
        assert again == (frozenset(face) in seen)
        seen.add(frozenset(face))


@given(soups())
def test_fans_split_a_mesh_and_move_nothing(faces: Faces) -> None:
    vertices = np.random.default_rng(0).normal(size=(int(faces.max()) + 1, 3))
    mesh = Mesh(vertices, faces)
    split = split_fans(mesh)
    np.testing.assert_array_equal(split.vertices[split.faces], vertices[faces])
    again = split_fans(split)
    np.testing.assert_array_equal(again.faces, renumber(split.faces.ravel()).reshape(-1, 3))
    oriented = split_fans(mesh, glued_fans(faces, *opposite_half_edges(faces)))
    np.testing.assert_array_equal(oriented.vertices[oriented.faces], vertices[faces])


@given(soups())
def test_opposed_half_edges_run_against_each_other_and_pair_once(faces: Faces) -> None:
    first, second = opposite_half_edges(faces)
    start, stop = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    np.testing.assert_array_equal(start[first], stop[second])
    np.testing.assert_array_equal(stop[first], start[second])
    both = np.concatenate([first, second])
    assert len(np.unique(both)) == len(both)


def sheet(side: int = 8) -> Faces:
    corner = (np.arange(side)[:, None] * (side + 1) + np.arange(side)).ravel()
    a, b, c, d = corner, corner + 1, corner + side + 1, corner + side + 2
    return np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, c], 1)]).astype(np.int32)


@settings(deadline=None)
@given(st.sets(st.integers(0, 127), max_size=30))
def test_closed_loops_leave_a_manifold_without_a_border(gone: set[int]) -> None:
    whole = sheet()
    faces = np.delete(whole, sorted(gone), axis=0)
    vertices = np.random.default_rng(0).normal(size=(81, 3))
    torn = split_fans(Mesh(*compact_vertices(vertices, faces)))
    loops = boundary_loops(torn.faces)
    edges = edges_of(torn.faces)
    assert sum(map(len, loops)) == int((edges.count == 1).sum())
    points, closed = close_loops(torn.vertices, torn.faces, loops)
    np.testing.assert_array_equal(points[: len(torn.vertices)], torn.vertices)
    np.testing.assert_array_equal(closed[: len(torn.faces)], torn.faces)
    # Two loops of the same three vertices (one face alone) close to a face that comes twice.
    assume(not duplicate_faces(closed).any())
    report = check_mesh(Mesh(points, closed))
    assert report.border_edges == report.flipped_edges == report.edges_of_many_faces == 0


def test_a_triangular_hole_is_closed_by_one_face() -> None:
    tetrahedron = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], dtype=np.int32)
    vertices = np.vstack([np.zeros(3), np.eye(3)])
    points, closed = close_loops(vertices, tetrahedron[:3], boundary_loops(tetrahedron[:3]))
    assert len(points) == 4
    assert sorted(closed[3].tolist()) == [0, 2, 3]
    assert check_mesh(Mesh(points, closed)).flipped_edges == 0


@pytest.mark.parametrize("count", [0, 1])
def test_hardly_any_faces(count: int) -> None:
    faces = sheet()[:count]
    assert face_components(faces).tolist() == [0] * count
    assert face_neighbours(faces).tolist() == [[-1] * 3] * count
    assert len(boundary_loops(faces)) == count


@given(st.integers(0, 40), st.integers(0, 2**32 - 1))
def test_bounds_of_groups_are_those_of_each_groups_points(count: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    group = rng.integers(0, 6, count)
    points = rng.normal(size=(count, 3, 2)).astype(np.float32)
    low, high = bounds_by_group(group, points.swapaxes(0, 1), 7)
    for k in range(7):
        mine = points[group == k].reshape(-1, 2)
        assert low[k].tolist() == mine.min(axis=0, initial=np.inf).tolist()
        assert high[k].tolist() == mine.max(axis=0, initial=-np.inf).tolist()
