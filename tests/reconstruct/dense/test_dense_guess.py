"""Holes are spanned by guesses: what was measured stays, and no opening is closed."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from walltopo.core import Camera, Mesh, Silent, View
from walltopo.geometry.mesh_check import check_mesh
from walltopo.geometry.topology import boundary_loops, compact_vertices, split_fans
from walltopo.reconstruct.dense.guess import Guesses, guess_holes
from walltopo.reconstruct.dense.scene import Scene

Floats = NDArray[np.float64]

EDGE = 0.05
BLIND = Scene((), np.zeros((0, 3)), ())


def grid(columns: int, rows: int, place: Floats) -> Mesh:
    """A grid of squares cut in two; its vertex in column i, row j is at `place[j, i]`."""
    a = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    over = a + columns + 1
    faces = np.vstack([np.column_stack([a, a + 1, over + 1]), np.column_stack([a, over + 1, over])])
    return Mesh(place.reshape(-1, 3), faces.astype(np.int32))


def sheet(size: int = 24, depth: float = 0.0) -> Mesh:
    """A square sheet in x and y that looks along z, at z = `depth`, around the origin."""
    axis = (np.arange(size + 1) - size / 2) * EDGE
    x, y = np.meshgrid(axis, axis)
    return grid(size, size, np.stack([x, y, np.full_like(x, depth)], axis=-1))


def without(mesh: Mesh, gone: NDArray[np.bool_]) -> Mesh:
    return split_fans(Mesh(*compact_vertices(mesh.vertices, mesh.faces[~gone])))


def within(mesh: Mesh, radius: float, centre: tuple[float, float, float]) -> NDArray[np.bool_]:
    return np.asarray(np.linalg.norm(mesh.centroids - centre, axis=1) < radius)


def both(one: Mesh, other: Mesh) -> Mesh:
    faces = np.concatenate([one.faces, other.faces + len(one.vertices)]).astype(np.int32)
    return Mesh(np.concatenate([one.vertices, other.vertices]), faces)


def guessed(mesh: Mesh, scene: Scene = BLIND, largest: float = 1.0) -> Guesses:
    """The mesh with its holes spanned, after a look at what must hold of any."""
    found = guess_holes(mesh, scene, largest, EDGE, Silent())
    whole = found.mesh
    assert np.array_equal(whole.vertices[: len(mesh.vertices)], mesh.vertices)
    assert np.array_equal(whole.faces[: len(mesh.faces)], mesh.faces)
    assert whole.measured.nonzero()[0].tolist() == list(range(len(mesh.faces)))
    back = whole.without_guesses()
    assert np.array_equal(back.vertices, mesh.vertices)
    assert np.array_equal(back.faces, mesh.faces)
    assert check_mesh(whole).defects == check_mesh(mesh).defects == []
    return found


def from_above(points: Floats, depth: float = 2.0) -> Scene:
    """A photo that looks straight down on the sheet and sees sparse points."""
    pose = np.array([[1.0, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, depth]])
    view = View("a.jpg", Camera("PINHOLE", 400, 400, (300.0, 300.0, 200.0, 200.0)), pose)
    return Scene((view,), points, (np.arange(len(points)),))


def test_a_hole_in_a_sheet_is_spanned_flat_and_its_rim_stays_open() -> None:
    whole = sheet()
    found = guessed(without(whole, within(whole, 0.3, (0, 0, 0))))
    spans = found.mesh.areas[~found.mesh.measured]
    assert found.spanned == 1
    assert found.mesh.areas.sum() == pytest.approx(whole.areas.sum(), rel=1e-9)
    assert np.abs(found.mesh.vertices[:, 2]).max() < 1e-12
    assert (found.mesh.normals[:, 2] > 0.999).all()
    # Even triangles, about as large as those around.
    assert np.median(spans) == pytest.approx(np.median(whole.areas), rel=0.5)
    assert len(boundary_loops(found.mesh.faces)) == 1


def test_larger_holes_and_a_largest_of_none_are_left() -> None:
    whole = sheet()
    torn = without(whole, within(whole, 0.3, (0, 0, 0)))
    for largest in (0.5, 0.0):
        found = guessed(torn, largest=largest)
        assert found.spanned == 0
        assert found.mesh.guessed is None


def ball(radius: float = 0.6, size: int = 14) -> Mesh:
    """A closed cube of grids, blown up to a ball."""
    sides = []
    axis = np.linspace(-1, 1, size + 1)
    x, y = np.meshgrid(axis, axis)
    for k in range(3):
        for sign in (1.0, -1.0):
            corner = np.stack([sign * x, y, np.full_like(x, sign)], axis=-1)
            sides.append(grid(size, size, np.roll(corner, k, axis=-1)))
    points = np.concatenate([side.vertices for side in sides])
    faces = np.concatenate([s.faces + k * (size + 1) ** 2 for k, s in enumerate(sides)])
    points, index = np.unique(np.round(points, 9), axis=0, return_inverse=True)
    points *= radius / np.linalg.norm(points, axis=1, keepdims=True)
    return Mesh(points, index.ravel()[faces].astype(np.int32))


def test_a_hole_in_a_ball_is_spanned_although_it_is_the_only_rim() -> None:
    whole = ball()
    found = guessed(without(whole, within(whole, 0.25, (0, 0, 0.6))))
    assert found.spanned == 1
    assert boundary_loops(found.mesh.faces) == []
    spans = found.mesh.centroids[~found.mesh.measured]
    cap = 0.6 - np.sqrt(0.6**2 - 0.3**2)
    assert (np.linalg.norm(spans, axis=1) > 0.6 - cap - EDGE / 2).all()


def test_a_hole_around_the_corner_of_a_volume_is_spanned() -> None:
    # A ridge along x: both sides at 45 degrees.
    axis = (np.arange(25) - 12) * EDGE
    x, y = np.meshgrid(axis, axis)
    ridge = grid(24, 24, np.stack([x, y, -np.abs(y)], axis=-1))
    found = guessed(without(ridge, within(ridge, 0.2, (0, 0, 0))))
    assert found.spanned == 1
    spans = found.mesh.vertices[found.mesh.faces[~found.mesh.measured]].reshape(-1, 3)
    assert spans[:, 2].min() > -0.25
    assert spans[:, 2].max() <= 0.0


def test_the_outline_of_a_piece_that_hangs_free_is_no_hole() -> None:
    piece = sheet(8, depth=0.3)
    found = guessed(both(sheet(), piece))
    assert found.spanned == 0


def test_a_bay_of_the_border_is_spanned_and_the_outline_elsewhere_stays() -> None:
    whole = sheet()
    bay = (np.abs(whole.centroids[:, 0]) < 0.1) & (whole.centroids[:, 1] > -0.2)
    found = guessed(without(whole, bay))
    assert found.spanned == 1
    # Up to the straight way across its mouth.
    assert found.mesh.areas.sum() == pytest.approx(whole.areas.sum(), rel=0.01)
    assert (found.mesh.normals[:, 2] > 0.999).all()
    # A part that juts out is no bay, nor is a notch that is wider than deep.
    assert guessed(without(whole, ~bay & (whole.centroids[:, 1] > -0.2))).spanned == 0
    shallow = (np.abs(whole.centroids[:, 0]) < 0.3) & (whole.centroids[:, 1] > 0.4)
    assert guessed(without(whole, shallow)).spanned == 0


def test_no_opening_that_photos_look_through_is_closed() -> None:
    wall = without(sheet(), within(sheet(), 0.3, (0, 0, 0)))
    open_ = both(wall, sheet(40, depth=-1.0))
    scene = from_above(np.array([[0.5, 0.5, 0.0]]))
    assert guessed(open_, scene).seen_through == 1
    # Nothing behind that anything says: it may be a hole.
    assert guessed(wall, scene).spanned == 1
    # Sparse points behind, where no surface was measured.
    behind = np.column_stack(
        [np.random.default_rng(1).uniform(-0.1, 0.1, (80, 2)), np.full(80, -1)]
    )
    assert guessed(wall, from_above(behind)).seen_through == 1
    on_it = behind * [1, 1, 0]
    assert guessed(wall, from_above(on_it)).spanned == 1


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    holes=st.integers(0, 5),
    rough=st.floats(0, 0.4),
    relief=st.floats(0, 0.1),
)
def test_however_a_sheet_is_torn_it_stays_manifold_and_what_was_measured_stays(
    seed: int, holes: int, rough: float, relief: float
) -> None:
    rng = np.random.default_rng(seed)
    whole = sheet(20)
    moved = whole.vertices + rough * EDGE * rng.uniform(-1, 1, whole.vertices.shape)
    moved[:, 2] += relief * rng.random(len(moved))
    whole = Mesh(moved, whole.faces)
    gone = np.zeros(len(whole.faces), dtype=np.bool_)
    for centre in rng.uniform(-0.4, 0.4, (holes, 2)):
        gone |= within(whole, rng.uniform(0.05, 0.25), (*centre.tolist(), 0.0))
    torn = without(whole, gone)
    found = guessed(torn, largest=0.8)
    if holes == 0:
        assert found.mesh.areas[~found.mesh.measured].sum() == 0
    assert np.array_equal(found.mesh.faces, guessed(torn, largest=0.8).mesh.faces)
