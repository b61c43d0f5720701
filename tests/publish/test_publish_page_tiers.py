"""The page's tiers: no edit makes or writes one; what they are made from does."""

from __future__ import annotations

import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from glbfile import Glb  # type: ignore[import-not-found]
from made_scan import build_scan, export_scan  # type: ignore[import-not-found]
from msgspec import structs

from walltopo.publish.page_tiers import page_tiers
from walltopo.publish.settings import ExportSettings
from walltopo.publish.surface import mixed_triangles
from walltopo.publish.tiers import TierBuilder
from walltopo.publish.wall_data import WallModel, read_wall
from walltopo.scans.holds import Holds
from walltopo.scans.instances import Relabelled
from walltopo.scans.page_labels import PageLabels

SETTINGS = ExportSettings(
    first_triangles=1000,
    detail_triangles=2500,
    first_texture=128,
    detail_texture=128,
    archive_texture=128,
)


@pytest.fixture(scope="module")
def wall(tmp_path_factory: pytest.TempPathFactory) -> WallModel:
    return read_wall(build_scan(tmp_path_factory.mktemp("tiers") / "scan", cells=60))


def test_an_edit_writes_labels_and_no_geometry(tmp_path: Path) -> None:
    scan = build_scan(tmp_path / "scan", cells=60)
    export_scan(scan, SETTINGS)
    tiers = [
        scan.page_assets / f"{name}.{kind}"
        for name in ("first", "detail")
        for kind in ("glb", "js")
    ]
    before = [(path.stat().st_ino, path.stat().st_mtime_ns) for path in tiers]
    face = np.flatnonzero(read_wall(scan).face_instance == 0)[:100].astype(np.int32)
    Relabelled(face, np.full(100, 3, np.int32)).save(scan.relabelled)
    table = Holds.load(scan.holds)
    kept = tuple(row for row in table.holds if row.id != 7)
    structs.replace(table, holds=kept).save(scan.holds)
    export_scan(scan, replace(SETTINGS, title="Owl"))
    assert [(path.stat().st_ino, path.stat().st_mtime_ns) for path in tiers] == before
    labels = PageLabels.load(scan.page_assets / "labels.json")
    assert labels.title == "Owl"
    assert 7 not in {row.id for row in labels.holds}
    assert labels.surface.patches == ((7, 0),)
    assert [(group.label, len(group.places)) for group in labels.surface.changed] == [(3, 300)]


def test_tiers_are_cut_along_patches(wall: WallModel) -> None:
    assert wall.patches is not None
    bare = replace(wall, face_instance=wall.patches)
    surface = TierBuilder(bare, SETTINGS).textured_surface("first").surface
    assert mixed_triangles(surface) == 0
    assert set(np.unique(surface.feature)) == set(np.unique(wall.patches))


def test_another_shape_other_settings_or_damage_make_them_anew(
    wall: WallModel, tmp_path: Path
) -> None:
    def made(wall: WallModel, settings: ExportSettings = SETTINGS) -> bool:
        before = (tmp_path / "tiers" / "first.glb").stat().st_ino if made_once else 0
        tiers = page_tiers(wall, settings, tmp_path / "tiers")
        return (tiers.folder / "first.glb").stat().st_ino != before

    made_once = False
    assert made(wall)
    made_once = True
    assert not made(wall)
    none = np.zeros(len(wall.mesh.faces), dtype=np.int32)
    assert not made(replace(wall, title="Owl", holds=[], routes=[], face_instance=none))
    moved = replace(wall, mesh=replace(wall.mesh, vertices=wall.mesh.vertices + 0.5))
    assert made(moved)
    assert made(wall)
    assert made(wall, replace(SETTINGS, first_triangles=1200))
    assert not made(wall, replace(SETTINGS, first_triangles=1200, archive_triangles=9))
    assert made(wall)
    for damage in ("first.glb", "first.npz", "index.json"):
        (tmp_path / "tiers" / damage).write_bytes(b"damaged")
        assert made(wall), damage


def test_the_first_tier_is_there_for_drawings(wall: WallModel, tmp_path: Path) -> None:
    tiers = page_tiers(wall, SETTINGS, tmp_path / "tiers")
    look = tiers.first()
    assert len(look.surface.triangles) == tiers.triangles["first"]
    assert look.picture is not None
    assert look.picture.shape[2] == 3


def test_files_for_phones_need_no_extension(wall: WallModel, tmp_path: Path) -> None:
    plain = page_tiers(wall, SETTINGS, tmp_path / "tiers")
    (tmp_path / "plain").mkdir()
    plain.link_into(tmp_path / "plain")
    assert not {path.name for path in (tmp_path / "plain").iterdir()} & {"ar.glb", "ar.usdz"}
    made = page_tiers(wall, replace(SETTINGS, ar_files=True), tmp_path / "tiers")
    (tmp_path / "page").mkdir()
    made.link_into(tmp_path / "page")
    glb = Glb.read(tmp_path / "page" / "ar.glb")
    assert "extensionsRequired" not in glb.json
    assert [image["mimeType"] for image in glb.json["images"]] == ["image/jpeg"]
    indices = glb.json["meshes"][0]["primitives"][0]["indices"]
    assert glb.json["accessors"][indices]["count"] == 3 * made.triangles["first"]
    with zipfile.ZipFile(tmp_path / "page" / "ar.usdz") as archive:
        assert archive.namelist() == ["wall.usda", "textures/wall.jpg"]
