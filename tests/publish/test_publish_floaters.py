"""Loose pieces of surface: in the archive, not on the page."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera, Mesh, View
from walltopo.geometry.topology import face_neighbours
from walltopo.publish.floaters import Floaters, outline_vertices
from walltopo.publish.settings import ExportSettings
from walltopo.publish.tiers import TierBuilder
from walltopo.publish.wall_data import WallModel, read_wall
from walltopo.scans.folder import ScanFolder

MakeScan = Callable[..., ScanFolder]


def floaters(wall: WallModel) -> Floaters:
    return Floaters(wall, TierBuilder(wall, ExportSettings()).coverage)


def loose_faces(wall: WallModel) -> NDArray[np.bool_]:
    return floaters(wall).of(wall.face_instance)


def without_loose(wall: WallModel) -> WallModel:
    return floaters(wall).without(wall)


def with_scrap(wall: WallModel, size: float, label: int) -> WallModel:
    """The wall and one triangle of `size` metres, 2 m before it, that belongs to hold `label`."""
    count = len(wall.mesh.vertices)
    scrap = np.array([[0, -2, 1], [size, -2, 1], [0, -2, 1 + size]], dtype=float)
    faces = np.vstack([wall.mesh.faces, [[count, count + 1, count + 2]]]).astype(np.int32)
    assert wall.uv is not None
    return replace(
        wall,
        mesh=Mesh(np.vstack([wall.mesh.vertices, scrap]), faces),
        face_instance=np.append(wall.face_instance, label).astype(np.int32),
        uv=np.concatenate([wall.uv, wall.uv[:1]]),
        patches=None,
    )


def test_small_piece_without_a_hold_is_loose(make_scan: MakeScan) -> None:
    wall = with_scrap(read_wall(make_scan()), 0.3, 0)
    loose = loose_faces(wall)
    assert loose.nonzero()[0].tolist() == [len(wall.mesh.faces) - 1]


def test_holds_and_large_pieces_stay(make_scan: MakeScan) -> None:
    plain = read_wall(make_scan())
    assert not loose_faces(plain).any()
    assert without_loose(plain) is plain
    assert not loose_faces(with_scrap(plain, 0.3, 3)).any()
    assert not loose_faces(with_scrap(plain, 1.5, 0)).any()


def test_page_leaves_out_what_the_archive_keeps(make_scan: MakeScan) -> None:
    plain = read_wall(make_scan())
    builder = TierBuilder(with_scrap(plain, 0.3, 0), ExportSettings())
    count = len(plain.mesh.faces)
    sizes = {
        name: len(builder.textured_surface(name).surface.triangles)
        for name in ("archive", "detail")
    }
    assert sizes == {"archive": count + 1, "detail": count}


def slab(hold: int = 0, lean: float = 1.5) -> WallModel:
    """A sheet of 4 by 2 m in squares of 10 cm with a hole in it; its right quarter is before a
    place that two of five cameras see, and leans forward by `lean` metres a metre. One square there
    is of `hold`."""
    x, z = np.meshgrid(np.arange(41) / 10, np.arange(21) / 10)
    vertices = np.stack([x, -lean * np.maximum(0, x - 2.9), z], axis=-1).reshape(-1, 3)
    a = (np.arange(20)[:, None] * 41 + np.arange(40)).ravel()
    faces = np.vstack([np.stack([a, a + 1, a + 42], 1), np.stack([a, a + 42, a + 41], 1)])
    middle = vertices[faces].mean(axis=1)
    hole = (np.abs(middle[:, 0] - 2) < 0.3) & (np.abs(middle[:, 2] - 1) < 0.3)
    mesh = Mesh(vertices, faces[~hole].astype(np.int32))
    labels = np.zeros(len(mesh.faces), np.int32)
    labels[np.abs(mesh.centroids[:, ::2] - [3.6, 1.0]).max(axis=1) < 0.1] = hold
    turn = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # x right, y down, z forward
    camera = Camera("SIMPLE_PINHOLE", 400, 400, (200.0, 200.0, 200.0))
    views = []
    for number, place in enumerate((0.8, 1.0, 1.2, 1.0, 1.4)):
        # Each sees 2 m to both sides of its place; the last two see 3 m.
        centre = np.array([place, -2.0 if number < 3 else -3.0, 1.0])
        views.append(View(f"{number}.jpg", camera, np.column_stack([turn, -turn @ centre])))
    return WallModel(mesh, labels, None, None, [], [], metric=True, views=tuple(views))


def test_a_slab_that_few_photos_see_is_left_out() -> None:
    wall = slab()
    left = wall.mesh.centroids[loose_faces(wall)]
    assert left[:, 0].min() > 2.9
    right = wall.mesh.centroids[:, 0] > 3.3
    assert loose_faces(wall)[right].all()
    held = slab(hold=7)
    assert not loose_faces(held).any()
    edge = slab(lean=0.0)  # few photos see it, but it is the wall's own
    assert not loose_faces(edge).any()
    unknown = replace(wall, views=wall.views[:3])
    assert not loose_faces(unknown).any()


def test_a_hole_is_no_outline() -> None:
    mesh = slab().mesh
    outline = mesh.vertices[outline_vertices(mesh, face_neighbours(mesh.faces))]
    on_edge = (outline[:, 0] % 4 < 1e-9) | (outline[:, 2] % 2 < 1e-9)
    assert on_edge.all()
    assert len(outline) == 2 * (40 + 20)
