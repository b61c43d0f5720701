"""Tiers that are kept over an export: relabelled where labels changed, and nothing made anew."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_scan import build_scan  # type: ignore[import-not-found]

from walltopo.geometry.topology import edges_of
from walltopo.publish.relabel import relabelled
from walltopo.publish.settings import ExportSettings
from walltopo.publish.surface import mixed_triangles
from walltopo.publish.tiers import TierBuilder
from walltopo.publish.wall_data import Wall, read_wall

SETTINGS = ExportSettings(first_triangles=1000, detail_triangles=2500, first_texture=128,
                          detail_texture=128, archive_texture=128)  # fmt: skip


@pytest.fixture(scope="module")
def wall(tmp_path_factory: pytest.TempPathFactory) -> Wall:
    return read_wall(build_scan(tmp_path_factory.mktemp("relabel") / "scan", cells=60))


def painted(wall: Wall, number: int, radius: float) -> Wall:
    """A ball around a hold's rim goes to a hold."""
    place = np.array(wall.holds[4].position) + [0.2, 0.0, 0.0]
    near = np.linalg.norm(wall.mesh.centroids - place, axis=1) < radius
    return replace(wall, face_instance=np.where(near, number, wall.face_instance).astype(np.int32))


def area_of(builder: TierBuilder, name: str, label: int) -> float:
    surface = builder.surface(name)
    own = surface.feature[surface.triangles[:, 0]] == label
    return float(surface.mesh.areas[own].sum())


@pytest.mark.parametrize("name", ["first", "detail", "archive"])
def test_a_kept_tier_has_the_labels_of_now(wall: Wall, tmp_path: Path, name: str) -> None:
    made = TierBuilder(wall, SETTINGS, tmp_path)
    before = made.surface(name)
    changed = painted(wall, 9, 0.15)
    builder = TierBuilder(changed, SETTINGS, tmp_path)
    after = builder.surface(name)
    assert mixed_triangles(after) == 0
    for label in (0, 5, 9):
        true = float(wall.mesh.areas[changed.face_instance == label].sum())
        assert area_of(builder, name, label) == pytest.approx(true, rel=0.08), label
    # The surface itself is where it was, without a crack: as many open edges by place as before.
    assert float(after.mesh.areas.sum()) == pytest.approx(float(before.mesh.areas.sum()), rel=1e-5)
    assert rim(after.positions, after.triangles) == pytest.approx(
        rim(before.positions, before.triangles), rel=1e-5
    )
    assert builder.drawn(name).surface.triangles.shape == before.triangles.shape
    if name == "archive":
        assert len(after.triangles) == len(before.triangles)


def rim(positions: np.ndarray, triangles: np.ndarray) -> float:
    """Length of the edges that one triangle alone has, vertices at one place being one."""
    places, index = np.unique(positions, axis=0, return_inverse=True)
    edges = edges_of(index.ravel()[triangles].astype(np.int32))
    alone = edges.pairs[np.bincount(edges.of_face.ravel(), minlength=len(edges.pairs)) == 1]
    return float(np.linalg.norm(places[alone[:, 0]] - places[alone[:, 1]], axis=1).sum())


def test_a_name_makes_no_geometry(
    wall: Wall, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    glb = TierBuilder(wall, SETTINGS, tmp_path).glb("first")

    def never(*_: object) -> None:
        raise AssertionError("a tier was made anew")

    monkeypatch.setattr(TierBuilder, "_make", never)
    assert TierBuilder(wall, SETTINGS, tmp_path).glb("first") == glb
    renamed = replace(wall, title="Owl")
    assert b"Owl" in TierBuilder(renamed, SETTINGS, tmp_path).glb("first")


def test_another_shape_other_settings_or_damage_make_it_anew(wall: Wall, tmp_path: Path) -> None:
    def made(wall: Wall, settings: ExportSettings = SETTINGS) -> bool:
        builder = TierBuilder(wall, settings, tmp_path)
        builder.surface("first")
        builder._pictures["first"].result()  # it is kept once its picture is encoded
        return "first" in builder._looks

    assert made(wall)
    assert not made(wall)
    moved = replace(wall, mesh=replace(wall.mesh, vertices=wall.mesh.vertices + 0.5))
    assert made(moved)
    assert made(wall)
    assert made(wall, replace(SETTINGS, first_triangles=1200))
    assert made(wall)
    (tmp_path / "first.npz").write_bytes(b"PK\x03\x04 damaged")
    assert made(wall)
    assert made(painted(wall, 9, 2.0)), "so much is no edit"


def test_nothing_changes_where_no_label_did(wall: Wall) -> None:
    surface = TierBuilder(wall, SETTINGS).surface("first")
    assert relabelled(surface, wall.mesh, wall.face_instance, wall.face_instance) is surface
