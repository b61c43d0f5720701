"""The GLB: what a reader of the specification finds in it."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from glbfile import Glb  # type: ignore[import-not-found]

from walltopo.publish.settings import ExportSettings
from walltopo.publish.surface import Surface
from walltopo.publish.tiers import TierBuilder
from walltopo.publish.wall_data import WallModel, read_wall
from walltopo.scans.folder import ScanFolder

MakeScan = Callable[..., ScanFolder]


def build_tier(wall: WallModel, name: str, settings: ExportSettings) -> tuple[bytes, Surface]:
    builder = TierBuilder(wall, settings)
    return builder.glb(name), builder.textured_surface(name).surface


@pytest.fixture
def wall(make_scan: MakeScan) -> WallModel:
    return read_wall(make_scan())


@pytest.mark.parametrize("tier", ["archive", "first", "detail"])
def test_ids_and_tables(wall: WallModel, tier: str) -> None:
    data, surface = build_tier(wall, tier, ExportSettings(first_triangles=2000))
    glb = Glb(data)
    ids = glb.attribute("_FEATURE_ID_0").astype(int)
    corner = ids[glb.triangles()]
    assert (corner == corner[:, :1]).all(), "a triangle mixes two holds"
    assert set(ids) == set(range(13))
    np.testing.assert_array_equal(ids, surface.feature)
    feature = glb.primitive["extensions"]["EXT_mesh_features"]["featureIds"][0]
    assert feature["attribute"] == 0
    assert feature["featureCount"] == 13
    assert glb.column(0, "class")[0] == "wall"
    assert glb.column(0, "colour")[1:] == [hold.colour for hold in wall.holds]
    np.testing.assert_allclose(
        glb.column(0, "position")[1:], [hold.position for hold in wall.holds], atol=1e-6
    )
    assert glb.column(1, "holds") == [list(route.holds) for route in wall.routes]
    extras = glb.json["scenes"][0]["extras"]["walltopo"]
    assert extras["holds"] == json.loads(msgspec.json.encode(wall.holds))
    assert extras["routes"] == json.loads(msgspec.json.encode(wall.routes))


def test_wall_glb_tells_guesses_apart(wall: WallModel) -> None:
    guessed = np.zeros(len(wall.mesh.faces), dtype=np.bool_)
    guessed[::3] = True
    wall = replace(wall, mesh=replace(wall.mesh, guessed=guessed))
    builder = TierBuilder(wall, ExportSettings(first_triangles=2000))
    glb = Glb(builder.glb("archive"))
    corner = glb.attribute("_FEATURE_ID_1").astype(int)[glb.triangles()]
    assert (corner == corner[:, :1]).all(), "a triangle is both"
    assert (corner[:, 0] == 1).sum() == guessed.sum()
    feature = glb.primitive["extensions"]["EXT_mesh_features"]["featureIds"][1]
    table = feature["propertyTable"]
    assert glb.column(table, "origin") == ["measured", "guessed"]
    areas = [wall.mesh.areas[~guessed].sum(), wall.mesh.areas[guessed].sum()]
    np.testing.assert_allclose(glb.column(table, "area_m2"), areas, rtol=1e-5)
    assert "_FEATURE_ID_1" not in Glb(builder.glb("first")).primitive["attributes"]


def test_quantised_positions_land_where_they_were(wall: WallModel) -> None:
    data, surface = build_tier(wall, "first", ExportSettings())
    glb = Glb(data)
    node = glb.json["nodes"][1]
    places = glb.attribute("POSITION") * np.array(node["scale"]) + np.array(node["translation"])
    # Half a step of 65,535 over 6 m, per axis.
    assert np.abs(places - surface.positions).max() <= 0.51 * 6.0 / 65535


def test_archive_needs_no_extension(wall: WallModel) -> None:
    """Any viewer opens it: what is not core glTF is optional."""
    data, surface = build_tier(wall, "archive", ExportSettings())
    glb = Glb(data)
    assert "extensionsRequired" not in glb.json
    assert len(surface.triangles) == len(wall.mesh.faces)
    assert glb.json["images"][0]["mimeType"] == "image/jpeg"


def test_a_gap_in_the_ids_keeps_its_row(wall: WallModel) -> None:
    """A deleted hold leaves a row of class none, so that ids stay those of holds.json."""
    holds = [hold for hold in wall.holds if hold.id != 5]
    keep = np.where(wall.face_instance == 5, 0, wall.face_instance)
    data, _ = build_tier(
        replace(wall, holds=holds, face_instance=keep), "archive", ExportSettings()
    )
    classes = Glb(data).column(0, "class")
    assert classes[5] == "none"
    assert classes[6] == "hold"


def test_without_texture_and_without_holds(make_scan: MakeScan) -> None:
    wall = replace(read_wall(make_scan(holds=0, cells=20)), uv=None, texture=None)
    glb = Glb(build_tier(wall, "first", ExportSettings())[0])
    assert "images" not in glb.json
    assert not glb.attribute("_FEATURE_ID_0").any()
    assert glb.json["scenes"][0]["extras"]["walltopo"]["holds"] == []
