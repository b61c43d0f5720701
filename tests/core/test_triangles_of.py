"""The triangles of each instance are those that carry its id."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from walltopo.core.instances import triangles_of


@given(
    labels=st.lists(st.integers(0, 9), max_size=60),
    ids=st.lists(st.integers(0, 12), max_size=12, unique=True),
)
def test_each_instance_gets_its_triangles_in_order(labels: list[int], ids: list[int]) -> None:
    face_instance = np.array(labels, dtype=np.int32)
    found = {number: rows.tolist() for number, rows in triangles_of(face_instance, ids)}
    rows_of = {number: np.flatnonzero(face_instance == number).tolist() for number in ids}
    assert found == {number: rows for number, rows in rows_of.items() if rows}
    assert list(found) == [number for number in ids if number in found]
