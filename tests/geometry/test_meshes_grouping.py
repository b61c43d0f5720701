"""Edges, duplicate_faces faces and parts by counting are those that sorting gives."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from walltopo.geometry.graphs import components, duplicate_faces, grouped_edges, linked_components

few_faces = st.integers(0, 30).flatmap(
    lambda n: arrays(np.int32, (n, 3), elements=st.integers(0, 9))
)


@settings(deadline=None, max_examples=60)
@given(few_faces)
def test_edges_are_those_of_a_sort(faces: np.ndarray) -> None:
    pairs, count, of_face = grouped_edges(faces)
    directed = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)
    expected, inverse, many = np.unique(
        np.sort(directed, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    assert pairs.tolist() == expected.tolist()
    assert count.tolist() == many.tolist()
    assert of_face.ravel().tolist() == inverse.ravel().tolist()


@settings(deadline=None, max_examples=60)
@given(few_faces)
def test_a_face_is_repeated_where_an_earlier_one_has_its_vertices(faces: np.ndarray) -> None:
    met: set[tuple[int, ...]] = set()
    expected = []
    for face in faces.tolist():
        expected.append(tuple(sorted(face)) in met)
        met.add(tuple(sorted(face)))
    assert duplicate_faces(faces).tolist() == expected


@settings(deadline=None, max_examples=60)
@given(arrays(np.int64, st.tuples(st.just(2), st.integers(0, 20)), elements=st.integers(0, 14)))
def test_parts_are_numbered_by_their_first_vertex(edges: np.ndarray) -> None:
    assert linked_components(15, *edges).tolist() == components(15, *edges).tolist()
