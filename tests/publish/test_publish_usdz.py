"""USDZ: the archive's rules, and that a USD library reads it (where one is installed)."""

from __future__ import annotations

import struct
import zipfile
from collections.abc import Callable
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from walltopo.publish.convert import convert
from walltopo.publish.wall_data import WallModel, read_wall
from walltopo.scans.folder import ScanFolder

MakeScan = Callable[..., ScanFolder]


@pytest.fixture
def wall(make_scan: MakeScan) -> WallModel:
    return read_wall(make_scan(cells=40))


def test_archive_follows_the_rules(wall: WallModel, tmp_path: Path) -> None:
    path = tmp_path / "wall.usdz"
    convert(wall, "usdz", path)
    data = path.read_bytes()
    with zipfile.ZipFile(BytesIO(data)) as archive:
        entries = archive.infolist()
        assert archive.testzip() is None
        stage = archive.read("wall.usda").decode("ascii")
        picture = Image.open(BytesIO(archive.read("textures/wall.jpg")))
    assert [entry.filename for entry in entries] == ["wall.usda", "textures/wall.jpg"]
    for entry in entries:
        assert entry.compress_type == zipfile.ZIP_STORED
        name, extra = struct.unpack_from("<HH", data, entry.header_offset + 26)
        assert (entry.header_offset + 30 + name + extra) % 64 == 0
    assert picture.format == "JPEG"
    assert stage.startswith("#usda 1.0")
    assert stage.count("def GeomSubset") == len(wall.holds)
    convert(wall, "usdz", tmp_path / "again.usdz")
    assert (tmp_path / "again.usdz").read_bytes() == data


def test_names_with_markup_do_not_get_in(wall: WallModel, tmp_path: Path) -> None:
    convert(replace(wall, title='"\n} bad'), "usdz", tmp_path / "wall.usdz")
    with zipfile.ZipFile(tmp_path / "wall.usdz") as archive:
        assert b"bad" not in archive.read("wall.usda")


@pytest.mark.parametrize("textured", [True, False])
def test_usd_reads_it(make_scan: MakeScan, tmp_path: Path, textured: bool) -> None:
    """With `pip install usd-core`: geometry, units, groups of faces and material come back."""
    usd = pytest.importorskip("pxr.Usd", reason="usd-core is not installed")
    geometry = pytest.importorskip("pxr.UsdGeom")
    shading = pytest.importorskip("pxr.UsdShade")
    wall = read_wall(make_scan(cells=40))
    if not textured:
        wall = replace(wall, uv=None, texture=None)
    path = tmp_path / "wall.usdz"
    convert(wall, "usdz", path)
    stage = usd.Stage.Open(str(path))
    assert geometry.GetStageUpAxis(stage) == "Y"
    assert geometry.GetStageMetersPerUnit(stage) == 1.0
    mesh = geometry.Mesh(stage.GetPrimAtPath("/Wall/Surface"))
    points = np.array(mesh.GetPointsAttr().Get())
    corners = np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3)
    box = wall.mesh.vertices[wall.mesh.faces].reshape(-1, 3)[:, [0, 2, 1]] * [1, 1, -1]
    np.testing.assert_allclose(
        points[corners].reshape(-1, 3).min(axis=0), box.min(axis=0), atol=1e-4
    )
    np.testing.assert_allclose(
        points[corners].reshape(-1, 3).max(axis=0), box.max(axis=0), atol=1e-4
    )
    assert len(corners) == len(wall.mesh.faces)
    subsets = geometry.Subset.GetGeomSubsets(mesh, "face", "holds")
    sizes = {s.GetPrim().GetName(): len(s.GetIndicesAttr().Get()) for s in subsets}
    ids, counts = np.unique(wall.face_instance[wall.face_instance > 0], return_counts=True)
    assert sizes == {f"hold_{i}": n for i, n in zip(ids.tolist(), counts.tolist(), strict=True)}
    material, _ = shading.MaterialBindingAPI(mesh.GetPrim()).ComputeBoundMaterial()
    surface, *_ = material.ComputeSurfaceSource()
    assert surface.GetShaderId() == "UsdPreviewSurface"
    assert bool(surface.GetInput("diffuseColor").HasConnectedSource()) is textured
