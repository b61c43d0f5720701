"""Holds are closed bodies of a hold's size, whatever the seed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from walltopo.core import InputError, Mesh
from walltopo.geometry.mesh_files import write_ply
from walltopo_lab.synth.holds import HOLD_KINDS, SIZES, STYLES, make_hold, vertex_normals
from walltopo_lab.synth.scanned import read_hold, scanned_holds


def _is_closed(faces: np.ndarray) -> bool:
    """Every directed edge occurs once, and its reverse once."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64)
    forward = edges[:, 0] * (faces.max() + 1) + edges[:, 1]
    backward = edges[:, 1] * (faces.max() + 1) + edges[:, 0]
    return len(np.unique(forward)) == len(forward) and set(forward) == set(backward)


@pytest.mark.parametrize("kind", HOLD_KINDS)
@given(seed=st.integers(0, 10_000), style=st.sampled_from(STYLES))
@settings(max_examples=12, deadline=None)
def test_hold_is_one_closed_body_of_its_size(kind: str, style: str, seed: int) -> None:
    body = make_hold(kind, style, np.random.default_rng(seed), detail=0.5)
    assert _is_closed(body.faces)
    mesh = Mesh(body.vertices, body.faces)
    a, b, c = (body.vertices[body.faces[:, k]] for k in range(3))
    assert np.einsum("ij,ij->", a, np.cross(b, c)) > 0, "triangles must face outward"
    nominal = np.array(SIZES[kind][:3])
    extent = np.ptp(body.vertices, axis=0)
    assert (extent < 4.0 * nominal + 0.02).all()
    assert (extent > 0.2 * nominal).all()
    assert body.vertices[:, 2].min() < 0 < body.vertices[:, 2].max()
    assert np.allclose(np.linalg.norm(body.normals, axis=1), 1, atol=1e-6)
    assert mesh.areas.sum() > 0


def test_same_seed_same_hold() -> None:
    one = make_hold("jug", "stone", np.random.default_rng(3))
    two = make_hold("jug", "stone", np.random.default_rng(3))
    np.testing.assert_array_equal(one.vertices, two.vertices)


def test_a_jug_has_an_incut() -> None:
    """Some of its surface behind the lip faces the wall: a hand finds a back to hold."""
    body = make_hold("jug", "smooth", np.random.default_rng(0))
    free = body.vertices[:, 2] > 0.2 * body.vertices[:, 2].max()
    above = body.vertices[:, 1] > 0
    assert (body.normals[free & above][:, 2] < -0.3).sum() > 20


def test_scanned_holds_take_name_and_millimetres(tmp_path: Path) -> None:
    body = make_hold("pinch", "smooth", np.random.default_rng(1), detail=0.5)
    write_ply(tmp_path / "pinch_01.ply", Mesh(body.vertices * 1000 + 55, body.faces))
    kind, scanned = read_hold(tmp_path / "pinch_01.ply")
    assert kind == "pinch"
    assert np.ptp(scanned.vertices, axis=0) == pytest.approx(
        np.ptp(body.vertices, axis=0), rel=1e-4
    )
    assert scanned.vertices[:, 2].min() == pytest.approx(-0.002, abs=1e-6)
    make = scanned_holds(tmp_path)
    other = make("jug", "smooth", np.random.default_rng(0), 1.0)
    assert other.faces.shape == body.faces.shape


def test_scanned_holds_refuse_a_house(tmp_path: Path) -> None:
    body = make_hold("jug", "smooth", np.random.default_rng(1), detail=0.5)
    write_ply(tmp_path / "house.ply", Mesh(body.vertices * 5e5, body.faces))
    with pytest.raises(InputError, match="size"):
        scanned_holds(tmp_path)
    with pytest.raises(InputError, match="scanned"):
        scanned_holds(tmp_path / "nothing")


def test_normals_are_unit_also_where_triangles_have_no_area() -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 2, 0], [2, 2, 0], [2, 2, 0]], float)
    normals = vertex_normals(points, np.array([[0, 1, 2], [3, 4, 5]], np.int32))
    np.testing.assert_allclose(normals, np.tile([0, 0, 1], (6, 1)))
