"""Routes for the fingers: the relief is closed and true to scale, and says its name in Braille."""

from __future__ import annotations

import zipfile
from collections import Counter
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import trimesh

from walltopo.cli import main
from walltopo.core import InputError, Mesh
from walltopo.publish.convert import convert, one_route
from walltopo.publish.tactile.braille import braille_cells, braille_dots
from walltopo.publish.tactile.relief import PITCH_M, SCALE, Relief, route_relief
from walltopo.publish.tactile.solid import solid_of, write_3mf, write_stl
from walltopo.publish.wall_data import WallModel
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Hold
from walltopo.scans.routes import Route, Routes

STEP = 0.02  # m between the vertices of the wall
PLACES = {1: (0.6, 0.8), 2: (0.9, 1.4), 3: (0.6, 2.2), 4: (0.3, 1.5)}  # 4 is of no route
HEIGHT = 0.06  # m of a hold


def wall(*, metric: bool = True) -> WallModel:
    """Return a plane wall that overhangs by 20 degrees, with four square holds."""
    right, up = np.meshgrid(np.arange(0, 1.5, STEP), np.arange(0.1, 3.0, STEP))
    out = np.zeros_like(right)
    number = np.zeros(right.shape, dtype=np.int32)
    for hold, (x, y) in PLACES.items():
        near = (abs(right - x) < 0.06) & (abs(up - y) < 0.06)
        out[near], number[near] = HEIGHT, hold
    lean = np.radians(20)
    normal = np.array([0, -np.cos(lean), -np.sin(lean)])
    along = np.array([0, -np.sin(lean), np.cos(lean)])
    vertices = (
        right[..., None] * [1, 0, 0] + up[..., None] * along + out[..., None] * normal
    ).reshape(-1, 3)
    index = np.arange(right.size).reshape(right.shape)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]
    faces = np.concatenate(
        [np.stack(corners, -1).reshape(-1, 3) for corners in ((a, b, c), (b, d, c))]
    ).astype(np.int32)
    holds = [Hold(id=hold, kind="hold", position=(x, -y, y)) for hold, (x, y) in PLACES.items()]
    route = Route(1, name="Blue 2", holds=(1, 2, 3), start=(1,), top=(3,))
    labels = number.ravel()[faces].max(axis=1)
    return WallModel(Mesh(vertices, faces), labels, None, None, holds, [route], metric)


@pytest.fixture(scope="module")
def relief() -> Relief:
    model = wall()
    return route_relief(model, model.routes[0])


def at(relief: Relief, hold: int) -> tuple[int, int]:
    """Return the pixel of a hold, by its distance from the route's lowest hold."""
    rows, columns = np.nonzero(relief.starts)
    right, up = np.subtract(PLACES[hold], PLACES[1]) / SCALE / PITCH_M
    return round(rows.mean() - up), round(columns.mean() + right)


def test_the_scale_is_true(relief: Relief) -> None:
    rows, columns = np.nonzero(relief.tops)
    assert (rows.mean(), columns.mean()) == pytest.approx(at(relief, 3), abs=1.5)
    width, height = relief.size
    assert 0.3 + 0.5 < width * SCALE < 0.3 + 0.9
    assert 1.4 + 0.5 < height * SCALE - 0.012 * SCALE < 1.4 + 0.9


def test_only_the_holds_of_the_route_are_raised(relief: Relief) -> None:
    ground = float(np.median(relief.heights[: at(relief, 3)[0]]))
    for hold in (1, 2, 3):
        assert relief.heights[at(relief, hold)] - ground == pytest.approx(HEIGHT / SCALE, rel=0.1)
    assert relief.heights[at(relief, 4)] == pytest.approx(ground, abs=2e-4)
    assert relief.heights.min() > 0.0015


def test_a_start_has_one_ring_and_a_top_two(relief: Relief) -> None:
    ground = float(np.median(relief.heights[: at(relief, 3)[0]]))
    for hold, rings in ((1, 1), (2, 0), (3, 2)):
        row, column = at(relief, hold)
        line = relief.heights[row, column:] > ground + 0.0005
        assert np.count_nonzero(np.diff(line.astype(int)) == 1) == rings


def test_the_solid_is_closed_and_has_the_volume_of_its_heights(relief: Relief) -> None:
    vertices, faces = solid_of(relief.heights, PITCH_M)
    edges = Counter(
        map(tuple, np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).tolist())
    )
    assert set(edges.values()) == {1}
    assert all((b, a) in edges for a, b in edges)
    corners = vertices[faces]
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    h = relief.heights
    mean = (h[:-1, :-1] + h[1:, :-1] + h[:-1, 1:] + h[1:, 1:]).sum() / 4 * PITCH_M**2
    assert volume == pytest.approx(mean, rel=2e-3)


def test_files_for_printers_are_in_millimetres(tmp_path: Path) -> None:
    vertices, faces = solid_of(np.full((3, 4), 0.002), 0.01)
    write_stl(tmp_path / "a.stl", vertices, faces)
    read = trimesh.load(tmp_path / "a.stl")
    assert read.is_watertight
    assert read.extents.tolist() == pytest.approx([30.0, 20.0, 2.0])
    assert read.volume == pytest.approx(30 * 20 * 2)
    write_3mf(tmp_path / "a.3mf", vertices, faces)
    with zipfile.ZipFile(tmp_path / "a.3mf") as archive:
        assert set(archive.namelist()) == {
            "[Content_Types].xml", "_rels/.rels", "3D/3dmodel.model",
        }  # fmt: skip
        model = ElementTree.fromstring(archive.read("3D/3dmodel.model"))
    assert model.attrib["unit"] == "millimeter"
    assert sum(1 for one in model.iter() if one.tag.endswith("triangle")) == len(faces)
    assert max(float(v.attrib["x"]) for v in model.iter() if v.tag.endswith("vertex")) == 30.0


def test_braille() -> None:
    assert braille_cells("Abc") == ["1", "12", "14"]
    assert braille_cells("Blue 2") == ["12", "123", "136", "15", "", "3456", "12"]
    assert braille_cells("6a+") == ["3456", "124", "56", "1", "235"]
    assert braille_cells("10b") == ["3456", "1", "245", "56", "12"]
    assert braille_cells("Žlutá 6C") == [*braille_cells("zluta"), "", "3456", "124", "56", "14"]
    assert braille_dots("b").tolist() == [[0.0, 0.0], [0.0, 0.0025]]
    assert braille_dots("").shape == (0, 2)


def test_the_label_fits(relief: Relief) -> None:
    assert relief.label == "Blue 2"
    model = wall()
    name = "A name that is far too long for a line"
    label = route_relief(model, Route(1, name=name, holds=(1, 2, 3), start=(1,), top=(3,))).label
    assert name.startswith(label)
    assert 15 < len(label) < len(name)


def test_what_cannot_be_a_relief_says_why(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no scale"):
        convert(one_route(wall(metric=False), 1), "tactile", tmp_path / "a")
    with pytest.raises(InputError, match="no route 7"):
        one_route(wall(), 7)
    empty = Route(2, name="Empty")
    with pytest.raises(InputError, match="Empty has no holds"):
        route_relief(wall(), empty)


def test_the_command(tiny_scan: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    route = Routes.load(ScanFolder(tiny_scan).routes).routes[0].id
    out = tmp_path / "relief"
    arguments = ["export", str(tiny_scan), "--format", "tactile", "-o", str(out)]
    assert main(arguments) != 0
    assert "Choose it with --route" in capsys.readouterr().err.replace("\n", " ")
    assert not out.exists()
    assert main([*arguments, "--route", str(route)]) == 0
    made = {path.name for path in out.iterdir() if not path.name.startswith(".")}
    assert made == {"drawing.pdf", "relief.3mf", "relief.stl"}
    assert (out / "drawing.pdf").read_bytes().startswith(b"%PDF")
