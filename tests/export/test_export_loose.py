"""Loose pieces of surface: in the archive, not on the page."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from walltopo.core import Mesh
from walltopo.export.contract import ExportSettings
from walltopo.export.loose import loose_faces, without_loose
from walltopo.export.tiers import TierBuilder
from walltopo.export.wall import Wall, read_wall
from walltopo.scans.folder import ScanFolder

MakeScan = Callable[..., ScanFolder]


def with_scrap(wall: Wall, size: float, label: int) -> Wall:
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
    sizes = {name: len(builder.look(name).surface.triangles) for name in ("archive", "detail")}
    assert sizes == {"archive": count + 1, "detail": count}
