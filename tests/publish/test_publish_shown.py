"""The page shows the wall without floor, room and loose pieces; the archive has all."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.geometry.topology import joined_meshes
from walltopo.publish import tiers
from walltopo.publish.coarse_wall import coarse_wall
from walltopo.publish.page_tiers import TIERS, page_tiers, read_shown_wall
from walltopo.publish.settings import ExportSettings
from walltopo.publish.shown import part_shown, shown_faces
from walltopo.publish.surroundings import HAND, hand_of, surroundings
from walltopo.publish.tiers import TierBuilder
from walltopo.publish.wall_data import WallModel, read_wall
from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Manifest

MakeScan = Callable[..., ScanFolder]
Bools = NDArray[np.bool_]
Labels = NDArray[np.int32]
STEP = 0.05  # m


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


def shown(wall: WallModel, **options: bool) -> WallModel:
    coarse = coarse_wall(wall.mesh, wall.face_instance)
    return part_shown(wall, shown_faces(wall, coarse, **options))


def test_a_small_piece_stays_with_a_hold_alone(make_scan: MakeScan) -> None:
    plain = read_wall(make_scan())
    assert shown(plain, all_around=True) is plain
    count = len(plain.mesh.faces)
    assert len(shown(with_scrap(plain, 0.3, 0), all_around=True).mesh.faces) == count
    assert len(shown(with_scrap(plain, 0.3, 3), all_around=True).mesh.faces) == count + 1
    assert len(shown(with_scrap(plain, 1.5, 0), all_around=True).mesh.faces) == count + 1
    assert len(shown(with_scrap(plain, 1.5, 0)).mesh.faces) == count


def test_page_leaves_out_what_the_archive_keeps(make_scan: MakeScan) -> None:
    plain = read_wall(make_scan())
    builder = TierBuilder(with_scrap(plain, 1.5, 0), ExportSettings())
    count = len(plain.mesh.faces)
    sizes = {
        name: len(builder.textured_surface(name).surface.triangles)
        for name in ("archive", "detail")
    }
    assert sizes == {"archive": count + 1, "detail": count}
    every = TierBuilder(with_scrap(plain, 1.5, 0), ExportSettings(surroundings=True))
    assert len(every.textured_surface("detail").surface.triangles) == count + 1


def test_pictures_show_what_the_page_shows(make_scan: MakeScan) -> None:
    scan = make_scan()
    whole = len(read_wall(scan).mesh.faces)
    shows = len(read_shown_wall(scan).mesh.faces)
    manifest = Manifest.load(scan.manifest)
    manifest.settings.setdefault("export", {})["surroundings"] = True
    manifest.save(scan.manifest)
    assert shows <= len(read_shown_wall(scan).mesh.faces) == whole


def test_pictures_find_what_the_page_shows_beside_its_tiers(
    make_scan: MakeScan, monkeypatch: pytest.MonkeyPatch
) -> None:
    scan = make_scan()
    fresh = read_shown_wall(scan)
    page_tiers(read_wall(scan), ExportSettings(), scan.work / TIERS)
    monkeypatch.delattr(tiers, "shown_faces")
    assert np.array_equal(read_shown_wall(scan).mesh.faces, fresh.mesh.faces)


def sheet(path: Sequence[tuple[float, float]], wide: float = 4.0) -> Mesh:
    """A sheet of `wide` metres in x that follows a path of (y, z) points."""
    corners = np.array(path)
    along = np.append(0.0, np.linalg.norm(np.diff(corners, axis=0), axis=1).cumsum())
    at = np.arange(0.0, along[-1] + 1e-9, STEP)
    columns = np.arange(0.0, wide + 1e-9, STEP)
    y, z = (np.interp(at, along, corners[:, k]) for k in (0, 1))
    x = np.broadcast_to(columns, (len(at), len(columns)))
    vertices = np.stack([x, *np.broadcast_arrays(y[:, None], z[:, None], x)[:2]], axis=-1)
    n = len(columns)
    a = (np.arange(len(at) - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.vstack([np.stack([a, a + 1, a + n + 1], 1), np.stack([a, a + n + 1, a + n], 1)])
    return Mesh(vertices.reshape(-1, 3), faces.astype(np.int32))


def with_holds(mesh: Mesh, places: Sequence[tuple[float, float, float]]) -> Labels:
    """Holds of 20 cm at these places."""
    labels = np.zeros(len(mesh.faces), np.int32)
    for number, place in enumerate(places, start=1):
        labels[np.abs(mesh.centroids - place).max(axis=1) < 0.1] = number
    return labels


def cut(mesh: Mesh, labels: Labels, hand: float = HAND) -> Bools:
    """The faces that are left out; a hold never is."""
    found = surroundings(coarse_wall(mesh, labels), mesh, hand)
    assert not found[labels > 0].any()
    return found


ON_WALL = [(x, 0.0, z) for x in (0.5, 1.5, 2.5, 3.5) for z in (0.6, 1.4, 2.4)]


def test_mats_and_ceiling_go_but_for_a_hand_s_breadth() -> None:
    mesh = sheet([(-3, 0), (0, 0), (0, 3), (-3, 3)])
    found = cut(mesh, with_holds(mesh, ON_WALL))
    away = -mesh.centroids[:, 1]
    assert found[away > HAND + STEP].all()
    assert not found[away < HAND - STEP].any()


def test_an_overhang_without_holds_stays_between_others() -> None:
    mesh = sheet([(-3, 0), (0, 0), (0, 1), (-1.2, 2.0), (-1.2, 3)])
    places = [(x, y, z) for x in (0.5, 1.5, 2.5, 3.5) for y, z in ((0, 0.5), (-1.2, 2.5))]
    found = cut(mesh, with_holds(mesh, places))
    assert not found[mesh.centroids[:, 2] > 0.01].any()


def test_a_volume_that_nobody_found_stays() -> None:
    mesh = sheet([(0, 0), (0, 3)])
    height = np.abs(mesh.vertices[:, [0, 2]] - [2.0, 1.5]).max(axis=1)
    bulge = mesh.vertices - np.maximum(0.0, 0.5 - height)[:, None] * [0, 1, 0]
    places = [place for place in ON_WALL if abs(place[0] - 2) > 0.6]
    assert not cut(Mesh(bulge, mesh.faces), with_holds(mesh, places)).any()


def test_a_room_s_wall_with_one_imagined_hold_goes_but_around_it() -> None:
    wall, behind = sheet([(0, 0), (0, 3)]), sheet([(1, 0), (1, 4)])
    mesh = joined_meshes([wall, behind])
    labels = with_holds(mesh, [*ON_WALL, (2.0, 1.0, 2.0)])
    found = cut(mesh, labels)
    assert not found[: len(wall.faces)].any()
    away = np.linalg.norm(mesh.centroids - [2.0, 1.0, 2.0], axis=1)
    room = mesh.centroids[:, 1] > 0.5
    assert found[room & (away > HAND + 0.2)].all()
    assert not found[room & (away < HAND)].any()


def test_without_holds_nothing_is_left_out() -> None:
    mesh = sheet([(-3, 0), (0, 0), (0, 3)])
    assert not cut(mesh, np.zeros(len(mesh.faces), np.int32)).any()


@pytest.mark.parametrize("size", [1.0, 30.0])
def test_a_scan_without_a_scale_is_cut_the_same(size: float) -> None:
    mesh = sheet([(-3, 0), (0, 0), (0, 3)])
    labels = with_holds(mesh, ON_WALL)
    other = Mesh(mesh.vertices * size, mesh.faces)
    hand = hand_of(coarse_wall(other, labels), metric=False)
    assert hand == pytest.approx(0.2 * size, rel=0.3)
    assert (cut(other, labels, hand) == cut(mesh, labels, hand / size)).all()
